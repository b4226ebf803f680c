//! Which of two filters foretells the angles better.

use std::f64::consts::TAU;

use crate::localize::ekf::{Ekf, PredictedMeasurement};
use crate::localize::measurement::UpdateReason;

/// Share of the angles that come from anywhere, where scatter makes no more of them.
const OUTLIERS: f64 = 2e-3;

/// Largest logarithm of the likelihood ratio, for or against, as clear as a fault of a radio head is
/// found: what more evidence there is must be forgotten some time.
const SURE: f64 = 15.0;

/// Logarithm of a likelihood ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Evidence(f64);

impl Evidence {
    /// None either way.
    pub const NONE: Self = Self(0.0);

    /// What of it is left beside what speaks for another one.
    pub const fn beside(self, other: Self) -> Self {
        Self((self.0 - other.0).clamp(-SURE, SURE))
    }

    /// Whether it rather speaks against than for.
    pub const fn is_against(self) -> bool {
        self.0 < 0.0
    }

    /// From now on it is at least so much.
    pub const fn is_at_least(&mut self, evidence: f64) {
        self.0 = self.0.max(evidence);
    }

    /// Takes in how the filter for which it would speak, and the other, foretell an angle.
    pub fn see(
        &mut self,
        [of_it, of_other]: [&Ekf; 2],
        [it, other]: [&Result<PredictedMeasurement, UpdateReason>; 2],
    ) {
        if let (Ok(it), Ok(other)) = (it, other)
            && !(it.excluded || other.excluded)
        {
            let ratio = density(of_it, it) / density(of_other, other);
            let share = independent_share(of_it, it).min(independent_share(of_other, other));
            self.0 = (self.0 + share * ratio.ln()).max(-SURE);
        }
    }

    /// The larger of the two.
    pub const fn or_more(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// What is left of it where that which most speaks for is no more than sure: the others, and what is stated,
    /// come up to it.
    pub const fn beside_most(&mut self, most: Self) {
        self.0 = (self.0 - (most.0 - SURE).max(0.0)).max(-SURE);
    }

    /// How many times as probable it is as not, where its probability was `prior` before.
    pub fn odds(self, prior: f64) -> f64 {
        prior / (1.0 - prior) * self.0.exp()
    }
}

/// Variance (rad²) of an angle by all but the belief, were the radio head not heard before.
fn at_first(ekf: &Ekf, seen: &PredictedMeasurement) -> f64 {
    ekf.first_variance(seen) + ekf.systematic_variance(seen)
}

/// What is seen again and again speaks once; where errors that stay are found, it is known what repeats
/// itself.
fn independent_share(ekf: &Ekf, seen: &PredictedMeasurement) -> f64 {
    if seen.hypotheses.is_some() {
        return 1.0;
    }
    at_first(ekf, seen) / seen.innovation.measurement_variance
}

/// Probability density of an angle (1/rad), which may be an outlier.
fn density(ekf: &Ekf, seen: &PredictedMeasurement) -> f64 {
    let inlier = seen.hypotheses.as_ref().map_or_else(
        || {
            // Who stands hears the same again, of a measurement variance that drowns the belief's.
            let mut alone = seen.innovation;
            let belief = (alone.variance - alone.measurement_variance).max(0.0);
            alone.variance = belief + at_first(ekf, seen);
            alone.density()
        },
        |hypotheses| hypotheses.density,
    );
    let outliers = ekf.config().wrong_lobe.unwrap_or(OUTLIERS);
    outliers / TAU + (1.0 - outliers) * inlier
}
