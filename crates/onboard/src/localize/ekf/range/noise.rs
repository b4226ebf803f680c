//! Measured noise of the ranges relative to the specified one.
//!
//! The standard deviation in a data sheet holds for other antennas, another height and other
//! surroundings. A range alone does not show whether its noise is larger, but the innovations do:
//! the posterior of the variance ratio over a few levels is updated with the likelihood of each
//! innovation (Bar-Shalom, Li and Kirubarajan 2001, 11.6.2).

/// Exponent of the smallest variance ratio. Ratios are powers of two, so that standard deviations
/// are 0.5 to 5.7 times the specified one.
const FIRST_EXPONENT: i32 = -2;
/// Number of variance ratios.
const LEVELS: usize = 8;

/// Logarithm of the prior probability of a ratio relative to that of the next one closer to 1.
const STEP_PRIOR: f64 = -0.5;

/// Factor of previous evidence per range. The memory of 500 ranges is shorter than the stay of a
/// vehicle in one environment.
const KEPT: f64 = 0.998;

/// Maximum squared innovation in variances: single outliers are no noise.
const MOST: f64 = 9.0;

/// Posterior of the variance ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::localize::ekf) struct RangeNoise {
    log_weights: [f64; LEVELS],
    /// Posterior mean.
    ratio: f64,
}

impl RangeNoise {
    /// The specified noise is the most probable one.
    pub const STATED: Self = Self {
        log_weights: [0.0; LEVELS],
        ratio: 1.0,
    };

    /// Returns the variance of ranges relative to the specified one.
    pub const fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Updates with an innovation, given its variance without the range's own noise, and the
    /// specified variance of that noise.
    pub fn see(&mut self, residual: f64, known: f64, stated: f64) {
        let mut most = f64::NEG_INFINITY;
        for (exponent, weight) in (FIRST_EXPONENT..).zip(&mut self.log_weights) {
            let variance = known + f64::from(exponent).exp2() * stated;
            let square = (residual * residual / variance).min(MOST);
            *weight = KEPT * *weight - 0.5 * (square + variance.ln());
            most = most.max(*weight + prior(exponent));
        }
        let (mut sum, mut mean) = (0.0, 0.0);
        for (exponent, weight) in (FIRST_EXPONENT..).zip(&self.log_weights) {
            let posterior = (*weight + prior(exponent) - most).exp();
            sum += posterior;
            mean += posterior * f64::from(exponent).exp2();
        }
        self.ratio = mean / sum;
        // Only differences between levels matter.
        for weight in &mut self.log_weights {
            *weight -= most;
        }
    }
}

fn prior(exponent: i32) -> f64 {
    STEP_PRIOR * f64::from(exponent.abs())
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    fn after(sigma: f64, ranges: u32) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut noise = RangeNoise::STATED;
        for _ in 0..ranges {
            let residual: f64 = random.sample(StandardNormal);
            // The state contributes a standard deviation of 0.3.
            noise.see(residual * sigma.hypot(0.3), 0.09, 1.0);
        }
        noise.ratio()
    }

    #[test]
    fn ratio_of_variances_is_found_within_the_levels() {
        // 300 squares determine a variance within 8 %; the levels add at most half an octave.
        for sigma in [0.5, 1.0, 2.0, 4.0] {
            let found = after(sigma, 300) / (sigma * sigma);
            assert!((0.7..1.42).contains(&found), "{sigma}: {found}");
        }
        assert!((after(0.01, 300) - 0.25).abs() < 0.05);
    }

    #[test]
    fn one_outlier_changes_little() {
        let mut noise = RangeNoise::STATED;
        for _ in 0..100 {
            noise.see(0.8, 0.09, 1.0);
        }
        let before = noise.ratio();
        noise.see(1e6, 0.09, 1.0);
        assert!(noise.ratio() < 2.0 * before, "{before} {}", noise.ratio());
    }
}
