//! Algorithm 1 as a policy.

use super::due::Due;
use super::policy::{Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::SensedSsb;

/// Estimates an angle once the wake-up time of Algorithm 1 has passed since the last estimate.
#[derive(Debug)]
pub struct Adaptive {
    due: Due,
}

impl Adaptive {
    /// At the times that are due.
    pub const fn new(due: Due) -> Self {
        Self { due }
    }
}

impl WakeUpPolicy for Adaptive {
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError> {
        Ok(self.due.listens(now.time_s))
    }

    /// Judges by the strongest SSB that is on the map.
    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SensedSsb],
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
