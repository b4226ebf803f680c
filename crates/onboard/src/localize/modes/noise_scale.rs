//! Ratio of the measured noise of the angles to the specified noise, such as with a lower Rician K
//! than configured.

use crate::clone_in_place::clone_in_place;
use crate::geometry::wrap_angle;
use crate::localize::ekf::ExcludedInnovation;

/// Minimum weight of the newest difference.
const MIN_WEIGHT: f64 = 1.0 / 128.0;
/// Weight of the specified noise, as a number of differences.
const STATED: u32 = 16;

/// Limit of a difference, in standard deviations: includes the tails that scatter causes.
const MOST: f64 = 3.0;
/// Mean square of a standard normal distribution whose values are limited to c:
/// `erf(c/√2) − 2cφ(c) + 2c²Φ(−c)` (Huber, Robust Statistics, 5.2).
const OF_MOST: f64 = 0.995_007;
/// Smaller limit of a difference, in standard deviations: yields the noise without outliers.
const CORE: f64 = 1.5;
/// Mean square of a standard normal distribution whose values are limited to [`CORE`].
const OF_CORE: f64 = 0.778_465;

clone_in_place! {
    /// Mean squared difference between successive innovations of a radio head, divided by its
    /// expected value (von Neumann 1941), for each radio head and for all. A constant error, such
    /// as that of a fault, does not contribute.
    #[derive(Debug, PartialEq)]
    pub struct NoiseScale {
        heads: Vec<HeadNoise>,
        of_all: Ratio,
    }
}

/// Innovations of a radio head.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadNoise {
    /// Previous innovation, for the next difference.
    last: Option<ExcludedInnovation>,
    /// Ratio of this radio head. Before its first angle it is `None`, and the ratio of all radio
    /// heads applies.
    ratio: Option<Ratio>,
}

/// Variance relative to the specified one, with tails and without outliers.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ratio {
    differences: u32,
    with_tails: f64,
    core: f64,
}

impl Ratio {
    /// Ratio before any angle.
    const STATED: Self = Self {
        differences: 0,
        with_tails: 1.0,
        core: 1.0,
    };

    /// Adds a squared difference relative to its expected value.
    fn see(&mut self, square: f64) {
        self.differences = self.differences.saturating_add(1);
        let weight = MIN_WEIGHT.max(f64::from(STATED + self.differences).recip());
        let mean = |value: &mut f64, most: f64, of_most: f64| {
            *value += weight * (square.min(most * most * *value) / of_most - *value);
        };
        mean(&mut self.with_tails, MOST, OF_MOST);
        mean(&mut self.core, CORE, OF_CORE);
    }
}

impl NoiseScale {
    /// Creates the ratio for a number of radio heads.
    pub fn new(heads: usize) -> Self {
        let head_noise = HeadNoise {
            last: None,
            ratio: None,
        };
        Self {
            heads: vec![head_noise; heads],
            of_all: Ratio::STATED,
        }
    }

    /// Returns the ratio for restarted filters.
    pub fn resumed(&self) -> Self {
        let mut heads = self.heads.clone();
        for head in &mut heads {
            head.last = None;
        }
        Self { heads, ..*self }
    }

    /// Adds an angle of radio head number `head`. Within a wavelength, scatter is identical, so
    /// that the angle is ignored.
    pub fn see(&mut self, head: usize, now: &ExcludedInnovation) {
        let Some(head_noise) = self.heads.get_mut(head) else {
            return;
        };
        let Some(before) = head_noise.last else {
            head_noise.last = Some(*now);
            return;
        };
        if now.place_wavelengths - before.place_wavelengths < 1.0 {
            return;
        }
        head_noise.last = Some(*now);
        let seen = now.innovation;
        let belief = seen.variance - seen.measurement_variance;
        let expected = before.first_variance + now.first_variance + belief;
        let difference = wrap_angle(seen.residual - before.innovation.residual);
        let square = difference * difference / expected;
        let as_all = Ratio {
            differences: 0,
            ..self.of_all
        };
        head_noise.ratio.get_or_insert(as_all).see(square);
        self.of_all.see(square);
    }

    /// Returns the variance of the angles relative to the specified one, at least 1.
    pub const fn ratio(&self) -> f64 {
        self.of_all.with_tails.max(1.0)
    }

    fn of(&self, head: usize) -> Ratio {
        let head_noise = self.heads.get(head).and_then(|it| it.ratio);
        head_noise.unwrap_or(self.of_all)
    }

