//! How the array really sits on the vehicle, and what its phase calibration leaves.

use num_complex::Complex64;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::observation::Snapshot;
use crate::random::{Purpose, Streams};
use crate::scenario::ArraySettings;

/// The array of one run: errors drawn at the start, then random walks over the distance driven.
#[derive(Debug, Clone)]
pub struct ArrayDrift {
    settings: ArraySettings,
    rng: ChaCha8Rng,
    mounting_error_rad: f64,
    phase_error_rad: f64,
    along_m: f64,
}

impl ArrayDrift {
    /// The array at the start of the run that `streams` belongs to.
    pub fn new(settings: ArraySettings, streams: Streams) -> Self {
        let mut rng = streams.generator(Purpose::Array, 0);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        Self {
            mounting_error_rad: settings.mounting_error_std_rad * normal(),
            phase_error_rad: settings.phase_error_std_rad * normal(),
            settings,
            rng,
            along_m: 0.0,
        }
    }

    /// Moves on to this distance along the road; to be called once for each SSB, in order.
    pub fn advance(&mut self, along_m: f64) {
        let root_m = (along_m - self.along_m).abs().sqrt();
        self.along_m = along_m;
        let mut normal = || self.rng.sample::<f64, _>(StandardNormal);
        self.mounting_error_rad += self.settings.mounting_drift_rad_per_sqrt_m * root_m * normal();
        self.phase_error_rad += self.settings.phase_drift_rad_per_sqrt_m * root_m * normal();
    }

    /// Direction of the array's axis from the vehicle's forward axis (rad).
    pub fn mounting_rad(&self) -> f64 {
        self.settings.mounting_angle_rad + self.mounting_error_rad
    }

    /// Phase by which each antenna runs ahead of the one before it (rad).
    pub const fn phase_error_rad(&self) -> f64 {
        self.phase_error_rad
    }

    /// What the array makes of the field at its antennas.
    pub fn turn(&self, gains: &mut Snapshot) {
        if self.phase_error_rad == 0.0 {
            return;
        }
        let step = Complex64::cis(self.phase_error_rad);
        let mut turn = Complex64::ONE;
        for gain in gains {
            *gain *= turn;
            turn *= step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_and_drift_have_their_spread() {
        let settings = ArraySettings {
            mounting_error_std_rad: 0.02,
            mounting_drift_rad_per_sqrt_m: 0.004,
            phase_drift_rad_per_sqrt_m: 0.01,
            ..ArraySettings::default()
        };
        let runs = 2000;
        let mut squares = [0.0; 2];
        for run in 0..runs {
            let mut array = ArrayDrift::new(settings, Streams::new(1, run));
            for step in 1..=100 {
                array.advance(0.25 * f64::from(step));
            }
            squares[0] += array.mounting_rad().powi(2) / runs as f64;
            squares[1] += array.phase_error_rad().powi(2) / runs as f64;
        }
        // 0.02² + 0.004² · 25 m, and 0.01² · 25 m; four deviations of a sample variance.
        for (found, expected) in squares.into_iter().zip([8e-4, 2.5e-3]) {
            let ratio: f64 = found / expected;
            assert!(
                (ratio - 1.0).abs() < 4.0 * (2.0 / runs as f64).sqrt(),
                "{ratio}"
            );
        }
    }

    #[test]
    fn an_array_without_errors_is_as_surveyed() {
        let settings = ArraySettings {
            mounting_angle_rad: 0.3,
            ..ArraySettings::default()
        };
        let mut array = ArrayDrift::new(settings, Streams::new(1, 0));
        array.advance(50.0);
        let mut gains = [Complex64::new(1.0, 2.0); crate::observation::ANTENNAS];
        array.turn(&mut gains);
        assert_eq!(array.mounting_rad(), 0.3);
        assert_eq!(
            gains,
            [Complex64::new(1.0, 2.0); crate::observation::ANTENNAS]
        );
    }
}
