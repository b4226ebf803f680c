//! Odometry that repeats exactly although the odometer has noise.
//!
//! A sample is repeated if the speed and the step of the distance do not change. A suspicion alone is not a fault: it
//! starts a [test by the angles](crate::localize::modes::OdometryTest).

use super::repetition::Repetitions;
use crate::observation::OdometrySample;

/// Minimum speed in m/s. Slower wheels may repeat their speed because of the resolution.
const MOVING_MPS: f64 = 0.1;
/// Maximum interval between two samples in seconds; a longer one interrupts the run.
const MAX_S: f64 = 0.5;
/// Minimum fraction of samples at which the change alternates its sign. Independent noise has two
/// thirds; a smooth motion has almost none.
const ALTERNATING_SHARE: f64 = 0.2;
/// Maximum duration of a run in seconds; a longer run is normal, because a source without noise has
/// replaced the odometer.
const MAX_RUN_S: f64 = 60.0;
/// Maximum deviation of a repeated step of the distance, relative to the integrated speed.
const STEP_SHARE: f64 = 1e-3;
/// Maximum deviation of a repeated step of the distance, in metres.
const STEP_M: f64 = 1e-6;

/// Counts repeated samples.
#[derive(Debug, Clone, Default)]
pub struct Constancy {
    last: Option<OdometrySample>,
    last_step_m: f64,
    /// Last changes of the speed and of the step of the distance, other than zero, in m/s and m.
    last_changes: [f64; 2],
    repetitions: Repetitions,
    alternating: u32,
    /// Time of the first repetition of the current run, in seconds.
    run_since_s: f64,
}

impl Constancy {
    /// Processes an odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) {
        let Some(last) = self.last.replace(*sample) else {
            return;
        };
        let duration_s = sample.time_s - last.time_s;
        let is_moving = sample.speed_mps.abs() >= MOVING_MPS && last.speed_mps.abs() >= MOVING_MPS;
        if !is_moving || duration_s > MAX_S {
            self.repetitions.interrupt();
            self.last_changes = [0.0; 2];
            return;
        }
        let step_m = sample.distance_m - last.distance_m;
        let last_step_m = std::mem::replace(&mut self.last_step_m, step_m);
        let by_speed_m = sample.speed_mps * duration_s;
        let has_speed_step = (step_m - by_speed_m).abs() <= STEP_SHARE * by_speed_m.abs() + STEP_M;
        let mut changes = [sample.speed_mps - last.speed_mps, step_m - last_step_m];
        if has_speed_step || changes[1].abs() <= STEP_M {
            changes[1] = 0.0;
        }
        if changes == [0.0; 2] {
            if self.repetitions.run() == 0 {
                self.run_since_s = sample.time_s;
            }
            self.repetitions.repeat();
            if sample.time_s - self.run_since_s > MAX_RUN_S {
                self.alternating >>= self.repetitions.count_run();
            }
            return;
        }
        self.alternating >>= self.repetitions.change();
        let mut alternates = false;
        for (last, change) in self.last_changes.iter_mut().zip(changes) {
            if change != 0.0 {
                alternates |= change * *last < 0.0;
                *last = change;
            }
        }
        self.alternating += u32::from(alternates);
    }

    /// Whether the current run is improbable for the odometer.
    pub fn is_suspicious(&self) -> bool {
        let samples = f64::from(self.repetitions.samples());
        f64::from(self.alternating) >= ALTERNATING_SHARE * samples
            && self.repetitions.is_suspicious()
    }

    /// Marks the current run as that of a fault.
    pub const fn mark_fault(&mut self) {
        self.repetitions.mark_fault();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform random numbers between −1 and 1 (linear congruential generator).
    struct Noise(u64);

    impl Noise {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        }
    }

    /// Returns the times of suspicion within 120 s at 50 Hz, for a reported speed as a function of
    /// time (s).
    fn suspicions(speed_mps: impl Fn(f64, &mut Noise) -> f64) -> Vec<f64> {
        let (mut monitor, mut noise) = (Constancy::default(), Noise(3));
        let (mut found, mut distance_m) = (Vec::new(), 0.0);
        for number in 0..6000 {
            let time_s = 0.02 * f64::from(number);
            let speed_mps = speed_mps(time_s, &mut noise);
            distance_m += 0.02 * speed_mps;
            monitor.odometry(&OdometrySample {
                time_s,
                distance_m,
                speed_mps,
                yaw_rate_radps: None,
            });
            if monitor.is_suspicious() {
                found.push(time_s);
            }
        }
        found
    }

    /// Returns the speed of a trip: acceleration, cruise with a slow oscillation of 5 cm/s,
    /// braking, stop.
    fn true_mps(time_s: f64) -> f64 {
        let within_s = time_s % 40.0;
        let cruise_mps = 2.0 + 0.05 * (0.5 * within_s).sin();
        (0.5 * within_s).min(36.0 - within_s).clamp(0.0, cruise_mps)
    }

    #[test]
    fn a_frozen_speed_of_a_noisy_odometer_is_suspicious_within_a_quarter_of_a_second() {
        let noisy = |time_s: f64, noise: &mut Noise| {
            let time_s = if time_s < 20.0 { time_s } else { 20.0 };
            let here = noise.next();
            true_mps(time_s) + if time_s < 20.0 { 0.02 * here } else { 0.0 }
        };
        let found = suspicions(noisy);
        assert!((20.0..20.25).contains(&found[0]), "{}", found[0]);
        // The run is normal after a minute.
        assert!(found.len() > 2900 && found.len() < 3100, "{}", found.len());
        // With a resolution of 2 cm/s, half of the samples are repetitions.
        let coarse = |time_s: f64, noise: &mut Noise| {
            let here = true_mps(time_s.min(20.0)) + 0.02 * noise.next();
            let held = (true_mps(20.0) / 0.02).round() * 0.02;
            if time_s < 20.0 {
                (here / 0.02).round() * 0.02
            } else {
                held
            }
        };
        let found = suspicions(coarse);
        assert!((20.0..20.7).contains(&found[0]), "{}", found[0]);
    }

    #[test]
    fn odometers_with_and_without_noise_are_not_suspicious() {
        let noisy = |time_s: f64, noise: &mut Noise| match true_mps(time_s) {
            0.0 => 0.0,
            moving => moving + 0.02 * noise.next(),
        };
        assert!(suspicions(noisy).is_empty());
        // An odometer without noise, at constant speed and with an oscillation.
        assert!(suspicions(|time_s, _| true_mps(time_s).min(1.9)).is_empty());
        assert!(suspicions(|time_s, _| true_mps(time_s)).is_empty());
        // Every sample is sent twice.
        let twice = |time_s: f64, _: &mut Noise| {
            let number = (time_s / 0.04 + 0.25).floor();
            true_mps(0.04 * number) + 0.02 * Noise(number as u64).next()
        };
        assert!(suspicions(twice).is_empty());
    }
}
