//! A tracker that believes otherwise, beside one that trusts what is stated.
//!
//! Three of them run. One expects slip ([`Slip`](super::slip::Slip)). One finds errors of the angles that stay over metres, where that is rare: an error
//! that stays and a radio head at fault explain the same angles, so it says where the vehicle is, and not
//! that all is well. One takes nothing of the array as exact that is not stated. Each angle speaks for
//! it or against it, as the one tracker or the other foretells it better.

use super::evidence::Evidence;
use crate::clone_in_place::clone_in_place;
use crate::localize::measurement::{AngleMeasurement, UpdateReason, UpdateVerdict};
use crate::localize::tracker::{Look, Tracker};
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// Probability that an array is off of which nothing is stated.
const INEXACT: f64 = 0.1;

/// A tracker that believes otherwise.
#[derive(Debug)]
pub(super) struct Alternative {
    pub tracker: Tracker,
    pub evidence: Evidence,
    pub prior: f64,
}

clone_in_place!(Alternative {
    tracker,
    evidence,
    prior
});

impl Alternative {
    /// One that has the probability `prior`.
    pub const fn new(tracker: Tracker, prior: f64) -> Self {
        Self {
            tracker,
            evidence: Evidence::NONE,
            prior,
        }
    }

    /// Errors that stay; `None` where they are impossible, or so usual that every tracker finds them.
    pub fn multipath(tracker: &Tracker) -> Option<Self> {
        let prior = tracker.config().rare_error_probability;
        let finds = tracker.config().finds_errors();
        (prior > 0.0).then(|| {
            let tracker = if finds {
                tracker.clone()
            } else {
                tracker.finding_errors(prior)
            };
            Self::new(tracker, prior)
        })
    }

    /// An array that is not exact; `None` where all of it is stated, or errors that stay explain the same.
    pub fn inexact(tracker: &Tracker) -> Option<Self> {
        let inexact = tracker.inexact();
        let inexact = inexact.filter(|it| !it.config().finds_errors());
        inexact.map(|tracker| Self::new(tracker, INEXACT))
    }

    /// Forgets what spoke for it or against it.
    pub const fn forget(&mut self) {
        self.evidence = Evidence::NONE;
    }

    /// Moves on by an odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) {
        self.tracker.odometry(sample);
    }

    /// Takes in an angle, which the tracker `sound` foretells so.
    pub fn update(
        &mut self,
        sound: &Tracker,
        if_sound: &Result<Look, UpdateReason>,
        noise_ratio: f64,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> UpdateVerdict {
        let looked = self.tracker.look(head, measured);
        if measured.resolved {
            (self.evidence).see([&self.tracker, sound], [&looked, if_sound], noise_ratio);
        }
        self.tracker.take(looked, measured)
    }

    /// How many times as probable it is as what is stated.
    pub fn odds(&self) -> f64 {
        self.evidence.odds(self.prior)
    }
}
