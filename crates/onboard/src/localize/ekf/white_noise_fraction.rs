//! White fraction of the angles' noise, from the differences of successive angles of a radio head.

use crate::geometry::wrap_angle;

/// Number of differences that the prior counts as.
const PRIOR_PAIRS: u32 = 16;

/// Minimum weight of the newest difference, so that the estimate has a memory of some minutes. The
/// estimate is common to all radio heads, because it is a property of the receiver; with the
/// differences of one radio head only, its convergence would be slower in proportion to the number
/// of radio heads.
const MIN_WEIGHT: f64 = 1.0 / 2048.0;

/// Maximum squared deviation of a difference, in variances.
const MOST: f64 = 9.0;
/// Mean square of a standard normal distribution that is truncated at this deviation c: `1 −
/// 2cφ(c)/erf(c/√2)`.
const OF_MOST: f64 = 0.973_345;

/// Half the mean squared difference of successive angles divided by their specified variance (von
/// Neumann 1941). Constant errors, of the angles or of the position, do not contribute. In
/// contrast, the bank's `NoiseScale` estimates the total noise relative to the specified one, with
/// filters that do not use the radio head, including tails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WhiteNoiseFraction {
    share: f64,
    pairs: u32,
}

/// Residual of an angle relative to the updated state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Residual {
    /// The residual (rad).
    pub residual_rad: f64,
    /// Specified variance of the angle (rad²).
    pub variance: f64,
}

impl WhiteNoiseFraction {
    /// Creates the estimate with a prior of the time-correlated fraction.
    pub const fn new(correlated_fraction: f64) -> Self {
        Self {
            share: 1.0 - correlated_fraction,
            pairs: 0,
        }
    }

    /// Returns the time-correlated fraction, limited to `most`.
    pub const fn correlated_fraction(&self, most: f64) -> f64 {
        (1.0 - self.share).clamp(0.0, most)
    }

    /// Adds two angles of a radio head, between which the time-correlated error is constant: the
    /// residual of the first after its update, that of the second before its update.
    pub fn see(&mut self, last: &Residual, now: &Residual) {
        let difference_rad = wrap_angle(now.residual_rad - last.residual_rad);
        let square = difference_rad * difference_rad / (last.variance + now.variance);
        if square > MOST {
            return;
        }
        self.pairs = self.pairs.saturating_add(1);
        let weight = MIN_WEIGHT.max(f64::from(PRIOR_PAIRS + self.pairs).recip());
        self.share += weight * (square / OF_MOST - self.share);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    const STD_RAD: f64 = 0.05;

    /// Estimates the fraction for angles with a time-correlated `share` that is retained by the
    /// factor `kept` between angles, and a fraction of outliers.
    fn found(share: f64, kept: f64, outliers: f64) -> WhiteNoiseFraction {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (mut white, mut last) = (WhiteNoiseFraction::new(0.25), None);
        let mut correlated_fraction: f64 = rng.sample(StandardNormal);
        for _ in 0..2000 {
            let [new, own]: [f64; 2] = [rng.sample(StandardNormal), rng.sample(StandardNormal)];
            correlated_fraction = kept * correlated_fraction + (1.0 - kept * kept).sqrt() * new;
            let mut residual_rad =
                STD_RAD * (share.sqrt() * correlated_fraction + (1.0 - share).sqrt() * own);
            if rng.random::<f64>() < outliers {
                residual_rad = rng.random_range(-3.0..3.0);
            }
            let residual = Residual {
                residual_rad,
                variance: STD_RAD * STD_RAD,
            };
            if let Some(last) = last.replace(residual) {
                white.see(&last, &residual);
            }
        }
        white
    }

    /// The mean square of 2000 differences has a standard deviation of √(3/2000), of which three
    /// are allowed. The truncation is not fully compensated for small differences, and the prior
    /// counts as 16. Outliers are uniformly distributed within 3 rad; some of their
    /// differences are within the limit, with a third of its square.
    #[test]
    fn the_white_fraction_is_estimated() {
        let within_cut = (2.0 * MOST).sqrt() * STD_RAD / 3.0;
        for outliers in [0.0, 0.03] {
            for (share, kept) in [(0.0, 0.0), (0.5, 0.82), (0.8, 0.98)] {
                let (white, expected) = (found(share, kept, outliers).share, 1.0 - share * kept);
                let scatter = 3.0 * (3.0 / 2000f64).sqrt() * expected;
                let by_prior = f64::from(PRIOR_PAIRS) / 2000.0 * (0.75 - expected).abs();
                // The number of outliers has a Poisson distribution: its standard deviation is its
                // square root. Each adds a third of the limit on average.
                let within = 2.0 * outliers * within_cut * 2000.0;
                let by_outliers = (within / 3.0 + 3.0 * (within / 5.0).sqrt()) * MOST / 2000.0;
                let most = scatter + (1.0 - OF_MOST) * expected + by_prior + by_outliers;
                assert!((white - expected).abs() < most, "{white} {expected}");
            }
        }
    }

    #[test]
    fn the_correlated_fraction_does_not_exceed_the_configured_maximum() {
        assert_eq!(
            WhiteNoiseFraction::new(0.25).correlated_fraction(0.25),
            0.25
        );
        assert_eq!(found(0.8, 0.98, 0.0).correlated_fraction(0.25), 0.25);
        assert!(found(0.0, 0.0, 0.0).correlated_fraction(0.25) < 0.12);
    }
}
