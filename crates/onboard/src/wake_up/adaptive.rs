//! Algorithm 1 of the paper as a wake-up policy.

use super::due::Due;
use super::policy::{Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::SsbDetection;

/// Wake-up policy that estimates an angle when the wake-up time of Algorithm 1 has elapsed since
/// the previous estimate.
#[derive(Debug)]
pub struct Adaptive {
    due: Due,
}

impl Adaptive {
    /// Creates the policy from a wake-up clock.
    pub const fn new(due: Due) -> Self {
        Self { due }
    }
}

impl WakeUpPolicy for Adaptive {
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError> {
        Ok(self.due.listens(now.time_s))
    }

    /// Decides with the strongest SSB of a known radio head.
    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SsbDetection],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        if let Some((ssb, head)) = now.strongest(sensed)
            && self.due.sense(now, ssb, head)?
        {
            self.due.estimated(now.time_s);
            chosen.fill(true);
        }
        Ok(self.due.wake_up_time_s())
    }
}
