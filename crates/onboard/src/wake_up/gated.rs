//! Wake-up policy with an SNR threshold.
//!
//! According to the paper, "under unfavorable conditions, the controller adaptively defers"
//! estimates. Its Algorithm 1 only lengthens the wake-up time. This policy is another
//! interpretation: no angle is estimated from an SSB below a threshold, whatever triggers the
//! estimate.

use super::due::Due;
use super::policy::{Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::SsbDetection;
use crate::settings::SnrSetPoint;

/// Wake-up policy that estimates an angle at the first due SSB above the SNR threshold.
#[derive(Debug)]
pub struct Gated {
    due: Due,
    set_point: SnrSetPoint,
    latest_s: f64,
}

impl Gated {
    /// Creates the policy. After `latest_s` without an estimate, the threshold is ignored.
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

    /// Decides with the strongest SSB of a known radio head.
    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SsbDetection],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        if let Some((ssb, head)) = now.strongest(sensed) {
            let due = self.due.sense(now, ssb, head)?;
            let has_required_snr = now.snr_shortfall_db(self.set_point, ssb, head)? <= 0.0;
            if due && (has_required_snr || self.due.has_passed(now.time_s, self.latest_s)) {
                self.due.estimated(now.time_s);
                chosen.fill(true);
            }
        }
        Ok(self.due.wake_up_time_s())
    }
}
