//! Odometer and gyroscope with scale error, noise, bias drift and lost samples.

use onboard::observation::OdometrySample;
use onboard::settings::{GyroscopeSettings, OdometerSettings};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::path::VehicleState;

/// Odometer of one run.
#[derive(Debug, Clone)]
pub struct Odometer {
    /// True values; their random errors have been drawn.
    settings: OdometerSettings,
    gyroscope: Option<GyroscopeSettings>,
    rng: ChaCha8Rng,
    measured_m: f64,
    last: VehicleState,
    /// Number of samples that have been due.
    due: u32,
}

impl Odometer {
    /// Creates the odometer at the start of a run; `rng` draws its noise.
    pub const fn new(
        settings: OdometerSettings,
        gyroscope: Option<GyroscopeSettings>,
        rng: ChaCha8Rng,
        start: VehicleState,
    ) -> Self {
        Self {
            settings,
            gyroscope,
            rng,
            measured_m: 0.0,
            last: start,
            due: 0,
        }
    }

    /// Returns the sample period in seconds.
    pub fn period_s(&self) -> f64 {
        self.settings.rate_hz.recip()
    }

    /// Returns the time of the next sample if it is due by `time_s`, and marks it as taken.
    pub fn next_s(&mut self, time_s: f64) -> Option<f64> {
        let next_s = f64::from(self.due) * self.period_s();
        (next_s <= time_s).then(|| {
            self.due += 1;
            next_s
        })
    }

    /// Returns the sample at `now`, which must be later than the previous one; `None` if the sample
    /// is lost. The first sample is never lost, because it defines the start, to which the initial
    /// pose refers.
    pub fn sample(&mut self, now: VehicleState) -> Option<OdometrySample> {
        let duration_s = now.time_s - self.last.time_s;
        // On the centre line, the path length equals the road length. Elsewhere, the trapezoidal
        // rule of the speed has an error below a micrometre in 20 ms.
        let driven_m = if now.lateral_m == 0.0 && self.last.lateral_m == 0.0 {
            now.along_m - self.last.along_m
        } else {
            0.5 * (now.speed_mps + self.last.speed_mps) * duration_s
        };
        let mut step_m = self.settings.scale * driven_m;
        if self.settings.noise_m_per_sqrt_m > 0.0 {
            step_m += self.settings.noise_m_per_sqrt_m * driven_m.sqrt() * self.normal();
        }
        if self.settings.noise_m_per_sqrt_s > 0.0 && driven_m != 0.0 {
            step_m += self.settings.noise_m_per_sqrt_s * duration_s.sqrt() * self.normal();
        }
        self.measured_m += step_m;
        let yaw_rate_radps = self.gyroscope.and_then(|gyro| {
            let turn_rad = now.pose.heading_rad - self.last.pose.heading_rad
                + gyro.noise_rad_per_sqrt_s * duration_s.sqrt() * self.normal();
            (duration_s > 0.0).then(|| turn_rad / duration_s + gyro.bias_radps)
        });
        self.last = now;
        let is_first = duration_s == 0.0;
        let lost = self.settings.dropout_probability > 0.0
            && self.rng.random::<f64>() < self.settings.dropout_probability;
        (is_first || !lost).then_some(OdometrySample {
            time_s: now.time_s,
            distance_m: self.measured_m,
            speed_mps: self.settings.scale * now.speed_mps,
            yaw_rate_radps,
        })
    }

    fn normal(&mut self) -> f64 {
        self.rng.sample(StandardNormal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use onboard::geometry::Pose;

    use crate::random::{Purpose, Streams};

    fn state(time_s: f64) -> VehicleState {
        let along_m = 4.0 * time_s;
        let pose = Pose {
            x_m: along_m,
            ..Pose::default()
        };
        VehicleState {
            time_s,
            along_m,
            lateral_m: 0.0,
            speed_mps: 4.0,
            pose,
        }
    }

    fn drive(settings: OdometerSettings, run: u64) -> (usize, Option<OdometrySample>) {
        let rng = Streams::new(1, run).generator(Purpose::Odometer, 0);
        let mut odometer = Odometer::new(settings, None, rng, state(0.0));
        let samples: Vec<_> = (1..=500)
            .filter_map(|k| odometer.sample(state(f64::from(k) * 0.02)))
            .collect();
        (samples.len(), samples.last().copied())
    }

    #[test]
    fn odometer_without_errors_is_exact() {
        let (count, last) = drive(OdometerSettings::default(), 0);
        assert_eq!(count, 500);
        assert!((last.unwrap().distance_m - 40.0).abs() < 1e-9);
    }

    #[test]
    fn noise_has_the_specified_variance() {
        let noisy = OdometerSettings {
            noise_m_per_sqrt_m: 0.01,
            ..Default::default()
        };
        let runs = 2000;
        let variance_m2 = (0..runs)
            .filter_map(|run| drive(noisy, run).1)
            .map(|last| (last.distance_m - 40.0).powi(2))
            .sum::<f64>()
            / runs as f64;
        let expected_m2 = 0.01_f64.powi(2) * 40.0;
        // Tolerance: four standard deviations of a sample variance, √(2/n).
        assert!((variance_m2 / expected_m2 - 1.0).abs() < 4.0 * (2.0 / runs as f64).sqrt());
    }

    #[test]
    fn lost_samples_do_not_lose_distance() {
        let lossy = OdometerSettings {
            dropout_probability: 0.5,
            ..Default::default()
        };
        let (count, last) = drive(lossy, 3);
        assert!((200..300).contains(&count), "{count}");
        let last = last.unwrap();
        assert!((last.distance_m - 4.0 * last.time_s).abs() < 1e-9);
    }
}
