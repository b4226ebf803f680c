//! True mounting and channel errors of the array.

use num_complex::Complex64;
use onboard::geometry::Point;
use onboard::observation::MAX_ELEMENTS;
use onboard::radio_head::RadioHead;
use onboard::settings::ArraySettings;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::antennas::{Antennas, steer};
use super::path::VehicleState;

/// Array of one run: initial errors, followed by a random walk over the distance driven.
#[derive(Debug, Clone)]
pub struct TrueArray {
    /// True values; their random errors have been drawn.
    settings: ArraySettings,
    antennas: Antennas,
    rng: ChaCha8Rng,
    /// Amplitude of each antenna due to gain drift.
    amplitudes: [f64; MAX_ELEMENTS],
    amplitude_rng: ChaCha8Rng,
    along_m: f64,
}

/// Line of sight from a radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineOfSight {
    /// Components along the array's axis and to its left of the unit vector to the radio head.
    pub towards: [f64; 2],
    /// Distance in metres.
    pub distance_m: f64,
    /// Position of the array's centre.
    pub place: Point,
    /// Direction of the array's axis in the map frame in radians.
    pub axis_rad: f64,
    /// Distance driven in metres.
    pub along_m: f64,
    /// Time in seconds.
    pub time_s: f64,
}

impl TrueArray {
    /// Creates the array at the start of a run; `rng` draws the random walk.
    pub fn new(settings: ArraySettings, rng: ChaCha8Rng) -> Self {
        // A separate stream for the gains, so that gain drift does not change other random numbers.
        let mut amplitude_rng = rng.clone();
        amplitude_rng.set_stream(1);
        Self {
            antennas: Antennas::new(&settings),
            settings,
            rng,
            amplitudes: [1.0; MAX_ELEMENTS],
            amplitude_rng,
            along_m: 0.0,
        }
    }

    /// Returns the current true values.
    pub const fn settings(&self) -> &ArraySettings {
        &self.settings
    }

    /// Returns the antennas.
    pub const fn antennas(&self) -> &Antennas {
        &self.antennas
    }

    /// Advances the random walk to the distance `along_m`. Call this function once per SSB, in
    /// order.
    pub fn advance(&mut self, along_m: f64) {
        let root_m = (along_m - self.along_m).abs().sqrt();
        self.along_m = along_m;
        let mut normal = || self.rng.sample::<f64, _>(StandardNormal);
        let array = &mut self.settings;
        array.mounting_rad += array.mounting_drift_rad_per_sqrt_m * root_m * normal();
        array.phase_rad += array.phase_drift_rad_per_sqrt_m * root_m * normal();
        let gain_std_db = array.gain_drift_db_per_sqrt_m * root_m;
        if gain_std_db > 0.0 {
            for amplitude in self.amplitudes.iter_mut().take(array.elements.into()) {
                let by_db = gain_std_db * self.amplitude_rng.sample::<f64, _>(StandardNormal);
                *amplitude *= 10f64.powf(0.05 * by_db);
            }
        }
    }

    /// Returns the line of sight to a radio head.
    pub fn line_of_sight(&self, vehicle: &VehicleState, head: &RadioHead) -> LineOfSight {
        let eye = self.eye(vehicle);
        let distance_m = head.distance_m(eye, self.height_m());
        let level = eye.distance_m(head.position) / distance_m;
        let axis_rad = vehicle.pose.heading_rad + self.settings.mounting_rad;
        let to_axis_rad = eye.bearing_rad(head.position) - axis_rad;
        let (left, along) = to_axis_rad.sin_cos();
        LineOfSight {
            towards: [level * along, level * left],
            distance_m,
            place: eye,
            axis_rad,
            along_m: vehicle.along_m,
            time_s: vehicle.time_s,
        }
    }

    /// Returns the position of the array's centre.
    fn eye(&self, vehicle: &VehicleState) -> Point {
        match self.settings.position_m {
            // Fast path: called for every SSB.
            [0.0, 0.0, _] => vehicle.pose.point(),
            [forward_m, left_m, _] => vehicle.pose.point_at(forward_m, left_m),
        }
    }

    const fn height_m(&self) -> f64 {
        let [_, _, up_m] = self.settings.position_m;
        up_m
    }

