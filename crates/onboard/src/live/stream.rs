//! Bursts of SSBs from a stream of samples.

use nr_ssb::Tone;
use nr_ssb::front_end::FrontEndError;
use nr_ssb::receiver::ReceiverError;
use num_complex::Complex32;

use super::error::LiveError;
use super::stream_clock::{Continuity, StreamClock};
use crate::burst::first_burst;
use crate::observation::{BURST_S, MAX_ELEMENTS, SsbObservation};
use crate::receive::{ReceiveError, ReceiverConfig, StreamReceiver, stream_receiver};

/// Configuration of a sample stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamConfig {
    /// Sample rate, in samples per second and antenna.
    pub rate_hz: f64,
    /// Absolute frequency at 0 Hz of the samples, in Hz.
    pub centre_hz: f64,
}

/// Counts of a sample stream since its start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StreamCounts {
    /// Duration of the processed samples, in seconds.
    pub taken_s: f64,
    /// Number of gaps between the times of the blocks. Gaps after a segment that the caller ended
    /// are not counted.
    pub gaps: u64,
    /// Total duration of these gaps, in seconds.
    pub lost_s: f64,
    /// Number of gaps without a step of the block times, inferred from the times of the SSBs.
    pub inferred_gaps: u64,
    /// Total duration of the inferred gaps modulo the SSB period, in seconds. Subsequent times are
    /// corrected by this duration.
    pub unreported_gap_s: f64,
    /// Number of blocks that began before the end of the previous one.
    pub overlaps: u64,
    /// Number of restarted streams.
    pub restarts: u64,
    /// Number of SSBs detected by a search; all others were received at their expected time.
    pub found: u64,
}

/// Receiver of a stream, with the observations of an incomplete burst.
pub struct SampleStream {
    clock: StreamClock,
    offset: TimeOffset,
    receiver: Box<dyn StreamReceiver>,
    elements: usize,
    bursts: Bursts,
    counts: StreamCounts,
    /// Whether the caller ended the last segment, so that the following gap is deliberate.
    is_stretch_ended: bool,
}

/// Time minus sample time.
#[derive(Debug, Clone, Copy, Default)]
struct TimeOffset {
    /// Duration of unreported missing samples before the newest SSB, in seconds.
    unreported_gap_s: f64,
    inferred_gaps: u64,
    /// Offset in seconds, if the caller measures it; it replaces the gaps and interruptions.
    measured_s: Option<f64>,
    /// Interruptions that the caller reported, in seconds.
    interrupted_s: f64,
}

impl TimeOffset {
    /// Returns time minus sample time, in seconds.
    fn value_s(&self) -> f64 {
        self.measured_s
            .unwrap_or(self.unreported_gap_s + self.interrupted_s)
    }

    /// Records the duration of unreported missing samples in seconds, and returns the offset.
    fn with_gap(&mut self, unreported_gap_s: f64) -> f64 {
        if unreported_gap_s != self.unreported_gap_s {
            self.unreported_gap_s = unreported_gap_s;
            self.inferred_gaps += 1;
        }
        self.value_s()
    }
}

/// Observations in order of time; the first `held` are valid, the others are reusable memory.
#[derive(Default)]
struct Bursts {
    observations: Vec<SsbObservation>,
    held: usize,
    /// Time before which all SSBs are complete; infinite after the end of a segment.
    passed_until_s: f64,
}

impl Bursts {
    fn take(&mut self, observation: &SsbObservation) {
        match self.observations.get_mut(self.held) {
            Some(room) => room.copy_from(observation),
            None => self.observations.push(observation.clone()),
        }
        self.held += 1;
    }
}

impl SampleStream {
    /// Creates a stream without samples.
    ///
    /// # Errors
    /// [`LiveError::Receive`] for an invalid rate, frequency or array.
    pub fn new(config: StreamConfig, receiver: ReceiverConfig) -> Result<Self, LiveError> {
        let StreamConfig { rate_hz, centre_hz } = config;
        Ok(Self {
            clock: StreamClock::new(rate_hz),
            elements: receiver.array.elements.into(),
            receiver: stream_receiver(receiver, rate_hz, centre_hz)?,
            offset: TimeOffset::default(),
            bursts: Bursts::default(),
            counts: StreamCounts::default(),
            is_stretch_ended: false,
        })
    }

    /// Returns the number of tracked SSBs.
    pub fn tracked(&self) -> usize {
        self.receiver.tracked()
    }

    /// Returns tone number `index` of those that are subtracted, the strongest first, at its absolute frequency.
    pub fn tone(&self, index: usize) -> Option<Tone> {
        self.receiver.tone(index)
    }

    /// Returns the counts.
    pub fn counts(&self) -> StreamCounts {
        StreamCounts {
            inferred_gaps: self.offset.inferred_gaps,
            unreported_gap_s: self.offset.unreported_gap_s,
            found: self.receiver.found(),
            ..self.counts
        }
    }

    /// Returns the time of the next expected sample.
    pub fn next_s(&self) -> Option<f64> {
        let next_s = || self.clock.time_s(self.clock.next() as f64) + self.correction_s();
        (self.counts.taken_s > 0.0).then(next_s)
    }

