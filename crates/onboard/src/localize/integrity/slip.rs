//! Whether the odometer slips.
//!
//! A tracker that expects slip runs beside the one that trusts the odometer. How much better either
//! foretells the angles says which is right (multiple-model estimation, Magill 1965); slip begins as
//! rare as it is said to be, and anew each time that the vehicle sets off. As long as it is likelier
//! than the risk that is promised, the protection level holds for that tracker too. Where the
//! geometry cannot tell them apart, that is until the odometer is proved otherwise.

use crate::clone_in_place::clone_in_place;
use crate::localize::initialise::log_likelihood;
use crate::localize::measurement::{AngleMeasurement, UpdateVerdict};
use crate::localize::tracker::Tracker;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// Largest logarithm of the odds, either way: what more evidence there is must be forgotten some time.
const SURE: f64 = 20.0;

/// A tracker that does not trust the odometer, and how likely it is to be the right one.
#[derive(Debug)]
pub(super) struct Slip {
    tracker: Tracker,
    log_odds: f64,
    log_odds_at_start: f64,
    is_standing: bool,
}

clone_in_place!(Slip {
    tracker,
    log_odds,
    log_odds_at_start,
    is_standing
});

impl Slip {
    /// Slip of the odometer of a tracker, of this probability whenever the vehicle sets off.
    pub fn new(tracker: &Tracker, probability: f64) -> Self {
        let log_odds = (probability / (1.0 - probability)).ln();
        let mut tracker = tracker.clone();
        tracker.distrust_odometer();
        Self {
            tracker,
            log_odds,
            log_odds_at_start: log_odds,
            is_standing: false,
        }
    }

    /// Begins anew beside another tracker.
    pub fn restart(&mut self, tracker: &Tracker) {
        self.tracker.clone_from(tracker);
        self.tracker.distrust_odometer();
        self.log_odds = self.log_odds_at_start;
    }

    /// Moves on by an odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) {
        if self.is_standing && sample.speed_mps != 0.0 {
            self.log_odds = self.log_odds.max(self.log_odds_at_start);
        }
        self.is_standing = sample.speed_mps == 0.0;
        self.tracker.odometry(sample);
    }

    /// Takes in an angle, which the tracker `sound` takes in too.
    pub fn update(
        &mut self,
        sound: &mut Tracker,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> UpdateVerdict {
        let take_in = |tracker: &mut Tracker| {
            let innovation = tracker.innovation(head, measured);
            let verdict = tracker.update(head, measured);
            (log_likelihood(innovation, &verdict), verdict)
        };
        let (if_slipping, _) = take_in(&mut self.tracker);
        let (if_sound, verdict) = take_in(sound);
        self.log_odds = (self.log_odds + if_slipping - if_sound).clamp(-SURE, SURE);
        verdict
    }

    /// The tracker, where slip is likelier than this.
    pub fn likelier_than(&self, probability: f64) -> Option<&Tracker> {
        (self.log_odds > (probability / (1.0 - probability)).ln()).then_some(&self.tracker)
    }

    /// Uses a radio head again.
    pub fn readmit(&mut self, head: &RadioHead) {
        self.tracker.set_excluded(head, false);
    }
}
