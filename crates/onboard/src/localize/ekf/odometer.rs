//! Plausibility of the odometer: jumps of its speed that are slip and not noise, and samples that were lost.

/// Share of the newest step in the mean square: a larger one is learnt soon, and forgotten slowly.
const RISE: f64 = 0.2;
const FALL: f64 = 0.01;

/// A step this many times the usual one is not of the usual kind.
const UNUSUAL: f64 = 5.0;

/// The usual step of the speed between two samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SpeedJumps {
    /// Mean square of the steps (m²/s²).
    mean_square: f64,
    /// By which share of the speed the newest one jumped, where it was above the least that jumps and none of the usual
    /// ones; 0 otherwise.
    pub speed_jump: f64,
}

impl SpeedJumps {
    /// Takes a step, which jumps where it is above `least_mps` and none of the usual ones.
    pub fn step(&mut self, from_mps: f64, to_mps: f64, least_mps: f64) {
        self.speed_jump = 0.0;
        let fastest_mps = from_mps.abs().max(to_mps.abs());
        if fastest_mps == 0.0 {
            return; // standing tells nothing of the reading's noise
        }
        let step_mps = (to_mps - from_mps).abs();
        let unusual_mps = UNUSUAL * self.mean_square.sqrt();
        if step_mps > least_mps.max(unusual_mps) {
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

/// Share of the intervals that are shorter than the usual one: enough that most samples may be lost.
const QUANTILE: f64 = 0.25;

/// Share by which an interval changes the usual one.
const GAIN: f64 = 0.05;

/// Multiple of the usual interval from which on samples were lost.
const LOST: f64 = 1.5;

/// The usual time between two samples, learnt from the samples themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SampleInterval {
    /// None yet if zero (s).
    usual_s: f64,
}

impl SampleInterval {
    /// How much of the time since the last sample a new one tells of, in seconds: all of it, unless
    /// samples between them were lost.
    pub fn told_s(&mut self, duration_s: f64) -> f64 {
        if self.usual_s == 0.0 {
            self.usual_s = duration_s;
        }
        let told_s = if duration_s > LOST * self.usual_s {
            self.usual_s
        } else {
            duration_s
        };
        let longer = f64::from(u8::from(duration_s > self.usual_s));
        let shorter = f64::from(u8::from(duration_s < self.usual_s));
        // A quantile is where those above and below it pull alike.
        self.usual_s *= 1.0 + GAIN * (QUANTILE * longer - (1.0 - QUANTILE) * shorter);
        told_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lost_is_seen_whatever_share_it_is_up_to_half() {
        for every in [2, 3, 10] {
            let mut sample_interval = SampleInterval::default();
            // The first interval spans a lost sample.
            sample_interval.told_s(0.04);
            let mut wrong = 0;
            for number in 0..1000 {
                let lost = number % every == 0;
                let duration_s = if lost { 0.04 } else { 0.02 };
                let told_s = sample_interval.told_s(duration_s);
                wrong += u32::from((told_s < 0.9 * duration_s) != lost);
                assert!(
                    number < 100 || (told_s / 0.02 - 1.0).abs() < 0.1,
                    "{told_s}"
                );
            }
            assert!(wrong < 50, "every {every}: {wrong}");
        }
    }
}
