//! Gaussian process over the distance driven.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// Knots per correlation distance.
const KNOTS: f64 = 8.0;

/// Standard normal process over the distance driven with an exponential autocorrelation (Gudmundson
/// 1991; TR 38.901, 7.4.4). Values are drawn at knots. The interpolation preserves unit variance.
#[derive(Debug, Clone)]
pub struct Track {
    knot_m: f64,
    /// Correlation of adjacent knots.
    kept: f64,
    knots: Vec<f64>,
}

impl Track {
    /// Draws the process over a road of `length_m`.
    pub fn new(correlation_m: f64, length_m: f64, rng: &mut impl Rng) -> Self {
        let knot_m = correlation_m / KNOTS;
        let kept = (-1.0 / KNOTS).exp();
        let fresh = (1.0 - kept * kept).sqrt();
        let first: f64 = rng.sample(StandardNormal);
        let knots = std::iter::successors(Some(first), |last| {
            let normal: f64 = rng.sample(StandardNormal);
            Some(kept * last + fresh * normal)
        });
        Self {
            knot_m,
            kept,
            knots: knots
                .take((length_m / knot_m).ceil() as usize + 2)
                .collect(),
        }
    }

    /// Returns the value at the distance `along_m`.
    pub fn at(&self, along_m: f64) -> f64 {
        let place = (along_m / self.knot_m).max(0.0);
        let index = (place as usize).min(self.knots.len().saturating_sub(2));
        let share = (place - index as f64).min(1.0);
        let [Some(before), Some(after)] = [self.knots.get(index), self.knots.get(index + 1)] else {
            return 0.0;
        };
        let rest = 1.0 - share;
        let variance = rest * rest + share * share + 2.0 * rest * share * self.kept;
        (rest * before + share * after) / variance.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Streams};

    #[test]
    fn autocorrelation_is_exponential() {
        let mut rng = Streams::new(1, 0).generator(Purpose::LargeScale, 0);
        let track = Track::new(10.0, 2e5, &mut rng);
        let product = |lag_m: f64| {
            let places = (0..60_000).map(|k| 3.1 * f64::from(k));
            places
                .map(|at_m| track.at(at_m) * track.at(at_m + lag_m))
                .sum::<f64>()
                / 6e4
        };
        // 20,000 correlation distances give a standard error of about 0.01.
        for lag_m in [0.0f64, 2.0, 10.0, 25.0] {
            let found = product(lag_m);
            assert!(
                (found - (-0.1 * lag_m).exp()).abs() < 0.03,
                "{lag_m} m: {found}"
            );
        }
    }
}
