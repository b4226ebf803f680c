//! Times at which the receiver must be on.

use super::{Live, finite};
use crate::live::{LiveError, SampleStream};

/// Look-ahead of the next wake-up (s).
const LOOK_AHEAD_S: f64 = 1.0;

/// Maximum time since the last SSB for which its time determines the reception windows, in seconds.
/// A segment of samples without an SSB after this time means that the windows may be misplaced.
const SSB_SILENT_S: f64 = 1.0;

impl Live {
    /// Whether the current policy and monitors request the burst at `time_s`.
    ///
    /// # Errors
    /// [`LiveError::Custom`] for errors of a custom policy.
    pub fn listens(&mut self, time_s: f64) -> Result<bool, LiveError> {
        finite("the time of a burst", time_s)?;
        let time_s = self.clocks.angles.inside(time_s);
        self.onboard.listens(time_s).map_err(LiveError::Custom)
    }

    /// Returns the next time after `now_s` at which the receiver must be on: the start of the next
    /// requested burst, for constant motion. If none is within a second, it is the time of the next
    /// query. It is `now_s` itself while no SSB is known, during a search, after
    /// [`samples_resumed`](Self::samples_resumed), and after a second of samples without an SSB.
    /// Both are sample times, without [`time_offset_s`](Self::time_offset_s).
    ///
    /// # Errors
    /// Those of [`listens`](Self::listens).
    pub fn next_wake_up_s(&mut self, now_s: f64) -> Result<f64, LiveError> {
        finite("the time of a wake-up", now_s)?;
        let untracked = self.stream.as_ref().is_some_and(|it| it.tracked() == 0);
        let is_searching = self.onboard.searching().is_some() || self.onboard.is_lost();
        let is_silent = |last_s: f64| self.empty_stretches > 0 && now_s - last_s >= SSB_SILENT_S;
        let is_open = untracked || is_searching || self.is_resuming;
        let last_burst = self
            .last_burst
            .filter(|(last_s, _)| !is_open && !is_silent(*last_s));
        let Some((last_s, _)) = last_burst else {
            return Ok(now_s);
        };
        let offset_s = self.time_offset_s();
        let period_s = self.site.ssb.period_s();
        let first = ((now_s - last_s) / period_s).floor() + 1.0;
        let mut burst_s = last_s + first * period_s;
        let mut ahead = 1.0;
        while burst_s < now_s + LOOK_AHEAD_S && !self.listens(burst_s + offset_s)? {
            burst_s = last_s + (first + ahead) * period_s;
            ahead += 1.0;
        }
        Ok(burst_s)
    }

    /// Returns time minus sample time in seconds: as set by
    /// [`set_time_offset_s`](Self::set_time_offset_s), otherwise the unreported gaps of the
    /// samples.
    pub fn time_offset_s(&self) -> f64 {
        (self.stream.as_ref()).map_or(0.0, SampleStream::correction_s)
    }

    /// Sets time minus sample time in seconds, for a caller that counts samples and measures their
    /// arrival: the count keeps the times of SSBs exact while the offset may drift or step. With
    /// `None`, the SSBs determine it.
    pub const fn set_time_offset_s(&mut self, offset_s: Option<f64>) {
        if let Some(stream) = &mut self.stream {
            stream.set_offset_s(offset_s);
        }
    }

    /// Adds an interruption of the samples in seconds that their times do not report: whole SSB
    /// periods, because the SSBs determine the rest.
    pub fn add_interruption(&mut self, lost_s: f64) {
        if let Some(stream) = &mut self.stream {
            stream.add_interruption(lost_s);
        }
    }

    /// Records that samples resumed after an interruption of unknown length:
    /// [`next_wake_up_s`](Self::next_wake_up_s) requests every sample until an SSB is received.
    pub const fn samples_resumed(&mut self) {
        self.is_resuming = true;
    }

    /// Returns the index of the first SSB of the last burst, the reference of
    /// [`next_wake_up_s`](Self::next_wake_up_s).
    pub fn last_ssb_index(&self) -> Option<u8> {
        self.last_burst.map(|(_, ssb_index)| ssb_index)
    }
}
