//! Wake-up at a fixed interval.

use super::policy::{SAME_TIME_S, Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::SensedSsb;

/// All SSBs of a burst lie this close together: 64 of them, their own length less than half a frame
/// (TS 38.213, 4.1).
const BURST_S: f64 = 4.9e-3;

/// Due at every multiple of the interval; each is served by the first burst at or after it. Waiting
/// for a burst does not shift the ones that follow. What comes late, from before the last burst
/// that served or along with it, is taken: whether it would have served is not remembered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedInterval {
    interval_s: f64,
    served: f64,
    served_at_s: f64,
}

impl FixedInterval {
    /// Due for the first time at 0 s.
    pub const fn new(interval_s: f64) -> Self {
        Self {
            interval_s,
            served: 0.0,
            served_at_s: f64::NEG_INFINITY,
        }
    }

    /// Whether an estimate is due by `time_s`.
    pub fn is_due(&self, time_s: f64) -> bool {
        time_s + SAME_TIME_S >= self.served * self.interval_s || time_s < self.served_at_s + BURST_S
    }

    /// Takes the SSB at `time_s` if an estimate is due.
    fn take(&mut self, time_s: f64) -> bool {
        let due = self.is_due(time_s);
        if due {
            // One SSB serves every due time up to it.
            let served = ((time_s + SAME_TIME_S) / self.interval_s).floor() + 1.0;
            if served > self.served {
                (self.served, self.served_at_s) = (served, time_s);
            }
        }
        due
    }
}

impl WakeUpPolicy for FixedInterval {
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError> {
        Ok(self.is_due(now.time_s))
    }

    fn decide(
        &mut self,
        now: &Situation<'_>,
        _sensed: &[SensedSsb],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        chosen.fill(self.take(now.time_s));
        Ok(self.interval_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn executions(interval_s: f64) -> usize {
        let mut policy = FixedInterval::new(interval_s);
        // The 80.33 s trip, on to the first SSB that finds the vehicle at its end.
        (0..=4017)
            .filter(|&k| policy.take(f64::from(k) * 0.02))
            .count()
    }

    #[test]
    fn executions_on_the_papers_trip() {
        assert_eq!(executions(0.02), 4018);
        assert_eq!(executions(0.08), 1005);
        assert_eq!(executions(0.07), 1148);
        assert_eq!(executions(0.075), 1072);
        assert!(executions(0.065) > 1235);
        assert!(executions(0.1) > 800);
    }

    #[test]
    fn what_comes_late_is_taken_and_shifts_nothing() {
        let mut policy = FixedInterval::new(0.08);
        assert!(policy.take(0.0) && policy.take(0.16));
        // From before, and another SSB of the burst that served.
        assert!(policy.take(0.02) && policy.take(0.163));
        assert!(!policy.take(0.18) && !policy.take(0.22));
        assert!(policy.take(0.24));
    }

    #[test]
    fn faster_than_the_ssbs_means_every_ssb() {
        assert_eq!(executions(0.001), 4018);
    }
}
