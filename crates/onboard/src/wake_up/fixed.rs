//! Wake-up at a fixed interval.

use super::policy::{SAME_TIME_S, Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::SensedSsb;

/// Due at every multiple of the interval; each is served by the first SSB at or after it. Waiting
/// for an SSB does not shift the ones that follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedInterval {
    interval_s: f64,
    served: u64,
}

impl FixedInterval {
    /// Due for the first time at 0 s.
    pub const fn new(interval_s: f64) -> Self {
        Self {
            interval_s,
            served: 0,
        }
    }

    /// Whether an estimate is due by `time_s`.
    pub fn is_due(&self, time_s: f64) -> bool {
        time_s + SAME_TIME_S >= self.served as f64 * self.interval_s
    }

    /// Takes the SSB at `time_s` if an estimate is due.
    fn take(&mut self, time_s: f64) -> bool {
        let due = self.is_due(time_s);
        if due {
            // One SSB serves every due time up to it.
            self.served = ((time_s + SAME_TIME_S) / self.interval_s).floor() as u64 + 1;
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
    fn faster_than_the_ssbs_means_every_ssb() {
        assert_eq!(executions(0.001), 4018);
    }
}
