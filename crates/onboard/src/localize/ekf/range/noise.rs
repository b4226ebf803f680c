//! Measured noise of the ranges, and random walk of the clocks, relative to the specified ones.
//!
//! The standard deviation in a data sheet holds for other antennas, another height and other
//! surroundings. A range alone does not show whether its noise is larger, but the innovations do.
//! The random walk of the vehicle's clock is in the first delay after a time without delays, not in
//! the other ones. For both, the posterior of the variance ratio over a few levels is updated with
//! the likelihood of each innovation (Bar-Shalom, Li and Kirubarajan 2001, 11.6.2).

use crate::gaussian::Innovation;

/// Exponents of the smallest and largest variance ratio. Ratios are powers of two, so that standard
/// deviations are 0.5 to 11 times the specified one.
const FIRST_EXPONENT: i32 = -2;
const LAST_EXPONENT: i32 = 7;
/// Number of variance ratios.
const LEVELS: usize = LAST_EXPONENT.abs_diff(FIRST_EXPONENT) as usize + 1;

/// Logarithm of the prior probability of a ratio relative to that of the next one closer to 1.
const STEP_PRIOR: f64 = -1.0;

/// Factor of previous evidence per range. The memory of 500 ranges is shorter than the stay of a
/// vehicle in one environment.
const KEPT: f64 = 0.998;

/// Maximum squared innovation in variances: single outliers are no noise.
const MOST: f64 = 9.0;

/// Posterior of a variance ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::localize::ekf) struct RangeNoise {
    log_weights: [f64; LEVELS],
    /// Ratio at the posterior mean of the exponent.
    ratio: f64,
}

impl RangeNoise {
    /// The specified noise is the most probable one.
    pub const STATED: Self = Self {
        log_weights: [0.0; LEVELS],
        ratio: 1.0,
    };

    /// Returns the variance relative to the specified one.
    pub const fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Updates with an innovation that was predicted with this ratio, given the specified variance
    /// of the noise in it.
    pub fn see(&mut self, innovation: &Innovation, stated: f64) {
        if !(stated > 0.0 && stated.is_finite()) {
            return;
        }
        let residual = innovation.residual;
        let known = (innovation.variance - self.ratio * stated).max(0.0);
        let largest = f64::from(LAST_EXPONENT).exp2() * stated;
        if residual * residual > MOST * (known + largest) {
            return; // an outlier at every level, which is no evidence
        }
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
            mean += posterior * f64::from(exponent);
        }
        self.ratio = (mean / sum).exp2();
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

    /// Updates with an innovation to which the state contributes a standard deviation of 0.3.
    fn see(noise: &mut RangeNoise, residual: f64) {
        let innovation = Innovation {
            residual,
            variance: 0.09 + noise.ratio(),
            measurement_variance: noise.ratio(),
        };
        noise.see(&innovation, 1.0);
    }

    fn after(sigma: f64, ranges: u32) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut noise = RangeNoise::STATED;
        for _ in 0..ranges {
            let residual: f64 = random.sample(StandardNormal);
            see(&mut noise, residual * sigma.hypot(0.3));
        }
        noise.ratio()
    }

    #[test]
    fn ratio_of_variances_is_found_within_the_levels() {
        // 300 squares determine a variance within 8 %; the levels add at most half an octave.
        for sigma in [0.5, 1.0, 2.0, 4.0, 10.0] {
            let found = after(sigma, 300) / (sigma * sigma);
            assert!((0.7..1.42).contains(&found), "{sigma}: {found}");
        }
        assert!((after(0.01, 300) - 0.25).abs() < 0.05);
    }

    #[test]
    fn one_outlier_changes_little() {
        let mut noise = RangeNoise::STATED;
        for _ in 0..100 {
            see(&mut noise, 0.8);
        }
        let before = noise.ratio();
        see(&mut noise, 1e6);
        assert!(noise.ratio() < 2.0 * before, "{before} {}", noise.ratio());
    }
}
