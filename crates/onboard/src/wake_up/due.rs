//! Wake-up clock: time of the next estimate.

use super::controller::Controller;
use super::policy::{SAME_TIME_S, Situation};
use crate::BoxError;
use crate::observation::SsbDetection;
use crate::radio_head::RadioHead;
use crate::settings::SensingMode;

/// Wake-up clock: an estimate is due when a constant time, or that of Algorithm 1, has elapsed
/// since the previous one. All policies with a wake-up time share it.
#[derive(Debug)]
pub struct Due {
    controller: Option<Controller>,
    sensing: SensingMode,
    wake_up_time_s: f64,
    /// Maximum time by which an SSB may precede the due time, exclusive.
    lead_s: f64,
    last_estimate_s: Option<f64>,
}

impl Due {
    /// Creates a clock with a constant wake-up time. See
    /// [`SsbSelection`](crate::settings::SsbSelection) for `lead_s`.
    pub const fn constant(wake_up_time_s: f64, lead_s: f64) -> Self {
        Self {
            controller: None,
            sensing: SensingMode::WakeUp,
            wake_up_time_s,
            lead_s,
            last_estimate_s: None,
        }
    }

    /// Creates a clock whose wake-up time is the controller's output.
    pub const fn controlled(controller: Controller, sensing: SensingMode, lead_s: f64) -> Self {
        Self {
            controller: Some(controller),
            sensing,
            wake_up_time_s: 0.0,
            lead_s,
            last_estimate_s: None,
        }
    }

    /// Returns the current wake-up time in seconds.
    pub const fn wake_up_time_s(&self) -> f64 {
        self.wake_up_time_s
    }

    /// Whether the receiver is on: always, or once the wake-up time has elapsed.
    pub fn listens(&self, time_s: f64) -> bool {
        self.sensing == SensingMode::EverySsb || self.is_due(time_s)
    }

    /// Processes an SSB and returns whether an estimate is due.
    ///
    /// # Errors
    /// Errors of the localizer.
    pub fn sense(
        &mut self,
        now: &Situation<'_>,
        ssb: &SsbDetection,
        head: &RadioHead,
    ) -> Result<bool, BoxError> {
        // In sleep until due, the controller measures this SSB only after the wake-up.
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

    /// Records that an angle is estimated.
    pub const fn estimated(&mut self, time_s: f64) {
        self.last_estimate_s = Some(time_s);
    }

    /// Whether `interval_s` has elapsed since the previous estimate, or there was none.
    pub fn has_passed(&self, time_s: f64, interval_s: f64) -> bool {
        self.last_estimate_s
            .is_none_or(|last_s| time_s - last_s + SAME_TIME_S >= interval_s)
    }

    /// Whether an estimate is due at the SSB of `time_s`.
    pub fn is_due(&self, time_s: f64) -> bool {
        if self.lead_s > 0.0 {
            // The following SSB would be after the due time.
            let last_s = self.last_estimate_s.unwrap_or(f64::NEG_INFINITY);
            time_s - last_s + self.lead_s - SAME_TIME_S > self.wake_up_time_s
        } else {
            self.has_passed(time_s, self.wake_up_time_s)
        }
    }

    /// Returns the time of the previous estimate in seconds.
    pub const fn last_estimate_s(&self) -> Option<f64> {
        self.last_estimate_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_interval_starts_at_the_last_estimate() {
        let mut due = Due::constant(0.08, 0.0);
        assert!(due.listens(0.0), "there was no estimate yet");
        due.estimated(0.02);
        assert!(!due.listens(0.08) && due.listens(0.1));
        assert!(due.has_passed(0.26, 0.24) && !due.has_passed(0.24, 0.24));
    }

    #[test]
    fn the_last_ssb_before_a_wake_up_time_is_used_if_configured() {
        for (wake_up_time_s, served_s) in [(0.065, 0.06), (0.08, 0.08), (0.15, 0.14), (0.01, 0.02)]
        {
            let mut due = Due::constant(wake_up_time_s, 0.02);
            due.estimated(0.0);
            let first = (1..20)
                .map(|k| f64::from(k) * 0.02)
                .find(|&t| due.is_due(t));
            assert_eq!(first, Some(served_s));
        }
    }

    #[test]
    fn a_controller_that_senses_every_ssb_keeps_the_receiver_on() {
        let settings = crate::settings::PidSettings::default();
        let mut due = Due::controlled(
            Controller::new(&settings, 0.08, 4.0),
            SensingMode::EverySsb,
            0.0,
        );
        due.estimated(1.0);
        assert!(due.listens(1.02));
    }
}
