//! How much noisier the angles are than stated, as where the Rician K is less than believed.

use crate::clone_in_place::clone_in_place;
use crate::geometry::wrap_angle;
use crate::localize::ekf::ExcludedInnovation;

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

clone_in_place! {
    /// Mean squared difference between successive innovations of a radio head, over what it ought to be
    /// (von Neumann 1941); that of each, and of all. What is off by as much each time, as a fault makes it, does not show
    /// in it.
    #[derive(Debug, PartialEq)]
    pub struct NoiseRatio {
        heads: Vec<HeadNoise>,
        of_all: Ratio,
    }
}

/// What was heard of a radio head.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadNoise {
    /// The last innovation, which the next is compared with.
    last: Option<ExcludedInnovation>,
    /// None until it is heard: it is as noisy as all of them then.
    ratio: Option<Ratio>,
}

/// Variance by what is stated, with tails and beside outliers.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ratio {
    differences: u32,
    with_tails: f64,
    core: f64,
}

impl Ratio {
    /// Before anything is seen.
    const STATED: Self = Self {
        differences: 0,
        with_tails: 1.0,
        core: 1.0,
    };

    /// Takes in a squared difference over what is expected.
    fn see(&mut self, square: f64) {
        self.differences = self.differences.saturating_add(1);
        let weight = LEAST_WEIGHT.max(f64::from(STATED + self.differences).recip());
        let mean = |value: &mut f64, most: f64, of_most: f64| {
            *value += weight * (square.min(most * most * *value) / of_most - *value);
        };
        mean(&mut self.with_tails, MOST, OF_MOST);
        mean(&mut self.core, CORE, OF_CORE);
    }
}

impl NoiseRatio {
    /// As stated, of so many radio heads.
    pub fn new(heads: usize) -> Self {
        let heard = HeadNoise {
            last: None,
            ratio: None,
        };
        Self {
            heads: vec![heard; heads],
            of_all: Ratio::STATED,
        }
    }

    /// As noisy as they were found to be, of filters begun anew.
    pub fn resumed(&self) -> Self {
        let mut heads = self.heads.clone();
        for head in &mut heads {
            head.last = None;
        }
        Self { heads, ..*self }
    }

    /// Takes in an angle to radio head number `head`. Within a wavelength scatter is the same.
    pub fn see(&mut self, head: usize, now: &ExcludedInnovation) {
        let Some(heard) = self.heads.get_mut(head) else {
            return;
        };
        let Some(before) = heard.last else {
            heard.last = Some(*now);
            return;
        };
        if now.place_wavelengths - before.place_wavelengths < 1.0 {
            return;
        }
        heard.last = Some(*now);
        let seen = now.innovation;
        let belief = seen.variance - seen.measurement_variance;
        let expected = before.first_variance + now.first_variance + belief;
        let difference = wrap_angle(seen.residual - before.innovation.residual);
        let square = difference * difference / expected;
        let as_all = Ratio {
            differences: 0,
            ..self.of_all
        };
        heard.ratio.get_or_insert(as_all).see(square);
        self.of_all.see(square);
    }

    /// Variance of the angles by what is stated, not less than that.
    pub const fn ratio(&self) -> f64 {
        self.of_all.with_tails.max(1.0)
    }

    fn of(&self, head: usize) -> Ratio {
        let heard = self.heads.get(head).and_then(|it| it.ratio);
        heard.unwrap_or(self.of_all)
    }

    /// That of a radio head.
    pub fn ratio_of(&self, head: usize) -> f64 {
        self.of(head).with_tails.max(1.0)
    }

    /// That of a radio head beside outliers.
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

    /// An angle of 0.1 rad of stated deviation.
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

    /// Looks so many wavelengths apart, with these residuals.
    fn heard(apart_wavelengths: f64, mut residual_rad: impl FnMut(i32) -> f64) -> NoiseRatio {
        let mut noise = NoiseRatio::new(1);
        for number in 0..2000 {
            let place_wavelengths = apart_wavelengths * f64::from(number);
            noise.see(
                0,
                &predict_measurement(place_wavelengths, residual_rad(number)),
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
                core += noise.core_ratio_of(0) / f64::from(drives);
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
        // A vehicle that hardly moves hears the same scatter again.
        assert_eq!(after(0.0, 0.2, 1e-3), 1.0);
    }

    #[test]
    fn each_radio_head_is_as_noisy_as_it_is_heard_to_be() {
        let mut noise = NoiseRatio::new(3);
        for number in 0..2000 {
            let sign = f64::from(1 - 2 * (number % 2));
            let place_wavelengths = 2.0 * f64::from(number);
            noise.see(0, &predict_measurement(place_wavelengths, 0.2 * sign));
            noise.see(1, &predict_measurement(place_wavelengths, 0.05 * sign));
        }
        assert!((noise.ratio_of(0) - 8.0).abs() < 0.5);
        assert_eq!(noise.ratio_of(1), 1.0);
        // One that was not heard is as noisy as all of them.
        assert_eq!(noise.ratio_of(2), noise.ratio());
        assert!(noise.ratio() > 2.0);
        // Begun anew it is what it was.
        assert_eq!(noise.resumed().ratio_of(0), noise.ratio_of(0));
    }
}
