//! Plausibility of the odometer: jumps of its speed due to slip, and lost samples.

/// Weight of the newest step in the mean square if the step is larger. Larger steps are learned
/// fast.
const RISE: f64 = 0.2;
/// Weight of the newest step in the mean square if the step is smaller. Larger steps are forgotten
/// slowly.
const FALL: f64 = 0.01;

/// Ratio to the usual step above which a step is unusual.
const UNUSUAL: f64 = 5.0;

/// Usual change of the speed between two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SpeedJumps {
    /// Mean square of the changes (m²/s²).
    mean_square: f64,
    /// Relative jump of the speed at the newest sample, if it exceeds the minimum and is unusual;
    /// otherwise 0.
    pub speed_jump: f64,
}

impl SpeedJumps {
    /// Adds a change of the speed, which is a jump if it exceeds `min_mps` and is unusual.
    pub fn step(&mut self, from_mps: f64, to_mps: f64, min_mps: f64) {
        self.speed_jump = 0.0;
        let fastest_mps = from_mps.abs().max(to_mps.abs());
        if fastest_mps == 0.0 {
            return; // standstill contains no information on the noise
        }
        let step_mps = (to_mps - from_mps).abs();
        let unusual_mps = UNUSUAL * self.mean_square.sqrt();
        if step_mps > min_mps.max(unusual_mps) {
            self.speed_jump = step_mps / fastest_mps;
        }
        let square = step_mps * step_mps;
        let share = if square > self.mean_square {
            RISE
        } else {
            FALL
        };
        self.mean_square += share * (square - self.mean_square);
    }
}

/// Fraction of intervals below the usual one, small enough for recordings that lost most samples.
const QUANTILE: f64 = 0.25;

/// Relative change of the usual interval per sample.
const GAIN: f64 = 0.05;

/// Ratio to the usual interval above which samples were lost.
const LOST: f64 = 1.5;

/// Usual interval between two samples, learned from the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SampleInterval {
    /// Usual interval (s); zero before the first one.
    usual_s: f64,
}

impl SampleInterval {
    /// Returns the usual interval (s); zero before the first one.
    pub const fn usual_s(self) -> f64 {
        self.usual_s
    }

    /// Returns the duration for which a new sample is representative, in seconds: the time since
    /// the previous sample, or the usual interval if samples in between were lost.
    pub fn covered_s(&mut self, duration_s: f64) -> f64 {
        if self.usual_s == 0.0 {
            self.usual_s = duration_s;
        }
        let covered_s = if duration_s > LOST * self.usual_s {
            self.usual_s
        } else {
            duration_s
        };
        let longer = f64::from(u8::from(duration_s > self.usual_s));
        let shorter = f64::from(u8::from(duration_s < self.usual_s));
        // At the quantile, the weighted changes in both directions balance.
        self.usual_s *= 1.0 + GAIN * (QUANTILE * longer - (1.0 - QUANTILE) * shorter);
        covered_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_samples_are_detected_up_to_a_fraction_of_one_half() {
        for every in [2, 3, 10] {
            let mut sample_interval = SampleInterval::default();
            // The first interval spans a lost sample.
            sample_interval.covered_s(0.04);
            let mut wrong = 0;
            for number in 0..1000 {
                let lost = number % every == 0;
                let duration_s = if lost { 0.04 } else { 0.02 };
                let covered_s = sample_interval.covered_s(duration_s);
                wrong += u32::from((covered_s < 0.9 * duration_s) != lost);
                assert!(
                    number < 100 || (covered_s / 0.02 - 1.0).abs() < 0.1,
                    "{covered_s}"
                );
            }
            assert!(wrong < 50, "every {every}: {wrong}");
        }
    }
}
