//! How much noisier the angles are than stated, as where the Rician K is less than believed.

use crate::clone_in_place::clone_in_place;
use crate::geometry::wrap_angle;
use crate::localize::tracker::Rehearsal;

/// Weight of the newest difference, at least, and differences that the stated noise is worth.
const LEAST_WEIGHT: f64 = 1.0 / 128.0;
const STATED: u32 = 16;

/// Deviations at which a difference is cut off: an outlier is no noise.
const MOST: f64 = 3.0;

/// Mean squared difference between successive innovations of a radio head, over what it ought to be
/// (von Neumann 1941). What is off by as much each time, as a fault makes it, does not show in it.
#[derive(Debug, PartialEq)]
pub struct AngleNoise {
    /// The last look at each radio head that is compared with.
    last: Vec<Option<Rehearsal>>,
    differences: u32,
    ratio: f64,
}

clone_in_place!(AngleNoise {
    last,
    differences,
    ratio
});

impl AngleNoise {
    /// As stated, of so many radio heads.
    pub fn new(heads: usize) -> Self {
        Self {
            last: vec![None; heads],
            differences: 0,
            ratio: 1.0,
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
        self.ratio += weight * (square.min(MOST * MOST * self.ratio) - self.ratio);
    }

    /// Their variance by what is stated, not less than that.
    pub const fn ratio(&self) -> f64 {
        self.ratio.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::localize::gaussian::Innovation;

    /// Looks two wavelengths apart, whose residuals alternate about a mean.
    fn after(mean_rad: f64, by_rad: f64, apart_wavelengths: f64) -> f64 {
        let mut noise = AngleNoise::new(1);
        for number in 0..400 {
            let sign = f64::from(1 - 2 * (number % 2));
            noise.see(
                0,
                &Rehearsal {
                    innovation: Innovation {
                        residual: mean_rad + sign * by_rad,
                        variance: 0.01,
                        measurement_variance: 0.01,
                    },
                    first_variance: 0.01,
                    place_wavelengths: apart_wavelengths * f64::from(number),
                },
            );
        }
        noise.ratio()
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
