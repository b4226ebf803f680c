//! Consistency of the odometry's distance and speed.
//!
//! Both are measured by the same wheels. The difference between the step of the distance and the
//! integrated speed is summed with exponential forgetting. It exceeds a quarter of the distance
//! driven only if one of them is wrong.

use crate::observation::OdometrySample;

/// Time constant of the sums, in seconds.
const MEMORY_S: f64 = 1.0;
/// Minimum summed difference of a fault, in metres. The resolution of encoders and of rounded
/// speeds causes smaller differences.
const MIN_M: f64 = 0.15;
/// Minimum summed difference of a fault, as a fraction of the summed distance. A wrong scale or
/// noise causes smaller fractions; a frozen value has 1, and a halved speed has 0.5.
const SHARE: f64 = 0.25;
/// Maximum of the summed difference, in multiples of the minimum of a fault.
const BOUND: f64 = 2.0;
/// Maximum difference that one sample adds at zero speed, in metres. A counter that is reset once
/// is no fault, because the localizer then uses the speed.
const MAX_DIFFERENCE_PER_SAMPLE_M: f64 = 0.1;
/// Maximum duration of an interval in seconds. In a longer interval, the speed is unknown.
const MAX_S: f64 = 0.5;

/// Exponentially weighted sums of distance and difference.
#[derive(Debug, Clone, Copy, Default)]
pub struct Contradiction {
    last: Option<OdometrySample>,
    difference_m: f64,
    driven_m: f64,
    is_faulty: bool,
}

impl Contradiction {
    /// Processes a sample. Returns whether distance and speed contradict each other.
    pub fn odometry(&mut self, sample: &OdometrySample) -> bool {
        let Some(last) = self.last.replace(*sample) else {
            return false;
        };
        let duration_s = sample.time_s - last.time_s;
        if duration_s > MAX_S {
            return self.is_faulty;
        }
        // Reduce the old sums by exponential forgetting, then add the newest interval.
        let kept = (-duration_s / MEMORY_S).exp();
        let by_speed_m = 0.5 * (last.speed_mps + sample.speed_mps) * duration_s;
        let by_distance_m = sample.distance_m - last.distance_m;
        let max_m = MAX_DIFFERENCE_PER_SAMPLE_M + 2.0 * by_speed_m.abs();
        let difference_m = (by_distance_m - by_speed_m).clamp(-max_m, max_m);
        self.driven_m = kept * self.driven_m + by_speed_m.abs().max(by_distance_m.abs().min(max_m));
        let threshold_m = MIN_M + SHARE * self.driven_m;
        // The sum is limited, so that large and small faults end after the same time.
        let bound_m = BOUND * threshold_m;
        self.difference_m = (kept * self.difference_m + difference_m).clamp(-bound_m, bound_m);
        // A fault ends at half of the threshold (hysteresis), so that it is reported once.
        let factor = if self.is_faulty { 0.5 } else { 1.0 };
        self.is_faulty = self.difference_m.abs() > factor * threshold_m;
        self.is_faulty
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the times at which the contradiction begins and ends within 10 s at 50 Hz.
    fn changes(reading: impl Fn(f64, &mut OdometrySample)) -> Vec<f64> {
        let (mut monitor, mut changes, mut faulty) = (Contradiction::default(), Vec::new(), false);
        for number in 0..500 {
            let time_s = 0.02 * f64::from(number);
            let mut sample = OdometrySample {
                time_s,
                distance_m: 2.0 * time_s,
                speed_mps: 2.0,
                yaw_rate_radps: None,
            };
            reading(time_s, &mut sample);
            if monitor.odometry(&sample) != faulty {
                faulty = !faulty;
                changes.push(time_s);
            }
        }
        changes
    }

    #[test]
    fn frozen_and_reversed_values_are_detected_within_two_seconds() {
        let during = |time_s: f64| (3.0..6.0).contains(&time_s);
        let frozen_distance = changes(|time_s, it| {
            if during(time_s) {
                it.distance_m = 6.0;
            }
        });
        let frozen_speed = changes(|time_s, it| {
            if during(time_s) {
                it.speed_mps = 0.0;
            }
        });
        let reversed = changes(|time_s, it| {
            if during(time_s) {
                it.speed_mps = -2.0;
            }
        });
        for found in [frozen_distance, frozen_speed, reversed] {
            let [begins_s, ends_s] = found[..] else {
                panic!("{found:?}");
            };
            assert!((3.0..5.0).contains(&begins_s), "{begins_s}");
            assert!((6.0..8.0).contains(&ends_s), "{ends_s}");
        }
    }

    #[test]
    fn a_reset_counter_a_wrong_scale_and_noise_are_no_contradiction() {
        let reset = |time_s: f64, it: &mut OdometrySample| {
            if time_s > 5.0 {
                it.distance_m -= 1e4;
            }
        };
        assert!(changes(reset).is_empty());
        assert!(changes(|_, it| it.distance_m *= 1.3).is_empty());
        let noise = |time_s: f64, it: &mut OdometrySample| {
            it.speed_mps += 0.5 * (37.0 * time_s).sin();
            it.distance_m = (it.distance_m / 0.05).floor() * 0.05;
        };
        assert!(changes(noise).is_empty());
    }
}
