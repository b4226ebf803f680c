//! Inputs of Algorithm 1.

use super::pid::Pid;
use super::policy::Situation;
use crate::BoxError;
use crate::observation::SsbDetection;
use crate::radio_head::RadioHead;
use crate::settings::{DeltaT, PidSettings, SnrSetPoint};

/// Algorithm 1 with its inputs. The SNR error is positive if the SNR is below the set point. The
/// velocity error is the difference from the top speed: 0 at top speed, 1 at standstill.
#[derive(Debug)]
pub struct Controller {
    pid: Pid,
    set_point: SnrSetPoint,
    snr_scale_db: f64,
    top_speed_mps: f64,
    delta_t: DeltaT,
    last_sensed_s: Option<f64>,
}

impl Controller {
    /// Creates the controller with the base wake-up time as its first output.
    pub fn new(settings: &PidSettings, base_s: f64, top_speed_mps: f64) -> Self {
        Self {
            pid: Pid::new(settings, base_s, settings.t_max_s(top_speed_mps)),
            set_point: settings.snr_set_point,
            snr_scale_db: settings.snr_scale_db,
            top_speed_mps,
            delta_t: settings.delta_t,
            last_sensed_s: None,
        }
    }

    /// Returns the wake-up time after an SSB; `None` after the first SSB, which has no preceding
    /// interval.
    ///
    /// # Errors
    /// Errors of the localizer.
    pub fn sense(
        &mut self,
        now: &Situation<'_>,
        ssb: &SsbDetection,
        head: &RadioHead,
    ) -> Result<Option<f64>, BoxError> {
        let interval_s = self.last_sensed_s.map(|last_s| now.time_s - last_s);
        if interval_s.is_some_and(|interval_s| interval_s <= 0.0) {
            return Ok(None); // late: the clock stays where it is
        }
        self.last_sensed_s = Some(now.time_s);
        let Some(interval_s) = interval_s else {
            return Ok(None);
        };
        let delta_t = match self.delta_t {
            DeltaT::Seconds => interval_s,
            DeltaT::Steps => 1.0,
        };
        let snr_error = now.snr_shortfall_db(self.set_point, ssb, head)? / self.snr_scale_db;
        let velocity_error = (self.top_speed_mps - now.speed_mps) / self.top_speed_mps;
        let pid = &mut self.pid;
        Ok(Some(pid.calculate_wake_up_time(
            snr_error,
            velocity_error,
            delta_t,
        )))
    }
}
