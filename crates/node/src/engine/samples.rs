//! Processing of samples: complete windows are given to the pipeline, and samples between windows
//! are dropped.

use std::time::{Duration, Instant};

use num_complex::Complex32;
use onboard::live::LiveError;
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
        if self.pending.length() > 0 && !self.pending.continues_in(&block, self.rate_hz()) {
            self.receive(true)?;
            self.publish_angles(Some(came))?;
        }
        self.pending.append(&block);
        inbox.give_back(block.antennas);
        if self.gate.wanted().is_none() && end_s - self.pending.time_s >= self.period_s {
            self.receive(false)?;
            self.publish_angles(Some(came))?;
            self.sleep_until_next(end_s)?;
            if self.gate.wanted().is_some() {
                // Flush the receiver's delayed SSBs; otherwise they are processed with the next
                // window.
                self.receive(true)?;
                self.publish_angles(Some(came))?;
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

    /// Gives the samples of a window or a period to the pipeline in one block, because a cell
    /// search requires a complete burst.
    pub(super) fn receive(&mut self, ends: bool) -> Result<(), LiveError> {
        let mut antennas: [&[Complex32]; MAX_ELEMENTS] = [&[]; MAX_ELEMENTS];
        for (antenna, samples) in antennas.iter_mut().zip(&self.pending.antennas) {
            *antenna = samples;
        }
        let antennas = antennas
            .get(..self.pending.antennas.len())
            .unwrap_or_default();
        let mut taken = Ok(());
        if self.pending.length() > 0 {
            taken = self.live.receive(self.pending.time_s, antennas).map(drop);
        }
        if ends && taken.is_ok() {
            taken = self.live.end_segment();
        }
        self.pending.antennas.iter_mut().for_each(Vec::clear);
        if let Err(error) = taken {
            self.refused("samples", &error);
        }
        self.live.process_until(f64::INFINITY)?;
        if let Some(error) = self.live.take_refused_burst() {
            self.refused("samples", &error);
            // All samples are required to detect a clock step as early as possible.
            self.gate.open();
        }
        self.report_clocks();
        Ok(())
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