    /// Returns time minus sample time in seconds: the offset measured by the caller, otherwise the
    /// unreported gaps.
    pub fn correction_s(&self) -> f64 {
        self.offset.value_s()
    }

    /// Sets time minus sample time in seconds, for a caller that counts samples and measures their
    /// arrival. It replaces the unreported gaps, which are known modulo the SSB period only.
    pub const fn set_offset_s(&mut self, offset_s: Option<f64>) {
        self.offset.measured_s = offset_s;
    }

    /// Adds an interruption in seconds that the times of the samples do not report.
    pub fn add_interruption(&mut self, lost_s: f64) {
        self.offset.interrupted_s += lost_s;
    }

    /// Processes the next samples of every antenna; `time_s` is the reception time of the first
    /// one.
    ///
    /// # Errors
    /// [`LiveError::Receive`] for a wrong number of antennas or unequal lengths.
    pub fn push(
        &mut self,
        time_s: f64,
        antennas: &[&[Complex32]],
    ) -> Result<Continuity, LiveError> {
        let (found, elements) = (antennas.len(), self.elements);
        if found != elements {
            return Err(ReceiveError::Antennas { found, elements }.into());
        }
        let length = antennas.first().map_or(0, |samples| samples.len());
        if let Some(other) = antennas.iter().find(|samples| samples.len() != length) {
            let (first, other) = (length, other.len());
            let error = ReceiverError::FrontEnd(FrontEndError::UnequalLengths { first, other });
            return Err(ReceiveError::from(error).into());
        }
        let before = self.clock.clone();
        let (continuity, left_out) = self.clock.block(time_s, length);
        match continuity {
            Continuity::First | Continuity::Contiguous => {}
            Continuity::Overlap { .. } => self.counts.overlaps += 1,
            Continuity::Gap { lost_s } => {
                if !self.is_stretch_ended {
                    self.counts.gaps += 1;
                    self.counts.lost_s += lost_s;
                }
                self.gap_to(self.clock.next() - length as u64, &before)?;
            }
            Continuity::Restart => {
                self.counts.restarts += 1;
                self.gap_to(before.next(), &before)?;
                self.receiver.reset();
            }
        }
        self.is_stretch_ended = false;
        let mut new: [&[Complex32]; MAX_ELEMENTS] = [&[]; MAX_ELEMENTS];
        for (new, samples) in new.iter_mut().zip(antennas) {
            *new = samples.get(left_out..).unwrap_or_default();
        }
        let new = new.get(..elements).unwrap_or_default();
        self.counts.taken_s += (length - left_out) as f64 / self.clock.rate_hz();
        let Self {
            clock,
            offset,
            receiver,
            bursts,
            ..
        } = self;
        let mut time_s = |sample, gap_s| clock.time_s(sample) + offset.with_gap(gap_s);
        receiver.push(new, &mut time_s, &mut |it| bursts.take(it))?;
        bursts.passed_until_s = clock.time_s(receiver.passed_until()) + offset.value_s();
        Ok(continuity)
    }

    /// Processes all pending samples before a gap.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn break_off(&mut self) -> Result<(), LiveError> {
        self.gap_to(self.clock.next(), &self.clock.clone())?;
        self.bursts.passed_until_s = f64::INFINITY;
        self.is_stretch_ended = true;
        Ok(())
    }

    fn gap_to(&mut self, sample: u64, clock: &StreamClock) -> Result<(), LiveError> {
        let (offset, bursts) = (&mut self.offset, &mut self.bursts);
        let mut time_s = |sample, gap_s| clock.time_s(sample) + offset.with_gap(gap_s);
        (self.receiver).gap_to(sample, &mut time_s, &mut |it| bursts.take(it))?;
        Ok(())
    }

    /// Returns the SSBs of the first burst, if it is complete.
    pub fn burst(&self) -> &[SsbObservation] {
        let held = self.bursts.observations.get(..self.bursts.held);
        let held = held.unwrap_or_default();
        match held.first() {
            Some(first) if first.ssb.time_s + BURST_S <= self.bursts.passed_until_s => {
                let number = first_burst(held);
                let alone = held.iter().take(number).position(|it| it.is_first);
                let number = alone.map_or(number, |place| place.max(1));
                held.get(..number).unwrap_or_default()
            }
            _ => &[],
        }
    }

    /// Returns the first SSBs.
    pub fn first(&self, number: usize) -> &[SsbObservation] {
        let number = number.min(self.bursts.held);
        self.bursts.observations.get(..number).unwrap_or_default()
    }

    /// Adds `by_s` seconds to the times of the first SSBs.
    pub fn shift(&mut self, number: usize, by_s: f64) {
        let number = number.min(self.bursts.held);
        for observation in self.bursts.observations.iter_mut().take(number) {
            observation.ssb.time_s += by_s;
        }
    }

    /// Removes the first SSBs.
    pub fn forget(&mut self, number: usize) {
        let number = number.min(self.bursts.held);
        if let Some(held) = self.bursts.observations.get_mut(..self.bursts.held) {
            held.rotate_left(number);
        }
        self.bursts.held -= number;
    }
}
