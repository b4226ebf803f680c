//! Blocked first path of a radio head: its delays are late, and its range rates are those of a reflection.
//!
//! One SSB does not show that its first path is blocked, but successive angles do: without a line of sight, their bias is
//! large. The probability of a large bias is therefore the probability of a blocked first path, less the part that a large
//! bias has with a line of sight. The additional distance of a blocked path has an exponential distribution. Mean and
//! variance of the resulting mixture are exact. Without angles, the ranges show all but the small additional distances.

use super::late_path::{LATE_M, LatePath};

/// Probability of a large bias with a line of sight, because the level may have changed since the last angles. Without it,
/// delays in a site with lines of sight have little weight (notes/experiments.md).
const WITH_LINE_OF_SIGHT: f64 = 0.05;

/// Standard deviation of the error of a range rate (m/s): fading of a reflection turns the carrier phase. An
/// assumption; 5 and 10 m/s give equal errors (notes/experiments.md).
const RATE_STD_MPS: f64 = 5.0;

/// First path that is blocked with a probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::localize::ekf) struct BlockedPath {
    probability: f64,
    /// Mean and standard deviation of the additional distance of a blocked path (m).
    mean_m: f64,
}

impl BlockedPath {
    /// First path that is certainly not blocked.
    pub const NEVER: Self = Self {
        probability: 0.0,
        mean_m: LATE_M,
    };

    /// Creates the path of a radio head whose angles have a large bias with this probability.
    pub fn new(large_bias_probability: f64) -> Self {
        let beyond = (large_bias_probability - WITH_LINE_OF_SIGHT) / (1.0 - WITH_LINE_OF_SIGHT);
        Self {
            probability: beyond.max(0.0),
            mean_m: LATE_M,
        }
    }

    /// Creates the path of a radio head without angles, given the noise of its ranges (m). Additional distances above
    /// the noise are found by the ranges themselves, and the path is then blocked; smaller ones are not. Where no path was
    /// blocked lately, none is assumed to be.
    pub fn unnoticed(path: LatePath, blocked_fraction: f64, noise_m: f64) -> Self {
        let probability = if path.is_blocked() {
            0.0
        } else {
            path.probability() * (blocked_fraction / LatePath::PRIOR.probability()).min(1.0)
        };
        Self {
            probability,
            mean_m: LATE_M.min(noise_m),
        }
    }

    /// Returns the expected additional distance (m).
    pub fn late_m(self) -> f64 {
        self.probability * self.mean_m
    }

    /// Returns the variance of the additional distance (m²).
    pub fn variance(self) -> f64 {
        self.probability * (2.0 - self.probability) * self.mean_m * self.mean_m
    }

    /// Returns the variance of the error of a range rate (m²/s²).
    pub fn rate_variance(self) -> f64 {
        self.probability * RATE_STD_MPS * RATE_STD_MPS
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::Exp1;

    use super::*;

    #[test]
    fn a_large_bias_means_a_blocked_path_and_a_line_of_sight_changes_no_delay() {
        assert_eq!(BlockedPath::new(WITH_LINE_OF_SIGHT).variance(), 0.0);
        assert_eq!(BlockedPath::new(0.0).late_m(), 0.0);
        assert_eq!(BlockedPath::new(1.0).late_m(), LATE_M);
    }

    /// The fourth moment of an exponential distribution is 24, so that the mean square of 100,000 draws has a standard
    /// deviation of at most √(24 / 100,000) = 1.5 % of the squared mean distance, of which four are allowed.
    #[test]
    fn mean_and_variance_are_those_of_the_mixture() {
        const DRAWS: u32 = 100_000;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for probability in [0.0, 0.3, 1.0] {
            let (mut sum, mut square) = (0.0, 0.0);
            for _ in 0..DRAWS {
                let blocked = random.random::<f64>() < probability;
                let late: f64 = random.sample(Exp1);
                let late_m = if blocked { LATE_M * late } else { 0.0 };
                sum += late_m / f64::from(DRAWS);
                square += late_m * late_m / f64::from(DRAWS);
            }
            let blocked = BlockedPath {
                probability,
                mean_m: LATE_M,
            };
            let within = 0.06 * LATE_M * LATE_M;
            assert!((blocked.late_m() - sum).abs() < 0.06 * LATE_M, "{sum}");
            assert!((blocked.variance() + sum * sum - square).abs() < within);
        }
    }
}
