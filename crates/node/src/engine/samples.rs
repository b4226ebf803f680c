//! Processing of samples: the receiver gets every block, and the pipeline processes the SSBs at the
//! end of a window or period. Samples between windows are dropped.

use std::time::{Duration, Instant};

use num_complex::Complex32;
use onboard::live::{Continuity, LiveError};
use onboard::observation::MAX_ELEMENTS;

use super::{ARRIVALS, Engine};
use crate::inbox::{Block, Inbox, Level};

impl Engine {
    pub(super) fn samples(
        &mut self,
        block: Block,
        came: Instant,
        inbox: &Inbox,
    ) -> Result<(), LiveError> {
        let end_s = block.time_s + block.length() as f64 / self.rate_hz();
        if block.offset_s.is_some() {
            self.live.set_time_offset_s(block.offset_s);
        }
        let offset_s = self.live.time_offset_s();
        self.clock.see(end_s + offset_s);
        self.watch_samples(came, end_s);
        if self.arrivals.len() == ARRIVALS {
            self.arrivals.pop_front();
        }
        self.arrivals.push_back((end_s + offset_s, came));
        let is_over = |[from_s, until_s]: [f64; 2]| end_s <= from_s || block.time_s >= until_s;
        if self.gate.wanted().is_some_and(is_over) {
            inbox.give_back(block.antennas); // arrived after the gate was closed
            return Ok(());
        }
        let block_s = block.time_s;
        let received = self.receive(&block);
        inbox.give_back(block.antennas);
        let start_s = match received {
            Ok(Continuity::Gap { .. } | Continuity::Restart) => {
                self.process_bursts(false, came)?;
                block_s
            }
            Ok(_) => self.window_s.unwrap_or(block_s),
            Err(error) => {
                self.refused("samples", &error);
                block_s
            }
        };
        self.window_s = Some(start_s);
        if self.gate.wanted().is_none() && end_s - start_s >= self.period_s {
            self.process_bursts(false, came)?;
            self.sleep_until_next(end_s)?;
            if self.gate.wanted().is_some() {
                // Flush the receiver's delayed SSBs; otherwise they are processed with the next
                // window.
                self.process_bursts(true, came)?;
            }
        }
        Ok(())
    }

    /// Opens the gate after an interruption, because the next SSB may come at any time, and reports samples
    /// that are missing.
    pub(super) fn watch_samples(&mut self, came: Instant, end_s: f64) {
        let odometry_s = self.live.onboard().newest_odometry().map(|it| it.time_s);
        let arrival = self.interruptions.samples(came, end_s, odometry_s);
        if arrival.resumed {
            self.live.samples_resumed();
            self.gate.open();
        }
        if let Some(missing_s) = arrival.missing_s {
            let periods = (missing_s / self.period_s).floor();
            let before_s = self.live.time_offset_s();
            self.live.add_interruption(periods * self.period_s);
            // If arrival times are measured, the source has already reported the missing samples.
            if self.live.time_offset_s() > before_s {
                let text = format!("samples of {missing_s:.2} s are missing");
                self.event(Level::Warn, "samples", text);
            }
        }
        let gaps = self.live.stream_counts().inferred_gaps;
        if std::mem::replace(&mut self.unreported_gaps, gaps) < gaps
            && !self.interruptions.is_recent(came)
        {
            let text =
                "samples are missing: the SSBs are not at multiples of their period".to_owned();
            self.event(Level::Warn, "samples", text);
        }
    }

    pub(super) fn rate_hz(&self) -> f64 {
        self.setup.stream.map_or(1.0, |it| it.rate_hz)
    }

    /// Passes samples to the receiver.
    fn receive(&mut self, block: &Block) -> Result<Continuity, LiveError> {
        let mut antennas: [&[Complex32]; MAX_ELEMENTS] = [&[]; MAX_ELEMENTS];
        for (antenna, samples) in antennas.iter_mut().zip(&block.antennas) {
            *antenna = samples;
        }
        let antennas = antennas.get(..block.antennas.len()).unwrap_or_default();
        self.live.receive(block.time_s, antennas)
    }

    /// Processes the received SSBs and publishes the results. `ends`: the window has ended, so that
    /// no further SSB is expected.
    pub(super) fn process_bursts(
        &mut self,
        ends: bool,
        came: impl Into<Option<Instant>>,
    ) -> Result<(), LiveError> {
        self.window_s = None;
        if ends && let Err(error) = self.live.end_segment() {
            self.refused("samples", &error);
        }
        self.live.process_until(f64::INFINITY)?;
        if let Some(error) = self.live.take_refused_burst() {
            self.refused("samples", &error);
            // All samples are required to detect a clock step as early as possible.
            self.gate.open();
        }
        self.report_clocks();
        self.publish_angles(came.into())
    }

    /// Closes the gate until the next required burst.
    pub(super) fn sleep_until_next(&mut self, now_s: f64) -> Result<(), LiveError> {
        if !self.sleeps {
            return Ok(());
        }
        let mut burst_s = self.live.next_wake_up_s(now_s)?;
        let Some(ssb_index) = self.live.last_ssb_index().filter(|_| burst_s > now_s) else {
            self.gate.open();
            return Ok(());
        };
        let offset_s = self.live.time_offset_s();
        let mut window = self.windows.around(burst_s, ssb_index);
        if window[0] < now_s {
            // The window has partly passed; take the next burst.
            burst_s = self.live.next_wake_up_s(burst_s)?;
            window = self.windows.around(burst_s, ssb_index);
        }
        if window[0] < now_s {
            self.gate.open();
        } else if self.live.listens(burst_s + offset_s)? {
            self.gate.set(window);
        } else {
            // No burst is required in the near future: query again at this time, without reception.
            self.gate.set([window[0]; 2]);
        }
        Ok(())
    }

    /// Returns the arrival time of a sample, assuming that samples arrive one by one.
    pub(super) fn arrival_of(&self, time_s: f64) -> Option<Instant> {
        let (end_s, came) = self.arrivals.iter().find(|(end_s, _)| *end_s >= time_s)?;
        came.checked_sub(Duration::try_from_secs_f64(end_s - time_s).ok()?)
    }
}
