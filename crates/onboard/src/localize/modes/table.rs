//! A filter that believes otherwise, beside one that trusts what is stated.
//!
//! Each angle speaks for it or against it, as the one filter or the other foretells it better. One that believes in
//! a fault says where the vehicle is, and not that all is well: a radio head at fault might explain the
//! same angles.

use super::likelihood::Evidence;
use crate::clone_in_place::clone_in_place;
use crate::localize::ekf::{Ekf, PredictedMeasurement};
use crate::localize::measurement::{AngleMeasurement, UpdateReason, UpdateVerdict};
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

/// A filter that believes otherwise.
#[derive(Debug)]
pub(super) struct Mode {
    pub ekf: Ekf,
    pub evidence: Evidence,
    pub prior: f64,
    pub is_fault: bool,
}

clone_in_place!(Mode {
    ekf,
    evidence,
    prior,
    is_fault
});

impl Mode {
    /// A fault that has the probability `prior`.
    pub const fn fault(ekf: Ekf, prior: f64) -> Self {
        Self {
            ekf,
            evidence: Evidence::NONE,
            prior,
            is_fault: true,
        }
    }

    /// Something that is otherwise with the probability `prior`, and no fault.
    fn sound(ekf: Ekf, prior: f64) -> Self {
        Self {
            is_fault: false,
            ..Self::fault(ekf, prior)
        }
    }

    /// Errors that stay over metres, where that is rare; `None` where they are impossible, or so usual that every
    /// filter finds them.
    pub fn correlated_bias(ekf: &Ekf) -> Option<Self> {
        let prior = ekf.config().rare_bias_probability;
        let finds = ekf.config().estimates_bias();
        (prior > 0.0).then(|| {
            let ekf = if finds {
                ekf.clone()
            } else {
                ekf.finding_errors(prior)
            };
            Self::fault(ekf, prior)
        })
    }

    /// An array that is not exact; `None` where all of it is stated, or errors that stay explain the same.
    pub fn uncalibrated(ekf: &Ekf) -> Option<Self> {
        let uncalibrated = ekf.uncalibrated();
        let uncalibrated = uncalibrated.filter(|it| !it.config().estimates_bias());
        uncalibrated.map(|ekf| Self::sound(ekf, INEXACT))
    }

    /// An odometer that is noisier than stated, where it slips with the probability `slip`; `None` on a
    /// differential drive, whose wheels slip a little with every metre, or where errors that stay explain the same.
    pub fn noisier(ekf: &Ekf, slip: f64) -> Option<Self> {
        let config = ekf.config();
        let is_watched = config.drive == DriveKind::Road && !config.estimates_bias();
        let ekf = is_watched.then(|| ekf.noisier(NOISIER));
        ekf.map(|it| Self::sound(it, (NOISY * slip).min(MOST_PROBABLE)))
    }

    /// Angles that are noisier than stated, as noisy as they are heard to be; `None` where errors that stay explain the
    /// same.
    pub fn noisy_angles(ekf: &Ekf) -> Option<Self> {
        (!ekf.config().estimates_bias()).then(|| {
            let mut ekf = ekf.clone();
            ekf.set_noise_ratio(Some(1.0));
            Self::sound(ekf, LOUD)
        })
    }

    /// A site plan that is off from the map as a whole with the probability `prior`, of an array that may not be exact;
    /// `None` where that is none, the radio heads are all the map there is, or errors that stay explain the same.
    pub fn displaced(ekf: &Ekf, prior: f64) -> Option<Self> {
        let is_watched = prior > 0.0 && ekf.has_map() && !ekf.config().estimates_bias();
        let ekf = is_watched.then(|| ekf.uncalibrated_or_self().displaced(DATUM_STD_M));
        ekf.map(|it| Self::fault(it, prior))
    }

    /// Forgets what spoke for it or against it.
    pub const fn forget(&mut self) {
        self.evidence = Evidence::NONE;
    }

    /// Takes in an angle, which the filter `sound` foretells so.
    pub fn update(
        &mut self,
        sound: &Ekf,
        if_sound: &Result<PredictedMeasurement, UpdateReason>,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> UpdateVerdict {
        let predicted = self.ekf.predict_measurement(head, measured);
        if measured.resolved {
            (self.evidence).see([&self.ekf, sound], [&predicted, if_sound]);
        }
        self.ekf.take(predicted, measured)
    }

    /// How many times as probable it is as what is stated.
    pub fn odds(&self) -> f64 {
        self.evidence.odds(self.prior)
    }
}
