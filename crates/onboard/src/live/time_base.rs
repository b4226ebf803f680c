//! The clock of a source, expressed in the time of the pipeline, which never goes back.

use super::time_check::{TimeCheck, TimeDefect, TimeVerdict};

/// Step of a source's clock that was recognized and compensated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockStep {
    /// New time minus the time that the earlier clock would show, in seconds.
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
    /// The clock of a source without messages yet, whose offset is known.
    pub fn with_offset(offset_s: f64) -> Self {
        Self {
            check: TimeCheck::default(),
            offset_s,
        }
    }

    /// Time of the pipeline for a time of the source, in seconds.
    pub fn inside(&self, time_s: f64) -> f64 {
        time_s - self.offset_s
    }

    /// Time of the source for a time of the pipeline, in seconds.
    pub fn outside(&self, time_s: f64) -> f64 {
        time_s + self.offset_s
    }

    /// Time of the last accepted message by the source's clock, in seconds.
    pub fn last_s(&self) -> Option<f64> {
        self.check.last_s()
    }

    /// Time since the last accepted message by the arrivals, in seconds.
    pub fn waited_s(&self, arrival_s: Option<f64>) -> Option<f64> {
        self.check.waited_s(arrival_s)
    }

    /// Validates the time of the next message, as [`TimeCheck::next`]; a step of the clock is compensated.
    ///
    /// # Errors
    /// The cause of a rejection.
    pub fn next(
        &mut self,
        time_s: f64,
        arrival_s: Option<f64>,
        is_copy: bool,
    ) -> Result<Option<ClockStep>, TimeDefect> {
        match self.check.next(time_s, arrival_s, is_copy)? {
            TimeVerdict::Continues => Ok(None),
            TimeVerdict::NewBase { elapsed_s, step_s } => {
                self.offset_s += step_s;
                Ok(Some(ClockStep { step_s, elapsed_s }))
            }
        }
    }
}
