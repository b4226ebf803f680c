//! Correlation of the errors of successive angles, which separates scatter from biases.
//!
//! Scatter is independent after a wavelength; a bias is retained over some distance. For a pair of Gaussian errors with equal
//! variance and correlation ρ, the statistic `s = 2ab/(a² + b²)` has the mean `m(ρ) = (1 − √(1 − ρ²))/ρ` (angle of a
//! bivariate Gaussian; Mardia and Jupp, Directional Statistics, 3.5.6). It does not depend on the variance, which the level
//! of the bias determines, and an outlier counts at most as much as one pair. The fraction of the bias is the least-squares
//! estimate of f in `s = f m(ρ)`, where ρ is the correlation of the jump process for the spacing of the pair.

use super::jump_process::{SOON_M, VALUE_M};

/// Maximum distance between two angles of a pair (m).
const MAX_SPACING_M: f64 = VALUE_M;

/// Correlation of errors that count as biases only, relative to that of the jump process: in doubt, an error is a bias.
const OF_BIAS: f64 = 0.75;

/// Number of pairs that the prior counts as, a wavelength apart: all errors are biases.
const PRIOR_PAIRS: f64 = 32.0;
/// Sum over these pairs of the squared mean of the statistic for a bias.
const PRIOR_SQUARE: f64 = 3.8;

/// Number of pairs after which older ones count less, so that the estimate has a memory of some minutes.
const MAX_PAIRS: f64 = 512.0;

/// Returns the mean of the statistic for two errors of a bias `spacing_m` apart.
fn mean_of_bias(spacing_m: f64) -> f64 {
    let correlation = [VALUE_M, SOON_M].map(|it| (-spacing_m / it).exp());
    let correlation = 0.5 * OF_BIAS * correlation.iter().sum::<f64>();
    (1.0 - (1.0 - correlation * correlation).sqrt()) / correlation
}

/// Estimate of the correlation, common to all radio heads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorCorrelation {
    /// Sums over the pairs of the statistic times its mean for a bias, and of the square of this mean.
    product: f64,
    square: f64,
    /// Number of pairs.
    pairs: f64,
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
        product: PRIOR_SQUARE,
        square: PRIOR_SQUARE,
        pairs: PRIOR_PAIRS,
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
            let power = before_rad * before_rad + last.residual_rad * last.residual_rad;
            if spacing_m <= MAX_SPACING_M && power > 0.0 {
                let (mean, statistic) = (
                    mean_of_bias(spacing_m),
                    2.0 * before_rad * last.residual_rad / power,
                );
                let kept = (MAX_PAIRS / (self.pairs + 1.0)).min(1.0);
                self.product = kept * (self.product + mean * statistic);
                self.square = kept * (self.square + mean * mean);
                self.pairs = kept * (self.pairs + 1.0);
            }
        }
        *last = Some(after);
    }

    /// Returns the fraction of the errors' variance that scatter has.
    pub fn white_fraction(&self) -> f64 {
        (1.0 - self.product / self.square).clamp(0.0, 1.0)
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

    /// Angles of two radio heads 0.1 m apart. The statistic is within ±1, with a variance of at most 1/2. The mean over the
    /// last 512 pairs has a standard deviation of √(1/2/1023), of which four are allowed.
    #[test]
    fn the_fraction_of_scatter_is_that_of_the_errors() {
        for kept in [0.01, 0.2, 0.4] {
            let mean = (1.0 - f64::sqrt(1.0 - kept * kept)) / kept;
            let expected = 1.0 - mean / mean_of_bias(0.1);
            let white = estimate(0.1, kept, 4000).white_fraction();
            let scatter = 4.0 * (0.5_f64 / 1023.0).sqrt() / mean_of_bias(0.1);
            assert!((white - expected).abs() < scatter, "{kept}: {white}");
        }
        assert_eq!(estimate(0.1, 0.8, 4000).white_fraction(), 0.0);
    }

    #[test]
    fn distant_and_close_angles_do_not_count() {
        for spacing_m in [0.01, 0.8] {
            let correlation = estimate(spacing_m, 0.0, 7);
            assert_eq!(correlation, ErrorCorrelation::PRIOR, "{spacing_m} m");
        }
    }

    #[test]
    fn the_prior_is_that_of_pairs_a_wavelength_apart() {
        let square = PRIOR_PAIRS * mean_of_bias(0.083).powi(2);
        assert!((PRIOR_SQUARE / square - 1.0).abs() < 0.01, "{square}");
    }
}
