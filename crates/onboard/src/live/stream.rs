//! Bursts of SSBs from a stream of samples.

use nr_ssb::Tone;
use nr_ssb::front_end::FrontEndError;
use nr_ssb::receiver::{ReceivedBeam, Receiver, ReceiverError};
use num_complex::Complex32;

use super::error::LiveError;
use super::stream_clock::{Continuity, StreamClock};
use crate::burst::first_burst;
use crate::observation::{BURST_S, MAX_ELEMENTS, SsbObservation};
use crate::receive::{Observer, ReceiveError, ReceiverConfig};

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
    receiver: Receiver,
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
struct Bursts {
    observer: Observer,
    offset: TimeOffset,
    observations: Vec<SsbObservation>,
    held: usize,
    /// Time before which all SSBs are complete; infinite after the end of a segment.
    passed_until_s: f64,
}

impl Bursts {
    /// Appends the observation of a received SSB; `clock` determines its time.
    fn take(&mut self, mut beam: ReceivedBeam<'_>, clock: &StreamClock) {
        let offset_s = self.offset.with_gap(self.observer.unreported_gap_s(&beam));
        let time_s = clock.time_s(beam.ssb.sample_start * beam.input_per_output) + offset_s;
        if self.held == self.observations.len() {
            let elements = self.observer.config().array.elements;
            self.observations.push(SsbObservation::new(elements.into()));
        }
        if let Some(room) = self.observations.get_mut(self.held) {
            self.observer.observe(&mut beam, time_s, room);
            self.held += 1;
        }
    }
}

impl SampleStream {
    /// Creates a stream without samples.
    ///
    /// # Errors
    /// [`LiveError::Receive`] for an invalid rate, frequency or array.
    pub fn new(config: StreamConfig, receiver: ReceiverConfig) -> Result<Self, LiveError> {
        let StreamConfig { rate_hz, centre_hz } = config;
        let ssbs = Receiver::new(receiver.of_ssbs(), rate_hz, centre_hz);
        Ok(Self {
            clock: StreamClock::new(rate_hz),
            receiver: ssbs.map_err(ReceiveError::from)?,
            bursts: Bursts {
                observer: Observer::new(receiver)?,
                offset: TimeOffset::default(),
                observations: Vec::new(),
                held: 0,
                passed_until_s: 0.0,
            },
            counts: StreamCounts::default(),
            is_stretch_ended: false,
        })
    }

    /// Returns the number of tracked SSBs.
    pub fn tracked(&self) -> usize {
        self.receiver.windows().tracked()
    }

    /// Returns tone number `index` of those that are subtracted, the strongest first, at its absolute frequency.
    pub fn tone(&self, index: usize) -> Option<Tone> {
        let mut tone = self.receiver.windows().tones().nth(index)?;
        tone.frequency_hz += self.bursts.observer.config().ssb_freq_hz;
        Some(tone)
    }

    /// Returns the counts.
    pub fn counts(&self) -> StreamCounts {
        StreamCounts {
            inferred_gaps: self.bursts.offset.inferred_gaps,
            unreported_gap_s: self.bursts.offset.unreported_gap_s,
            found: self.bursts.observer.found(),
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
        self.bursts.offset.value_s()
    }

    /// Sets time minus sample time in seconds, for a caller that counts samples and measures their
    /// arrival. It replaces the unreported gaps, which are known modulo the SSB period only.
    pub const fn set_offset_s(&mut self, offset_s: Option<f64>) {
        self.bursts.offset.measured_s = offset_s;
    }

    /// Adds an interruption in seconds that the times of the samples do not report.
    pub fn add_interruption(&mut self, lost_s: f64) {
        self.bursts.offset.interrupted_s += lost_s;
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
        self.bursts
            .observer
            .config()
            .check_antennas(antennas.len())?;
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
            Continuity::Overlap => self.counts.overlaps += 1,
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
                self.bursts.observer.reset();
            }
        }
        self.is_stretch_ended = false;
        let mut new: [&[Complex32]; MAX_ELEMENTS] = [&[]; MAX_ELEMENTS];
        for (new, samples) in new.iter_mut().zip(antennas) {
            *new = samples.get(left_out..).unwrap_or_default();
        }
        let new = new.get(..antennas.len()).unwrap_or_default();
        self.counts.taken_s += (length - left_out) as f64 / self.clock.rate_hz();
        let (clock, receiver, bursts) = (&self.clock, &mut self.receiver, &mut self.bursts);
        let pushed = receiver.push(new, &mut |beam| bursts.take(beam, clock));
        pushed.map_err(ReceiveError::from)?;
        let passed = receiver.passed_until() * receiver.input_per_output();
        bursts.passed_until_s = clock.time_s(passed) + bursts.offset.value_s();
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
        let bursts = &mut self.bursts;
        let gap = (self.receiver).gap_to(sample, &mut |beam| bursts.take(beam, clock));
        Ok(gap.map_err(ReceiveError::from)?)
    }

    /// Returns the SSBs of the first burst; none unless it is complete.
    pub fn burst(&mut self) -> &mut [SsbObservation] {
        let bursts = &mut self.bursts;
        let held = bursts.observations.get_mut(..bursts.held);
        let held = held.unwrap_or_default();
        let is_complete =
            |first: &SsbObservation| first.ssb.time_s + BURST_S <= bursts.passed_until_s;
        let number = if held.first().is_some_and(is_complete) {
            first_burst(held)
        } else {
            0
        };
        held.get_mut(..number).unwrap_or_default()
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
