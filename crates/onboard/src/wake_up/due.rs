//! When the next estimate is due.

use super::controller::Controller;
use super::policy::{SAME_TIME_S, Situation};
use crate::BoxError;
use crate::observation::SensedSsb;
use crate::radio_head::RadioHead;
use crate::settings::SensingMode;

/// So long after the last estimate as Algorithm 1, or a constant, says.
#[derive(Debug)]
pub struct Due {
    controller: Option<Controller>,
    sensing: SensingMode,
    wake_up_time_s: f64,
    last_estimate_s: Option<f64>,
}

impl Due {
    /// A constant wake-up time.
    pub const fn constant(wake_up_time_s: f64) -> Self {
        Self {
            controller: None,
            sensing: SensingMode::WakeUp,
            wake_up_time_s,
            last_estimate_s: None,
        }
    }

    /// What a controller says of the SSBs that are sensed.
    pub const fn controlled(controller: Controller, sensing: SensingMode) -> Self {
        Self {
            controller: Some(controller),
            sensing,
            wake_up_time_s: 0.0,
            last_estimate_s: None,
        }
    }

    /// The wake-up time in force, in seconds.
    pub const fn wake_up_time_s(&self) -> f64 {
        self.wake_up_time_s
    }

    /// Whether the receiver is to listen: always, or from the wake-up time on.
    pub fn listens(&self, time_s: f64) -> bool {
        self.sensing == SensingMode::EverySsb || self.is_due(time_s)
    }

    /// Takes in an SSB and says whether an estimate is due.
    ///
    /// # Errors
    /// Whatever the localizer fails with.
    pub fn sense(
        &mut self,
        now: &Situation<'_>,
        ssb: &SensedSsb,
        head: &RadioHead,
    ) -> Result<bool, BoxError> {
        // Asleep until due, the controller learns of this SSB only once it is awake.
        let due_before = self.is_due(now.time_s);
        if let Some(controller) = &mut self.controller
            && let Some(wake_up_time_s) = controller.sense(now, ssb, head)?
        {
            self.wake_up_time_s = wake_up_time_s;
        }
        Ok(match self.sensing {
            SensingMode::EverySsb => self.is_due(now.time_s),
            SensingMode::WakeUp => due_before,
        })
    }

    /// Notes that an angle is estimated.
    pub const fn estimated(&mut self, time_s: f64) {
        self.last_estimate_s = Some(time_s);
    }

    /// Whether so much time has passed since the last estimate, or there was none.
    pub fn has_passed(&self, time_s: f64, interval_s: f64) -> bool {
        self.last_estimate_s
            .is_none_or(|last_s| time_s - last_s + SAME_TIME_S >= interval_s)
    }

    fn is_due(&self, time_s: f64) -> bool {
        self.has_passed(time_s, self.wake_up_time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_time_passes_from_the_last_estimate_on() {
        let mut due = Due::constant(0.08);
        assert!(due.listens(0.0), "there was no estimate yet");
        due.estimated(0.02);
        assert!(!due.listens(0.08) && due.listens(0.1));
        assert!(due.has_passed(0.26, 0.24) && !due.has_passed(0.24, 0.24));
    }

    #[test]
    fn a_controller_that_senses_every_ssb_keeps_the_receiver_on() {
        let settings = crate::settings::PidSettings::default();
        let mut due = Due::controlled(Controller::new(&settings, 0.08, 4.0), SensingMode::EverySsb);
        due.estimated(1.0);
        assert!(due.listens(1.02));
    }
}
