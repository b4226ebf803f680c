//! How much noisier the angles are than stated, as where the Rician K is less than believed.

use crate::clone_in_place::clone_in_place;
use crate::geometry::wrap_angle;
use crate::localize::tracker::Rehearsal;

/// Weight of the newest difference, at least, and differences that the stated noise is worth.
const LEAST_WEIGHT: f64 = 1.0 / 128.0;
const STATED: u32 = 16;

/// Deviations at which a difference is cut off, and the mean square that this leaves of a normal distribution:
/// `erf(c/√2) − 2cφ(c) + 2c²Φ(−c)` (Huber, Robust Statistics, 5.2). The one lets in the tails that scatter makes, the
/// other tells how noisy angles are beside their outliers.
const MOST: f64 = 3.0;
const OF_MOST: f64 = 0.995_007;
const CORE: f64 = 1.5;
const OF_CORE: f64 = 0.778_465;

/// Mean squared difference between successive innovations of a radio head, over what it ought to be
/// (von Neumann 1941). What is off by as much each time, as a fault makes it, does not show in it.
#[derive(Debug, PartialEq)]
pub struct AngleNoise {
    /// The last look at each radio head that is compared with.
    last: Vec<Option<Rehearsal>>,
    differences: u32,
    with_tails: Mean,
    core: Mean,
}

/// A mean of squares, cut off where they are too large.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mean {
    most: f64,
    kept: f64,
    value: f64,
}

impl Mean {
    /// Before anything is seen.
    const fn new(most: f64, kept: f64) -> Self {
        Self {
            most,
            kept,
            value: 1.0,
        }
    }

    fn see(&mut self, square: f64, weight: f64) {
        let most = self.most * self.most * self.value;
        self.value += weight * (square.min(most) / self.kept - self.value);
    }

    /// Not less than what is stated.
    const fn ratio(&self) -> f64 {
        self.value.max(1.0)
    }
}

clone_in_place!(AngleNoise {
    last,
    differences,
    with_tails,
    core
});

impl AngleNoise {
    /// As stated, of so many radio heads.
    pub fn new(heads: usize) -> Self {
        Self {
            last: vec![None; heads],
            differences: 0,
            with_tails: Mean::new(MOST, OF_MOST),
            core: Mean::new(CORE, OF_CORE),
        }
    }

    /// As noisy as they were found to be, of trackers begun anew.
    pub fn resumed(&self) -> Self {
        Self {
            last: vec![None; self.last.len()],
            ..*self
        }
    }

    /// Takes in an angle to radio head number `head`. Within a wavelength scatter is the same.
    pub fn see(&mut self, head: usize, now: &Rehearsal) {
        let Some(slot) = self.last.get_mut(head) else {
            return;
        };
        let Some(before) = *slot else {
            *slot = Some(*now);
            return;
        };
        if now.place_wavelengths - before.place_wavelengths < 1.0 {
            return;
        }
        *slot = Some(*now);
        let seen = now.innovation;
        let belief = seen.variance - seen.measurement_variance;
        let expected = before.first_variance + now.first_variance + belief;
        let difference = wrap_angle(seen.residual - before.innovation.residual);
        let square = difference * difference / expected;
        self.differences = self.differences.saturating_add(1);
        let weight = LEAST_WEIGHT.max(f64::from(STATED + self.differences).recip());
        self.with_tails.see(square, weight);
        self.core.see(square, weight);
    }

    /// Their variance by what is stated, not less than that.
    pub const fn ratio(&self) -> f64 {
        self.with_tails.ratio()
    }

    /// The same beside outliers.
    pub const fn core_ratio(&self) -> f64 {
        self.core.ratio()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::localize::gaussian::Innovation;

    /// Looks of 0.1 rad of stated deviation, so many wavelengths apart, with these residuals.
    fn heard(apart_wavelengths: f64, mut residual_rad: impl FnMut(i32) -> f64) -> AngleNoise {
        let mut noise = AngleNoise::new(1);
        for number in 0..2000 {
            noise.see(
                0,
                &Rehearsal {
                    innovation: Innovation {
                        residual: residual_rad(number),
                        variance: 0.01,
                        measurement_variance: 0.01,
                    },
                    first_variance: 0.01,
                    place_wavelengths: apart_wavelengths * f64::from(number),
                },
            );
        }
        noise
    }

    /// The same, alternating about a mean.
    fn after(mean_rad: f64, by_rad: f64, apart_wavelengths: f64) -> f64 {
        let sign = |number: i32| f64::from(1 - 2 * (number % 2));
        heard(apart_wavelengths, |number| mean_rad + sign(number) * by_rad).ratio()
    }

    /// Means over many drives, which scatter by a tenth each.
    #[test]
    fn outliers_are_noise_by_their_tails_alone() {
        let drives = 100_u8;
        let [mut with_tails, mut core] = [0.0; 2];
        for outliers in [0.0, 0.04] {
            [with_tails, core] = [0.0; 2];
            for seed in 0..drives {
                let mut rng = ChaCha8Rng::seed_from_u64(u64::from(seed));
                let noise = heard(2.0, |_| {
                    let sound_rad = 0.2 * rng.sample::<f64, _>(StandardNormal);
                    if rng.random::<f64>() < outliers {
                        rng.random_range(-3.0..3.0)
                    } else {
                        sound_rad
                    }
                });
                with_tails += noise.ratio() / f64::from(drives);
                core += noise.core_ratio() / f64::from(drives);
            }
            if outliers == 0.0 {
                // Twice the deviation, by either.
                assert!(
                    (with_tails - 4.0).abs() < 0.15 && (core - 4.0).abs() < 0.15,
                    "{with_tails} {core}"
                );
            }
        }
        // Nearly one difference in twelve has an outlier: each adds the square at which it is cut off.
        assert!(
            core < 1.3 * 4.0 && with_tails > 1.3 * 4.0,
            "{core} {with_tails}"
        );
    }

    #[test]
    fn louder_angles_show_and_a_bias_does_not() {
        assert_eq!(after(0.5, 0.05, 2.0), 1.0);
        // Differences of 0.4 rad, where 0.14 rad are expected: 8 times the variance.
        let ratio = after(0.5, 0.2, 2.0);
        assert!((ratio - 8.0).abs() < 0.5, "{ratio}");
        // Who hardly moves hears the same scatter again.
        assert_eq!(after(0.0, 0.2, 1e-3), 1.0);
    }
}