    /// Applies the phase and gain errors of the receive channels to the field at the antennas.
    pub fn distort(&self, gains: &mut [Complex64]) {
        steer(gains, self.settings.phase_rad);
        for (gain, amplitude) in gains.iter_mut().zip(self.amplitudes) {
            *gain *= amplitude;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Streams};

    #[test]
    fn mounting_and_phase_drift_have_the_specified_spread() {
        let settings = ArraySettings {
            mounting_drift_rad_per_sqrt_m: 0.004,
            phase_drift_rad_per_sqrt_m: 0.01,
            ..ArraySettings::default()
        };
        let runs = 2000;
        let mut squares = [0.0; 2];
        for run in 0..runs {
            let rng = Streams::new(1, run).generator(Purpose::Array, 0);
            let mut array = TrueArray::new(settings.clone(), rng);
            for step in 1..=100 {
                array.advance(0.25 * f64::from(step));
            }
            squares[0] += array.settings.mounting_rad.powi(2) / runs as f64;
            squares[1] += array.settings.phase_rad.powi(2) / runs as f64;
        }
        // Variances 0.004² · 25 m and 0.01² · 25 m; tolerance of four standard deviations of the
        // sample variance.
        for (found, expected) in squares.into_iter().zip([4e-4, 2.5e-3]) {
            let ratio: f64 = found / expected;
            assert!(
                (ratio - 1.0).abs() < 4.0 * (2.0 / runs as f64).sqrt(),
                "{ratio}"
            );
        }
    }

    #[test]
    fn gain_drift_has_the_specified_spread_and_does_not_change_the_phase() {
        let settings = ArraySettings {
            phase_drift_rad_per_sqrt_m: 0.01,
            gain_drift_db_per_sqrt_m: 0.2,
            ..ArraySettings::default()
        };
        let runs = 2000;
        let mut sums = [[0.0; 2]; 2];
        for run in 0..runs {
            let rng = Streams::new(1, run).generator(Purpose::Array, 0);
            let steady = ArraySettings {
                gain_drift_db_per_sqrt_m: 0.0,
                ..settings.clone()
            };
            let [mut array, mut other] =
                [&settings, &steady].map(|it| TrueArray::new(it.clone(), rng.clone()));
            for step in 1..=100 {
                array.advance(0.25 * f64::from(step));
                other.advance(0.25 * f64::from(step));
            }
            assert_eq!(array.settings.phase_rad, other.settings.phase_rad);
            let [mut gains, mut of_other] = [[Complex64::ONE; 4]; 2];
            array.distort(&mut gains);
            other.distort(&mut of_other);
            let [first_db, second_db, ..] = [0, 1, 2, 3].map(|antenna| {
                assert!((gains[antenna] / of_other[antenna]).arg().abs() < 1e-12);
                20.0 * (gains[antenna].norm() / of_other[antenna].norm()).log10()
            });
            for (row, a_db) in sums.iter_mut().zip([first_db, second_db]) {
                for (sum, b_db) in row.iter_mut().zip([first_db, second_db]) {
                    *sum += a_db * b_db / runs as f64;
                }
            }
        }
        // Variance (0.2 dB)² · 25 m, independent for each antenna; tolerance of four standard
        // deviations of the sample variance and covariance.
        let [[first, both], [_, second]] = sums;
        let deviation = (runs as f64).sqrt().recip();
        assert!(
            (first - 1.0).abs() < 4.0 * 2f64.sqrt() * deviation,
            "{first}"
        );
        assert!(
            (second - 1.0).abs() < 4.0 * 2f64.sqrt() * deviation,
            "{second}"
        );
        assert!(both.abs() < 4.0 * deviation, "{both}");
    }

    #[test]
    fn an_array_without_phase_errors_does_not_change_the_signals() {
        let rng = Streams::new(1, 0).generator(Purpose::Array, 0);
        let mut array = TrueArray::new(ArraySettings::default(), rng);
        array.advance(50.0);
        let mut gains = [Complex64::new(1.0, 2.0); 4];
        array.distort(&mut gains);
        assert_eq!(gains, [Complex64::new(1.0, 2.0); 4]);
    }
}
