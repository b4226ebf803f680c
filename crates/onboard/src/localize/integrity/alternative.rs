//! A tracker that believes otherwise, beside one that trusts what is stated.
//!
//! Each angle speaks for it or against it, as the one tracker or the other foretells it better. One that believes in
//! a fault says where the vehicle is, and not that all is well: a radio head at fault might explain the
//! same angles.

use super::evidence::Evidence;
use crate::clone_in_place::clone_in_place;
use crate::localize::measurement::{AngleMeasurement, UpdateReason, UpdateVerdict};
use crate::localize::tracker::{Look, Tracker};
use crate::radio_head::RadioHead;
use crate::settings::DriveKind;

/// Probability that an array is off of which nothing is stated, and that angles are noisier than stated. The angles
/// soon speak louder.
const INEXACT: f64 = 0.1;
const LOUD: f64 = 0.02;

/// That an odometer is noisier than stated is so many times as probable as that it slips; and how many times as noisy it
/// is then.
const NOISY: f64 = 30.0;
const NOISIER: f64 = 3.0;

/// However probable something is, it is no more so than not.
const MOST_PROBABLE: f64 = 0.5;

/// How far a site plan is off as a whole, if it is: standard deviation in x and y (m).
const DATUM_STD_M: f64 = 1.5;

/// A tracker that believes otherwise.
#[derive(Debug)]
pub(super) struct Alternative {
    pub tracker: Tracker,
    pub evidence: Evidence,
    pub prior: f64,
    pub is_fault: bool,
}

clone_in_place!(Alternative {
    tracker,
    evidence,
    prior,
    is_fault
});

impl Alternative {
    /// A fault that has the probability `prior`.
    pub const fn fault(tracker: Tracker, prior: f64) -> Self {
        Self {
            tracker,
            evidence: Evidence::NONE,
            prior,
            is_fault: true,
        }
    }

    /// Something that is otherwise with the probability `prior`, and no fault.
    fn sound(tracker: Tracker, prior: f64) -> Self {
        Self {
            is_fault: false,
            ..Self::fault(tracker, prior)
        }
    }

    /// Errors that stay over metres, where that is rare; `None` where they are impossible, or so usual that every
    /// tracker finds them.
    pub fn multipath(tracker: &Tracker) -> Option<Self> {
        let prior = tracker.config().rare_error_probability;
        let finds = tracker.config().finds_errors();
        (prior > 0.0).then(|| {
            let tracker = if finds {
                tracker.clone()
            } else {
                tracker.finding_errors(prior)
            };
            Self::fault(tracker, prior)
        })
    }

    /// An array that is not exact; `None` where all of it is stated, or errors that stay explain the same.
    pub fn inexact(tracker: &Tracker) -> Option<Self> {
        let inexact = tracker.inexact();
        let inexact = inexact.filter(|it| !it.config().finds_errors());
        inexact.map(|tracker| Self::sound(tracker, INEXACT))
    }

    /// An odometer that is noisier than stated, where it slips with the probability `slip`; `None` on a
    /// differential drive, whose wheels slip a little with every metre, or where errors that stay explain the same.
    pub fn noisier(tracker: &Tracker, slip: f64) -> Option<Self> {
        let config = tracker.config();
        let is_watched = config.drive == DriveKind::Road && !config.finds_errors();
        let tracker = is_watched.then(|| tracker.noisier(NOISIER));
        tracker.map(|it| Self::sound(it, (NOISY * slip).min(MOST_PROBABLE)))
    }

    /// Angles that are noisier than stated, as noisy as they are heard to be; `None` where errors that stay explain the
    /// same.
    pub fn loud(tracker: &Tracker) -> Option<Self> {
        (!tracker.config().finds_errors()).then(|| {
            let mut tracker = tracker.clone();
            tracker.hear_noise(Some(1.0));
            Self::sound(tracker, LOUD)
        })
    }

    /// A site plan that is off from the map as a whole with the probability `prior`, of an array that may not be exact;
    /// `None` where that is none, the radio heads are all the map there is, or errors that stay explain the same.
    pub fn displaced(tracker: &Tracker, prior: f64) -> Option<Self> {
        let is_watched = prior > 0.0 && tracker.has_map() && !tracker.config().finds_errors();
        let tracker = is_watched.then(|| tracker.doubting_array().displaced(DATUM_STD_M));
        tracker.map(|it| Self::fault(it, prior))
    }

    /// Forgets what spoke for it or against it.
    pub const fn forget(&mut self) {
        self.evidence = Evidence::NONE;
    }

    /// Takes in an angle, which the tracker `sound` foretells so.
    pub fn update(
        &mut self,
        sound: &Tracker,
        if_sound: &Result<Look, UpdateReason>,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> UpdateVerdict {
        let looked = self.tracker.look(head, measured);
        if measured.resolved {
            (self.evidence).see([&self.tracker, sound], [&looked, if_sound]);
        }
        self.tracker.take(looked, measured)
    }

    /// How many times as probable it is as what is stated.
    pub fn odds(&self) -> f64 {
        self.evidence.odds(self.prior)
    }
}
