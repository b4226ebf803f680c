//! Correlation of the errors of successive angles, which separates scatter from biases.
//!
//! Scatter is independent after a wavelength; a bias is almost constant over the same distance. For a pair of
//! Gaussian errors with equal variance and correlation ρ, the mean of `2ab/(a² + b²)` is `m = (1 − √(1 − ρ²))/ρ`, so that
//! `ρ = 2m/(1 + m²)` (angle of a bivariate Gaussian; Mardia and Jupp, Directional Statistics, 3.5.6). The statistic does
//! not depend on the variance, which the level of the bias determines, and an outlier counts at most as much as one pair.

use super::jump_process::SOON_M;

/// Maximum distance between two angles of a pair (m): the bias is probably unchanged.
const MAX_SPACING_M: f64 = SOON_M;

/// Correlation from which on all errors are biases. The jump process has 0.65 for the mean spacing of 0.19 m; the smaller
/// value counts errors as biases in doubt.
const OF_BIAS: f64 = 0.5;

/// Mean of the statistic for [`OF_BIAS`]: `(1 − √(1 − ρ²))/ρ`.
const MEAN_OF_BIAS: f64 = 0.267_949;

/// Number of pairs that the prior counts as: all errors are biases.
const PRIOR_PAIRS: u32 = 32;

/// Minimum weight of the newest pair, so that the estimate has a memory of some minutes.
const MIN_WEIGHT: f64 = 1.0 / 512.0;

/// Estimate of the correlation, common to all radio heads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorCorrelation {
    mean: f64,
    pairs: u32,
}

/// Error of an angle, and where it was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleError {
    /// Residual relative to the updated state (rad).
    pub residual_rad: f64,
    /// Distance driven (m).
    pub place_m: f64,
}

impl ErrorCorrelation {
    /// Estimate before any angle: all errors are biases.
    pub const PRIOR: Self = Self {
        mean: MEAN_OF_BIAS,
        pairs: 0,
    };

    /// Adds an angle of a radio head with the residual before its update. `last` is the previous angle, which is
    /// replaced unless the new one is within a wavelength, where both have the same scatter.
    pub fn add(
        &mut self,
        last: &mut Option<AngleError>,
        wavelength_m: f64,
        before_rad: f64,
        after: AngleError,
    ) {
        if let Some(last) = last {
            let spacing_m = (after.place_m - last.place_m).abs();
            if spacing_m < wavelength_m {
                return;
            }
            let square = before_rad * before_rad + last.residual_rad * last.residual_rad;
            if spacing_m <= MAX_SPACING_M && square > 0.0 {
                self.pairs = self.pairs.saturating_add(1);
                let weight = MIN_WEIGHT.max(f64::from(PRIOR_PAIRS + self.pairs).recip());
                self.mean += weight * (2.0 * before_rad * last.residual_rad / square - self.mean);
            }
        }
        *last = Some(after);
    }

    /// Returns the fraction of the errors' variance that scatter has.
    pub fn white_fraction(&self) -> f64 {
        let correlation = 2.0 * self.mean / (1.0 + self.mean * self.mean);
        (1.0 - correlation / OF_BIAS).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    const WAVELENGTH_M: f64 = 0.08;

    /// Returns the estimate after angles every `spacing_m`, whose errors have a correlation of `kept` and a variance that
    /// differs by a factor of 100 between two radio heads.
    fn estimate(spacing_m: f64, kept: f64, angles: u32) -> ErrorCorrelation {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut correlation = ErrorCorrelation::PRIOR;
        let (mut last, mut errors) = ([None; 2], [0.0; 2]);
        for number in 0..angles {
            for (head, std_rad) in [0.03, 0.3].into_iter().enumerate() {
                let new: f64 = rng.sample(StandardNormal);
                errors[head] = kept * errors[head] + (1.0 - kept * kept).sqrt() * new;
                let residual_rad = std_rad * errors[head];
                let after = AngleError {
                    residual_rad,
                    place_m: spacing_m * f64::from(number),
                };
                correlation.add(&mut last[head], WAVELENGTH_M, residual_rad, after);
            }
        }
        correlation
    }

    /// The statistic is within ±1, with a variance of at most 1/2. With a weight of 1/512, its mean has a standard
    /// deviation of √(1/2/1023), of which four are allowed. The slope of ρ by m is at most 2.
    #[test]
    fn the_correlation_is_that_of_the_errors() {
        for kept in [0.0, 0.2, 0.4] {
            let expected = 1.0 - kept / OF_BIAS;
            let white = estimate(0.1, kept, 4000).white_fraction();
            let scatter = 4.0 * (0.5_f64 / 1023.0).sqrt() * 2.0 / OF_BIAS;
            assert!((white - expected).abs() < scatter, "{kept}: {white}");
        }
        assert_eq!(estimate(0.1, 0.75, 4000).white_fraction(), 0.0);
    }

    #[test]
    fn distant_and_close_angles_do_not_count() {
        for spacing_m in [0.01, 0.5] {
            let correlation = estimate(spacing_m, 0.0, 7);
            assert_eq!(correlation, ErrorCorrelation::PRIOR, "{spacing_m} m");
        }
    }
}
