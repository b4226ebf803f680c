//! How much of the stated variance of angles is new at every angle, by what successive ones of a radio head differ by.

use crate::geometry::wrap_angle;

/// Differences that what is believed before any is worth.
const PRIOR_PAIRS: u32 = 16;

/// Weight of the newest difference, at least: what angles are like is kept for some minutes. It is of all radio heads, as it is
/// their receiver's, and by a single one's differences it would take as many times longer.
const LEAST_WEIGHT: f64 = 1.0 / 2048.0;

/// Squared deviations beyond which a difference is no noise, and the mean square that is left of a normal
/// distribution cut there, `1 − 2cφ(c)/erf(c/√2)`.
const MOST: f64 = 9.0;
const OF_MOST: f64 = 0.973_345;

/// Half the mean squared difference of successive angles over their stated variance (von Neumann 1941). What stays from
/// the one to the next, an error as well as where the vehicle is believed to be, is not in it. `NoiseRatio` of the bank
/// asks the other question, by filters that lack the radio head and counting tails: by how much angles are noisier than stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WhiteShare {
    share: f64,
    pairs: u32,
}

/// What an angle is off by where the vehicle is then believed to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Residual {
    /// The residual (rad).
    pub residual_rad: f64,
    /// The stated variance of the angle (rad²).
    pub variance: f64,
}

impl WhiteShare {
    /// Where so much of the variance stays as far as is known.
    pub const fn new(stays: f64) -> Self {
        Self {
            share: 1.0 - stays,
            pairs: 0,
        }
    }

    /// The share that may stay, which is no more than `most`.
    pub const fn stays(&self, most: f64) -> f64 {
        (1.0 - self.share).clamp(0.0, most)
    }

    /// Takes in two angles of a radio head, between which what stays has stayed: the former as it was off after its update,
    /// the latter before its own.
    pub fn see(&mut self, last: &Residual, now: &Residual) {
        let difference_rad = wrap_angle(now.residual_rad - last.residual_rad);
        let square = difference_rad * difference_rad / (last.variance + now.variance);
        if square > MOST {
            return;
        }
        self.pairs = self.pairs.saturating_add(1);
        let weight = LEAST_WEIGHT.max(f64::from(PRIOR_PAIRS + self.pairs).recip());
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

    /// What is found of angles of which such a share is kept by `kept` from each to the next, and some are outliers.
    fn found(share: f64, kept: f64, outliers: f64) -> WhiteShare {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (mut white, mut last) = (WhiteShare::new(0.25), None);
        let mut stays: f64 = rng.sample(StandardNormal);
        for _ in 0..2000 {
            let [new, own]: [f64; 2] = [rng.sample(StandardNormal), rng.sample(StandardNormal)];
            stays = kept * stays + (1.0 - kept * kept).sqrt() * new;
            let mut residual_rad = STD_RAD * (share.sqrt() * stays + (1.0 - share).sqrt() * own);
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

    /// The mean square of 2000 differences scatters by √(3/2000), of which three times are allowed; the cut takes less off
    /// small ones than is made up for, the prior is worth 16, and of both sides of an outlier, which is anywhere within 3 rad, some
    /// lie within the cut, of a third of its square.
    #[test]
    fn what_does_not_stay_is_found() {
        let within_cut = (2.0 * MOST).sqrt() * STD_RAD / 3.0;
        for outliers in [0.0, 0.03] {
            for (share, kept) in [(0.0, 0.0), (0.5, 0.82), (0.8, 0.98)] {
                let (white, expected) = (found(share, kept, outliers).share, 1.0 - share * kept);
                let scatter = 3.0 * (3.0 / 2000f64).sqrt() * expected;
                let by_prior = f64::from(PRIOR_PAIRS) / 2000.0 * (0.75 - expected).abs();
                // So many, of squares even in their root: a mean of a third of the cut, and a mean square of a fifth of its own.
                let within = 2.0 * outliers * within_cut * 2000.0;
                let by_outliers = (within / 3.0 + 3.0 * (within / 5.0).sqrt()) * MOST / 2000.0;
                let most = scatter + (1.0 - OF_MOST) * expected + by_prior + by_outliers;
                assert!((white - expected).abs() < most, "{white} {expected}");
            }
        }
    }

    #[test]
    fn no_more_than_stated_stays() {
        assert_eq!(WhiteShare::new(0.25).stays(0.25), 0.25);
        assert_eq!(found(0.8, 0.98, 0.0).stays(0.25), 0.25);
        assert!(found(0.0, 0.0, 0.0).stays(0.25) < 0.12);
    }
}
