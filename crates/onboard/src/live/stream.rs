//! The samples of a stream as bursts of SSBs.

use nr_ssb::front_end::FrontEnd;
use num_complex::Complex32;

use super::error::LiveError;
use super::stream_clock::{Continuity, StreamClock};
use crate::burst::OfSsb;
use crate::observation::{BURST_S, MAX_ELEMENTS, SsbObservation};
use crate::receive::{ReceiveError, Receiver, ReceiverConfig, SSB_SAMPLES, Window};

/// What a stream of samples is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamConfig {
    /// Samples per second and antenna.
    pub rate_hz: f64,
    /// Absolute frequency that stands at 0 Hz in the samples, Hz.
    pub centre_hz: f64,
}

/// What has come of a stream of samples since its start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StreamCounts {
    /// Samples taken in, in seconds.
    pub taken_s: f64,
    /// Gaps ...
    pub gaps: u64,
    /// ... and their length together, in seconds.
    pub lost_s: f64,
    /// Blocks that began before the last one ended.
    pub overlaps: u64,
    /// Streams that began anew.
    pub restarts: u64,
}

/// Receiver of a stream, and the observations that are not yet of a whole burst.
pub struct SampleStream {
    clock: StreamClock,
    front_end: FrontEnd,
    receiver: Receiver,
    /// Samples at the base rate not yet looked at, per antenna, and the number of the first.
    base: Vec<Vec<Complex32>>,
    base_start: u64,
    /// In order of time: `held` of them, the others are memory.
    observations: Vec<SsbObservation>,
    held: usize,
    /// Until when all samples were looked at; infinite where a stretch of them has ended.
    heard_until_s: f64,
    /// What has come.
    pub counts: StreamCounts,
}

impl SampleStream {
    /// Before the first sample.
    pub fn new(config: StreamConfig, receiver: ReceiverConfig) -> Result<Self, LiveError> {
        let StreamConfig { rate_hz, centre_hz } = config;
        let (ssb_freq_hz, spacing) = (receiver.ssb_freq_hz, receiver.spacing);
        let elements: usize = receiver.array.elements.into();
        let offset_hz = ssb_freq_hz - centre_hz;
        Ok(Self {
            clock: StreamClock::new(rate_hz),
            front_end: FrontEnd::new(rate_hz, offset_hz, spacing.hz(), elements)?,
            receiver: Receiver::new(receiver)?,
            base: vec![Vec::new(); elements],
            base_start: 0,
            observations: Vec::new(),
            held: 0,
            heard_until_s: f64::NEG_INFINITY,
            counts: StreamCounts::default(),
        })
    }

    /// Beams that are tracked.
    pub fn tracked(&self) -> usize {
        self.receiver.tracked()
    }

    /// Time of the first sample that has not come.
    pub fn next_s(&self) -> Option<f64> {
        (self.counts.taken_s > 0.0).then(|| self.clock.time_s(self.clock.next() as f64))
    }

    /// Takes in the next samples of every antenna; `ends` says that none follow them without a gap.
    pub fn push(
        &mut self,
        time_s: f64,
        antennas: &[&[Complex32]],
        ends: bool,
    ) -> Result<Continuity, LiveError> {
        let elements = self.base.len();
        let found = antennas.len();
        if found != elements {
            return Err(ReceiveError::Antennas { found, elements }.into());
        }
        let length = antennas.first().map_or(0, |samples| samples.len());
        if let Some(other) = antennas.iter().find(|samples| samples.len() != length) {
            let (first, other) = (length, other.len());
            return Err(nr_ssb::front_end::FrontEndError::UnequalLengths { first, other }.into());
        }
        let (continuity, left_out) = self.clock.block(time_s, length);
        match continuity {
            Continuity::First | Continuity::Contiguous => {}
            Continuity::Overlap { .. } => self.counts.overlaps += 1,
            Continuity::Gap { lost_s } => {
                (self.counts.gaps, self.counts.lost_s) =
                    (self.counts.gaps + 1, self.counts.lost_s + lost_s);
                self.break_off()?;
                self.base_start = self.base_number(self.clock.next() - length as u64);
            }
            Continuity::Restart => {
                self.counts.restarts += 1;
                self.reset()?;
            }
        }
        let mut new: [&[Complex32]; MAX_ELEMENTS] = [&[]; MAX_ELEMENTS];
        for (new, samples) in new.iter_mut().zip(antennas) {
            *new = samples.get(left_out..).unwrap_or_default();
        }
        let new = new.get(..elements).unwrap_or_default();
        self.counts.taken_s += (length - left_out) as f64 / self.clock.rate_hz();
        self.front_end.push(new, &mut self.base)?;
        if ends {
            self.break_off()?;
        } else {
            self.receive()?;
        }
        Ok(continuity)
    }

