//! An estimate that is due waits for an SSB that is worth it.
//!
//! The paper says that "under unfavorable conditions, the controller adaptively defers" estimates,
//! and its Algorithm 1 does so by nothing but a longer wake-up time. This policy reads it otherwise:
//! whatever makes an estimate due, no angle is estimated from an SSB below a set point.

use super::due::Due;
use super::policy::{Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::SensedSsb;
use crate::settings::SnrSetPoint;

/// Estimates an angle at the first SSB that is due and not below the set point.
#[derive(Debug)]
pub struct Gated {
    due: Due,
    set_point: SnrSetPoint,
    latest_s: f64,
}

impl Gated {
    /// Waits until `latest_s` after the last estimate, and no longer.
    pub const fn new(due: Due, set_point: SnrSetPoint, latest_s: f64) -> Self {
        Self {
            due,
            set_point,
            latest_s,
        }
    }
}

impl WakeUpPolicy for Gated {
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
        if let Some((ssb, head)) = now.strongest(sensed) {
            let due = self.due.sense(now, ssb, head)?;
            let worth_it = now.snr_shortfall_db(self.set_point, ssb, head)? <= 0.0;
            if due && (worth_it || self.due.has_passed(now.time_s, self.latest_s)) {
                self.due.estimated(now.time_s);
                chosen.fill(true);
            }
        }
        Ok(self.due.wake_up_time_s())
    }
}