    /// Returns the variance ratio of a radio head's angles, at least 1.
    pub fn ratio_of(&self, head: usize) -> f64 {
        self.of(head).with_tails.max(1.0)
    }

    /// Returns the variance ratio of a radio head's angles, computed without outliers; at least 1.
    pub fn core_ratio_of(&self, head: usize) -> f64 {
        self.of(head).core.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::gaussian::Innovation;

    /// Predicts an angle with a specified standard deviation of 0.1 rad.
    fn predict_measurement(place_wavelengths: f64, residual: f64) -> ExcludedInnovation {
        ExcludedInnovation {
            innovation: Innovation {
                residual,
                variance: 0.01,
                measurement_variance: 0.01,
            },
            first_variance: 0.01,
            place_wavelengths,
        }
    }

    /// Returns the estimate for angles with these residuals, at equal distances in wavelengths.
    fn estimated(apart_wavelengths: f64, mut residual_rad: impl FnMut(i32) -> f64) -> NoiseScale {
        let mut noise = NoiseScale::new(1);
        for number in 0..2000 {
            let place_wavelengths = apart_wavelengths * f64::from(number);
            noise.see(
                0,
                &predict_measurement(place_wavelengths, residual_rad(number)),
            );
        }
        noise
    }

    /// Returns the ratio for residuals that alternate around a mean.
    fn after(mean_rad: f64, by_rad: f64, apart_wavelengths: f64) -> f64 {
        let sign = |number: i32| f64::from(1 - 2 * (number % 2));
        estimated(apart_wavelengths, |number| mean_rad + sign(number) * by_rad).ratio()
    }

    /// Means over many drives, each with a relative standard deviation of a tenth.
    #[test]
    fn outliers_increase_the_noise_by_their_tails_only() {
        let drives = 100_u8;
        let [mut with_tails, mut core] = [0.0; 2];
        for outliers in [0.0, 0.04] {
            [with_tails, core] = [0.0; 2];
            for seed in 0..drives {
                let mut rng = ChaCha8Rng::seed_from_u64(u64::from(seed));
                let noise = estimated(2.0, |_| {
                    let sound_rad = 0.2 * rng.sample::<f64, _>(StandardNormal);
                    if rng.random::<f64>() < outliers {
                        rng.random_range(-3.0..3.0)
                    } else {
                        sound_rad
                    }
                });
                with_tails += noise.ratio() / f64::from(drives);
                core += noise.core_ratio_of(0) / f64::from(drives);
            }
            if outliers == 0.0 {
                // Twice the standard deviation with either limit.
                assert!(
                    (with_tails - 4.0).abs() < 0.15 && (core - 4.0).abs() < 0.15,
                    "{with_tails} {core}"
                );
            }
        }
        // Nearly one of twelve differences contains an outlier, which contributes the limited
        // square.
        assert!(
            core < 1.3 * 4.0 && with_tails > 1.3 * 4.0,
            "{core} {with_tails}"
        );
    }

    #[test]
    fn noisier_angles_are_detected_and_a_bias_is_not() {
        assert_eq!(after(0.5, 0.05, 2.0), 1.0);
        // Differences of 0.4 rad, with an expected 0.14 rad: 8 times the variance.
        let ratio = after(0.5, 0.2, 2.0);
        assert!((ratio - 8.0).abs() < 0.5, "{ratio}");
        // A slow vehicle receives identical scatter repeatedly.
        assert_eq!(after(0.0, 0.2, 1e-3), 1.0);
    }

    #[test]
    fn the_noise_of_each_radio_head_is_estimated_from_its_angles() {
        let mut noise = NoiseScale::new(3);
        for number in 0..2000 {
            let sign = f64::from(1 - 2 * (number % 2));
            let place_wavelengths = 2.0 * f64::from(number);
            noise.see(0, &predict_measurement(place_wavelengths, 0.2 * sign));
            noise.see(1, &predict_measurement(place_wavelengths, 0.05 * sign));
        }
        assert!((noise.ratio_of(0) - 8.0).abs() < 0.5);
        assert_eq!(noise.ratio_of(1), 1.0);
        // A radio head without angles has the ratio of all radio heads.
        assert_eq!(noise.ratio_of(2), noise.ratio());
        assert!(noise.ratio() > 2.0);
        // The ratio is unchanged after a restart.
        assert_eq!(noise.resumed().ratio_of(0), noise.ratio_of(0));
    }
}
