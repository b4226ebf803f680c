//! Wake-up policy on the clock of the paper's Algorithm 1, optionally with an SNR threshold.
//!
//! According to the paper, "under unfavorable conditions, the controller adaptively defers"
//! estimates. Its Algorithm 1 only lengthens the wake-up time. The threshold is another
//! interpretation: no angle is estimated from an SSB below it, whatever triggers the estimate.

use super::due::Due;
use super::policy::{Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::SsbDetection;
use crate::settings::SnrSetPoint;

/// Wake-up policy that estimates an angle when the wake-up time has elapsed since the previous
/// estimate and the SSB exceeds the threshold, if there is one.
#[derive(Debug)]
pub struct Adaptive {
    due: Due,
    /// Threshold, and the time without an estimate after which it is ignored, in seconds.
    threshold: Option<(SnrSetPoint, f64)>,
}

impl Adaptive {
    /// Creates the policy from a wake-up clock. The SNR threshold is ignored after its time in
    /// seconds without an estimate.
    pub const fn new(due: Due, threshold: Option<(SnrSetPoint, f64)>) -> Self {
        Self { due, threshold }
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
            let is_usable = match self.threshold {
                Some((set_point, latest_s)) => {
                    now.snr_shortfall_db(set_point, ssb, head)? <= 0.0
                        || self.due.has_passed(now.time_s, latest_s)
                }
                None => true,
            };
            if is_usable {
                self.due.estimated(now.time_s);
                chosen.fill(true);
            }
        }
        Ok(self.due.wake_up_time_s())
    }
}
