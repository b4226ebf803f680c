//! Wake-up policy with a fixed interval.

use super::due::Due;
use super::policy::{Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::{BURST_S, SsbDetection};

/// Wake-up policy with a constant time between estimates, on the clock of Algorithm 1. A late SSB
/// (at or before the previous estimate) is accepted.
#[derive(Debug)]
pub struct FixedInterval {
    due: Due,
}

impl FixedInterval {
    /// Creates the policy from a wake-up clock.
    pub const fn new(due: Due) -> Self {
        Self { due }
    }

    /// Whether an estimate is due at `time_s`.
    pub fn is_due(&self, time_s: f64) -> bool {
        let last_s = self.due.last_estimate_s();
        self.due.is_due(time_s) || last_s.is_some_and(|last_s| time_s < last_s + BURST_S)
    }

    /// Accepts the SSB at `time_s` if an estimate is due.
    fn take(&mut self, time_s: f64) -> bool {
        let due = self.is_due(time_s);
        if self.due.is_due(time_s) {
            self.due.estimated(time_s);
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
        _sensed: &[SsbDetection],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        chosen.fill(self.take(now.time_s));
        Ok(self.due.wake_up_time_s())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aoa_estimates(interval_s: f64, lead_s: f64) -> usize {
        let mut policy = FixedInterval::new(Due::constant(interval_s, lead_s));
        // Trip of 80.33 s, up to the first SSB after its end.
        (0..=4017)
            .filter(|&k| policy.take(f64::from(k) * 0.02))
            .count()
    }

    #[test]
    fn the_number_of_estimates_equals_that_of_the_paper() {
        for (interval_s, after, before) in [
            (0.02, 4018, 4018),
            (0.065, 1005, 1340), // an SSB every 20 ms: 80 ms or 60
            (0.08, 1005, 1005),
            (0.15, 503, 574),
            (0.1, 804, 804),
        ] {
            assert_eq!(aoa_estimates(interval_s, 0.0), after);
            assert_eq!(aoa_estimates(interval_s, 0.02), before);
        }
    }

    #[test]
    fn late_ssbs_are_used_and_do_not_shift_the_interval() {
        let mut policy = FixedInterval::new(Due::constant(0.08, 0.0));
        assert!(policy.take(0.0) && policy.take(0.16));
        // A late SSB, and another SSB of a burst that was already used.
        assert!(policy.take(0.02) && policy.take(0.163));
        assert!(!policy.take(0.18) && !policy.take(0.22));
        assert!(policy.take(0.24));
    }

    #[test]
    fn an_interval_below_the_ssb_period_uses_every_ssb() {
        assert_eq!(aoa_estimates(0.001, 0.0), 4018);
    }
}
