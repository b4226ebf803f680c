//! Probability that the first path of a radio head is blocked, from its ranges alone.
//!
//! The ranges of a blocked path are late, for seconds or minutes. A hidden Markov model has the states *clear* and
//! *blocked*; the state changes with the distance driven. The innovation of a clear path is Gaussian. With a blocked path, it
//! also contains the exponentially distributed additional distance of a [`super::blocked_path`], so that it is an
//! exponentially modified Gaussian (Grushka 1972). An additional distance of 6 or 15 m gives equal errors. A filter without
//! this model takes the late ranges for a jump of the radio head's offset, and estimates the offset again at both ends of
//! each blockage (notes/experiments.md).

use std::f64::consts::FRAC_1_SQRT_2;

use super::outliers::{OUTLIERS, outlier_density};
use crate::gaussian::Innovation;

/// Mean and standard deviation of the additional distance (m): those of the delays in UMi whose angles have a large bias
/// (notes/experiments.md).
pub(super) const LATE_M: f64 = 6.0;

/// Prior probability of a blocked path. An assumption; the ranges of a few metres outweigh it.
const PRIOR: f64 = 0.05;

/// Minimum and maximum probability before a range, so that a path that has changed is found at standstill, too. An
/// assumption.
const BEFORE: [f64; 2] = [0.01, 0.99];

/// First path that is blocked with a probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::localize::ekf) struct LatePath {
    probability: f64,
}

impl LatePath {
    /// Path of a radio head without ranges.
    pub const PRIOR: Self = Self { probability: PRIOR };

    /// Path that is certainly clear.
    pub const CLEAR: Self = Self { probability: 0.0 };

    /// Returns the probability that the path is blocked.
    pub const fn probability(self) -> f64 {
        self.probability
    }

    /// Whether the path is probably blocked.
    pub fn is_blocked(self) -> bool {
        self.probability > 0.5
    }

    /// Returns the path before a range, if a new state since the previous range has the probability `changed`.
    pub fn before(self, changed: f64) -> Self {
        let kept = self.probability.clamp(BEFORE[0], BEFORE[1]);
        Self {
            probability: kept + changed * (PRIOR - kept),
        }
    }

    /// Returns the path after a range with this innovation of a clear path, and the probability that the range has a clear
    /// path and is no outlier. An outlier is no evidence for either state.
    pub fn update(self, innovation: &Innovation) -> (Self, f64) {
        let (late, clear) = densities(innovation);
        let late = (1.0 - OUTLIERS) * self.probability * late;
        let clear = (1.0 - OUTLIERS) * (1.0 - self.probability) * clear;
        let outlier = OUTLIERS * outlier_density(innovation);
        let total = late + clear + outlier;
        let probability = (late + self.probability * outlier) / total;
        (Self { probability }, clear / total)
    }

    /// Returns the path after a range.
    pub fn after(self, innovation: &Innovation) -> Self {
        self.update(innovation).0
    }

    /// Returns the probability density (1/m) of an innovation of a clear path, if it is no outlier.
    pub fn density(self, innovation: &Innovation) -> f64 {
        let (late, clear) = densities(innovation);
        self.probability * late + (1.0 - self.probability) * clear
    }
}

/// Returns the probability densities (1/m) of an innovation with a blocked and with a clear path.
fn densities(innovation: &Innovation) -> (f64, f64) {
    let Innovation {
        residual, variance, ..
    } = *innovation;
    let sigma_m = variance.sqrt();
    let clear = innovation.density();
    // The additional distance is small compared to the innovation, and the exponential would overflow.
    if sigma_m > 10.0 * LATE_M {
        return (clear, clear);
    }
    let tail = libm::erfc((sigma_m / LATE_M - residual / sigma_m) * FRAC_1_SQRT_2);
    let exponent = 0.5 * variance / (LATE_M * LATE_M) - residual / LATE_M;
    // Far on the early side, the tail underflows while the exponential overflows.
    let late = if tail > 0.0 {
        0.5 / LATE_M * exponent.exp() * tail
    } else {
        0.0
    };
    (late, clear)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Exp1, StandardNormal};

    use super::*;

    fn innovation(residual: f64, sigma_m: f64) -> Innovation {
        let variance = sigma_m * sigma_m;
        Innovation {
            residual,
            variance,
            measurement_variance: variance,
        }
    }

    /// Midpoint sums: densities of a probability, and the mean of the sum of a Gaussian and an exponential distribution.
    #[test]
    fn densities_have_the_integral_1_and_the_mean_of_their_sum() {
        const STEP_M: f64 = 0.01;
        for sigma_m in [0.1, 1.0, 20.0] {
            let (mut total, mut mean) = ([0.0; 2], [0.0; 2]);
            for step in -20_000..40_000 {
                let at_m = (f64::from(step) + 0.5) * STEP_M;
                let (late, clear) = densities(&innovation(at_m, sigma_m));
                for (kind, density) in [late, clear].into_iter().enumerate() {
                    total[kind] += density * STEP_M;
                    mean[kind] += at_m * density * STEP_M;
                }
            }
            for (kind, expected_m) in [LATE_M, 0.0].into_iter().enumerate() {
                assert!((total[kind] - 1.0).abs() < 1e-3, "{sigma_m}: {total:?}");
                assert!(
                    (mean[kind] - expected_m).abs() < 1e-2,
                    "{sigma_m}: {mean:?}"
                );
            }
        }
    }

    /// Ranges of 1 m, one each 2 m: the path is blocked from the 100th to the 200th range by a constant distance. A range with
    /// a clear path counts as late beyond 2.9 standard deviations, with a probability of 2e-3, and with it a few of its
    /// successors. A range of a blocked path is 5 standard deviations late on average, or more.
    #[test]
    fn a_blocked_path_is_found_and_ends() {
        let (mut count, mut wrong) = (0.0, 0.0);
        for seed in 0..50 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let late_m = 5.0 + LATE_M * random.sample::<f64, _>(Exp1);
            let mut path = LatePath::PRIOR;
            for number in 0..300 {
                let is_blocked = (100..200).contains(&number);
                let noise_m: f64 = random.sample(StandardNormal);
                let residual = noise_m + if is_blocked { late_m } else { 0.0 };
                path = path.before(0.05).after(&innovation(residual, 1.0));
                if number % 100 > 3 {
                    count += 1.0;
                    wrong += f64::from(path.is_blocked() != is_blocked);
                }
            }
        }
        assert!(wrong < 0.01 * count, "{wrong} of {count}");
    }

    #[test]
    fn early_and_extreme_ranges_do_not_block_a_path() {
        for residual in [-1e9, -100.0, -3.0, 0.0] {
            let mut path = LatePath::PRIOR;
            path = path.before(0.05).after(&innovation(residual, 1.0));
            assert!(!path.is_blocked(), "{residual}");
        }
        let mut path = LatePath::PRIOR;
        path = path.before(0.05).after(&innovation(1e9, 1.0));
        assert!(path.probability.is_finite());
    }
}
