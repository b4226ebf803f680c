//! Clock of a source, converted to the time of the pipeline, which never decreases.

use super::time_check::{MAX_LEAD_S, TimeCheck, TimeDefect, TimeVerdict};

/// Detected and compensated step of a source's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockStep {
    /// New time minus the time of the previous clock, in seconds.
    pub step_s: f64,
    /// Time since the last accepted message, in seconds.
    pub elapsed_s: f64,
}

/// Clock of one source.
#[derive(Debug, Clone, Default)]
pub struct TimeBase {
    check: TimeCheck,
    /// Time of the source minus that of the pipeline, in seconds; 0 until the clock steps.
    pub offset_s: f64,
}

impl TimeBase {
    /// Creates the clock of a source without messages, with a known offset.
    pub fn with_offset(offset_s: f64) -> Self {
        Self {
            check: TimeCheck::default(),
            offset_s,
        }
    }

    /// Returns the time of the pipeline for a time of the source, in seconds.
    pub fn inside(&self, time_s: f64) -> f64 {
        time_s - self.offset_s
    }

    /// Returns the time of the source for a time of the pipeline, in seconds.
    pub fn outside(&self, time_s: f64) -> f64 {
        time_s + self.offset_s
    }

    /// Returns the time of the last accepted message by the source's clock, in seconds.
    pub fn last_s(&self) -> Option<f64> {
        self.check.last_s()
    }

    /// Returns the time since the last accepted message by arrival times, in seconds.
    pub fn waited_s(&self, arrival_s: Option<f64>) -> Option<f64> {
        self.check.waited_s(arrival_s)
    }

    /// Validates the time of the next message like [`TimeCheck::next`], and compensates a step of
    /// the clock.
    ///
    /// # Errors
    /// Cause of a rejection.
    pub fn next(
        &mut self,
        time_s: f64,
        arrival_s: Option<f64>,
        is_copy: bool,
    ) -> Result<Option<ClockStep>, TimeDefect> {
        // A clock that was set back may be corrected, so that it leads by that step.
        let max_lead_s = if self.offset_s < 0.0 {
            MAX_LEAD_S.min(0.5 * self.offset_s.abs())
        } else {
            MAX_LEAD_S
        };
        let verdict = self.check.next(time_s, arrival_s, is_copy, max_lead_s)?;
        Ok(self.follow(verdict))
    }

    /// Processes a time that may be late, like [`TimeCheck::late`], and compensates a step of the clock.
    ///
    /// # Errors
    /// Cause of a rejection.
    pub fn late(
        &mut self,
        time_s: f64,
        arrival_s: Option<f64>,
    ) -> Result<Option<ClockStep>, TimeDefect> {
        let verdict = self.check.late(time_s, arrival_s)?;
        Ok(self.follow(verdict))
    }

    fn follow(&mut self, verdict: TimeVerdict) -> Option<ClockStep> {
        let TimeVerdict::NewBase { elapsed_s, step_s } = verdict else {
            return None;
        };
        self.offset_s += step_s;
        Some(ClockStep { step_s, elapsed_s })
    }
}
