//! The pace of odometry: what time a sample tells of, and what was lost before it.

/// Share of the intervals that are shorter than the usual one: enough that most samples may be lost.
const QUANTILE: f64 = 0.25;

/// Share by which an interval changes the usual one.
const GAIN: f64 = 0.05;

/// Multiple of the usual interval from which on samples were lost.
const LOST: f64 = 1.5;

/// The usual time between two samples, learnt from the samples themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pace {
    /// None yet if zero (s).
    usual_s: f64,
}

impl Pace {
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
            let mut pace = Pace::default();
            // The first interval spans a lost sample.
            pace.told_s(0.04);
            let mut wrong = 0;
            for number in 0..1000 {
                let lost = number % every == 0;
                let duration_s = if lost { 0.04 } else { 0.02 };
                let told_s = pace.told_s(duration_s);
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