    /// Ends a stretch of samples: what is held back is looked at, and nothing goes on from it.
    pub fn break_off(&mut self) -> Result<(), LiveError> {
        self.front_end.finish(&mut self.base);
        self.receive()?;
        let length = self.base.first().map_or(0, Vec::len) as u64;
        self.base_start += length;
        self.base.iter_mut().for_each(Vec::clear);
        self.heard_until_s = f64::INFINITY;
        Ok(())
    }

    /// Forgets cells and samples, for a stream that begins anew.
    fn reset(&mut self) -> Result<(), LiveError> {
        self.break_off()?;
        self.receiver = Receiver::new(self.receiver.config().clone())?;
        (self.base_start, self.heard_until_s) = (0, f64::NEG_INFINITY);
        Ok(())
    }

    fn base_number(&self, sample: u64) -> u64 {
        (sample as f64 / self.front_end.input_per_output()).round() as u64
    }

    fn receive(&mut self) -> Result<(), LiveError> {
        let length = self.base.first().map_or(0, Vec::len);
        if length == 0 {
            return Ok(());
        }
        let mut antennas: [&[Complex32]; MAX_ELEMENTS] = [&[]; MAX_ELEMENTS];
        for (antenna, samples) in antennas.iter_mut().zip(&self.base) {
            *antenna = samples;
        }
        let ratio = self.front_end.input_per_output();
        let start_s = self.clock.time_s(self.base_start as f64 * ratio);
        let window = Window {
            start: self.base_start,
            time_s: start_s,
            antennas: antennas.get(..self.base.len()).unwrap_or_default(),
        };
        let (observations, held) = (&mut self.observations, &mut self.held);
        let first_new = *held;
        self.receiver.receive(&window, |observation| {
            match observations.get_mut(*held) {
                Some(room) => room.copy_from(observation),
                None => observations.push(observation.clone()),
            }
            *held += 1;
        })?;
        let by_time =
            |a: &SsbObservation, b: &SsbObservation| a.ssb.time_s.total_cmp(&b.ssb.time_s);
        if let Some(new) = self.observations.get_mut(first_new..self.held) {
            new.sort_unstable_by(by_time);
        }
        let gone = length.saturating_sub(2 * SSB_SAMPLES);
        for samples in &mut self.base {
            samples.drain(..gone);
        }
        self.base_start += gone as u64;
        self.heard_until_s = self.clock.time_s(self.base_start as f64 * ratio);
        Ok(())
    }

    /// SSBs of the first burst, if no more of it can come.
    pub fn burst(&self) -> &[SsbObservation] {
        let held = self.observations.get(..self.held).unwrap_or_default();
        match held.first() {
            Some(first) if first.ssb().time_s + BURST_S <= self.heard_until_s => {
                let number = crate::burst::first_burst(held);
                held.get(..number).unwrap_or_default()
            }
            _ => &[],
        }
    }

    /// Forgets the first SSBs.
    pub fn forget(&mut self, number: usize) {
        let number = number.min(self.held);
        if let Some(held) = self.observations.get_mut(..self.held) {
            held.rotate_left(number);
        }
        self.held -= number;
    }
}
