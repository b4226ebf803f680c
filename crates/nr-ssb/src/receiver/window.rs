//! Receiver of windows: searches until a beam is detected, tracks, and searches again.
//!
//! Without beams, the receiver searches every frequency offset that the oscillators may have, one
//! subcarrier apart, outwards from the last known one or zero. It searches at most four offsets per
//! burst, so that the load of a burst is bounded and the longest period does not make the search
//! long. After all offsets, it pauses briefly and restarts. With beams, it searches around their
//! own offset for further beams at intervals, and immediately if none of them is received.

use num_complex::Complex32;

use super::beam::Beam;
use super::config::ReceiverConfig;
use super::error::ReceiverError;
use crate::dsp::base_rate::SSB_SAMPLES;
use crate::dsp::received_grid::PerAntenna;
use crate::dsp::tones::Tone;
use crate::search::{SearchError, Searcher};
use crate::track::{Tracker, TrackerOutput};

/// Number of samples required on either side of an SSB, at the base rate: half a cyclic prefix, and
/// the length of the filter.
pub(super) const GUARD: f64 = 16.0;
/// Time after which an unsuccessful search over all offsets restarts, and after which missing beams
/// are searched for, in seconds.
const LOST_INTERVAL_S: f64 = 0.1;
/// SSB period divided by the number of frequency offsets that are searched in a burst without beams
/// (s).
const PERIOD_OF_OFFSET_S: f64 = 0.04;
/// Maximum number of frequency offsets that are searched in a burst without beams.
const MAX_OFFSETS: f64 = 4.0;
/// Interval of the measurement of DC offset and tones, in seconds; [`LOST_INTERVAL_S`] if an SSB is
/// missing.
const TONE_INTERVAL_S: f64 = 1.0;
/// Number of samples before the start of the expected SSB from which tones are subtracted.
const BEFORE: usize = 1500;
/// Number of samples after the start of the expected SSB from which tones are subtracted.
const AFTER: usize = 2596;
/// Maximum deviation of a beam from its period, in samples, far above any clock drift.
const OFF_PERIOD: f64 = 100.0;

/// Samples at the base rate.
#[derive(Debug, Clone, Copy)]
pub struct Window<'a> {
    /// Index of the first sample, in samples of the receiver's clock.
    pub start: i64,
    /// Samples of each antenna, with equal lengths.
    pub antennas: &'a [&'a [Complex32]],
}

impl Window<'_> {
    /// Returns the index after the last sample.
    pub(super) fn end(&self) -> f64 {
        let length = self.antennas.iter().map(|samples| samples.len()).min();
        self.start as f64 + length.unwrap_or(0) as f64
    }
}

/// Received SSB and its tracker, which stores the received elements.
pub struct ReceivedBeam<'a> {
    /// Result of the tracker.
    pub ssb: &'a TrackerOutput,
    /// Its tracker.
    pub tracker: &'a mut Tracker,
    /// Whether the SSB was received at its expected time; `false` for the first one after a search.
    pub is_followed: bool,
    /// Unreported missing samples before the SSB at the base rate, modulo the period: all beams
    /// deviated from their period at once. They are not part of `sample_start`.
    pub unreported_gap: f64,
    /// Number of input samples per sample at the base rate.
    pub input_per_output: f64,
}

/// Tracks the beams at one frequency in windows of samples, which may be parts of a stream or
/// surround each burst.
pub struct WindowReceiver {
    config: ReceiverConfig,
    input_per_output: f64,
    searcher: Searcher,
    beams: Vec<Beam>,
    /// Start of the last search, in samples.
    search_begun: f64,
    /// End of the last search, in samples.
    search_until: f64,
    searches: u64,
    /// Frequency offset of the last detected beams, in Hz.
    offset_hz: f64,
    /// Number of frequency offsets that were searched without success since then.
    failed_searches: u32,
    /// Total duration of unreported missing samples, in samples.
    unreported_gap: f64,
    /// Position of the last tone measurement, in samples.
    tones_measured: f64,
    /// Samples after removal of the tones.
    cleaned: Vec<Vec<Complex32>>,
}

impl WindowReceiver {
    /// Creates a receiver without beams.
    ///
    /// # Errors
    /// [`ReceiverError::Search`] for an invalid configuration.
    pub fn new(config: ReceiverConfig) -> Result<Self, ReceiverError> {
        Self::of_stream(config, 1.0)
    }

    /// Creates a receiver without beams, for a stream with this number of input samples per sample
    /// at the base rate.
    pub(super) fn of_stream(
        config: ReceiverConfig,
        input_per_output: f64,
    ) -> Result<Self, ReceiverError> {
        config.check()?;
        Ok(Self {
            searcher: Searcher::new(config.search.clone())?,
            beams: Vec::new(),
            search_begun: f64::NEG_INFINITY,
            search_until: f64::NEG_INFINITY,
            searches: 0,
            offset_hz: 0.0,
            failed_searches: 0,
            unreported_gap: 0.0,
            tones_measured: f64::NEG_INFINITY,
            cleaned: vec![Vec::with_capacity(BEFORE + AFTER); config.search.antennas],
            input_per_output,
            config,
        })
    }

    /// Returns the configuration.
    pub const fn config(&self) -> &ReceiverConfig {
        &self.config
    }

    /// Returns the number of tracked beams.
    pub fn tracked(&self) -> usize {
        self.beams.len()
    }

    /// Returns the number of searched windows.
    pub const fn searches(&self) -> u64 {
        self.searches
    }

    /// Removes all beams, but keeps the oscillators' offset: the index of samples restarts.
    pub fn reset(&mut self) {
        self.beams.clear();
        (self.search_begun, self.search_until) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        (self.failed_searches, self.unreported_gap) = (0, 0.0);
        self.tones_measured = f64::NEG_INFINITY;
    }

    /// Returns the DC offset and tones that are subtracted, the strongest first; frequencies are
    /// relative to the SSB's centre.
    pub fn tones(&self) -> impl Iterator<Item = Tone> + '_ {
        self.searcher.tones()
    }

    /// Measures tones in the window if a measurement is due.
    pub(super) fn measure_tones(&mut self, window: &Window<'_>) {
        let is_missing = self.beams.iter().any(|beam| beam.tracker.misses() > 0);
        let interval_s = if is_missing {
            LOST_INTERVAL_S
        } else {
            TONE_INTERVAL_S
        };
        let interval = interval_s * self.config.search.spacing.base_rate_hz();
        if window.start as f64 - self.tones_measured >= interval {
            self.tones_measured = window.start as f64;
            self.searcher.canceller.detect(window.antennas, 0);
        }
    }

    /// Searches the window if a search is due, and passes the SSBs in it to `take`, in order of
    /// time.
    ///
    /// # Errors
    /// [`ReceiverError`] for a wrong number of antennas or unequal lengths.
    pub fn receive(
        &mut self,
        window: &Window<'_>,
        take: &mut dyn FnMut(ReceivedBeam<'_>),
    ) -> Result<(), ReceiverError> {
        self.measure_tones(window);
        if self.searches_at(window.start as f64) {
            self.search(window)?;
            self.search_until = f64::NEG_INFINITY; // all of a burst is in a window
            self.count_failed_searches();
        }
        while self.track_next(window, take)? {}
        Ok(())
    }

    /// Whether the samples starting at `start` are searched: a search continues for one period.
    pub(super) fn searches_at(&mut self, start: f64) -> bool {
        if start < self.search_until {
            return true;
        }
        if self.search_until.is_finite() {
            self.search_until = f64::NEG_INFINITY;
            self.count_failed_searches();
        }
        if self.all_received() {
            return false;
        }
        let came = self.beams.iter().any(|beam| beam.tracker.misses() == 0);
        let interval_s = if came {
            self.config.search_every_s
        } else if self.beams.is_empty() && self.failed_searches < self.config.offsets() {
            0.0
        } else {
            LOST_INTERVAL_S
        };
        let interval = interval_s * self.config.search.spacing.base_rate_hz();
        let is_due = start - self.search_begun >= interval;
        if is_due {
            (self.search_begun, self.search_until) = (start, start + self.config.period());
        }
        is_due
    }

    /// Whether all known beams are received; updates the frequency offset of the beams.
    fn all_received(&mut self) -> bool {
        let (beams, known) = (&self.beams, &self.config.beams);
        let comes = |known: &(u16, u8)| {
            let is_it = |it: &&Beam| (it.pci.get(), it.ssb_index) == *known;
            (beams.iter().find(is_it)).is_some_and(|it| it.tracker.misses() == 0)
        };
        let all_received = !known.is_empty() && known.iter().all(comes);
        if let (true, Some(beam)) = (all_received, beams.first()) {
            self.offset_hz = beam.tracker.cfo_hz();
        }
        all_received
    }

    /// Records a search over a whole period.
    fn count_failed_searches(&mut self) {
        if self.beams.is_empty() {
            self.failed_searches = self.failed_searches.saturating_add(self.at_once());
        }
    }

    /// Returns the number of frequency offsets that are searched together.
    fn at_once(&self) -> u32 {
        let offsets = (self.config.period_s / PERIOD_OF_OFFSET_S).round();
        (offsets.clamp(1.0, MAX_OFFSETS) as u32).min(self.config.offsets())
    }

    /// Returns the frequency offset of search number `number`: that of the beams, otherwise the
    /// last known one, one subcarrier above, one below, two above, and so on.
    fn centre_hz(&self, number: u32) -> f64 {
        if let Some(beam) = self.beams.iter().min_by_key(|beam| beam.tracker.misses()) {
            return beam.tracker.cfo_hz();
        }
        let turn = (self.failed_searches + number) % self.config.offsets();
        let away = f64::from(turn.div_ceil(2)) * self.config.search.spacing.hz();
        self.offset_hz + if turn % 2 == 1 { away } else { -away }
    }

    /// Searches a window for beams.
    pub(super) fn search(&mut self, window: &Window<'_>) -> Result<(), ReceiverError> {
        let too_short = |samples: &&[Complex32]| samples.len() < SSB_SAMPLES;
        if window.antennas.iter().any(too_short) {
            return Ok(());
        }
        self.searches += 1;
        self.tones_measured = window.start as f64;
        for number in 0..self.at_once() {
            self.search_around(self.centre_hz(number), window)?;
            if !self.beams.is_empty() {
                break;
            }
        }
        Ok(())
    }

    fn search_around(&mut self, cfo_hz: f64, window: &Window<'_>) -> Result<(), ReceiverError> {
        let period = self.config.period();
        self.searcher.centre(cfo_hz)?;
        let mut none_received = self.beams.iter().all(|beam| beam.tracker.misses() > 0);
        for found in self.searcher.search(window.antennas)? {
            let wanted = self.config.cells.as_ref();
            if wanted.is_some_and(|cells| !cells.contains(&found.pci.get())) {
                continue;
            }
            (self.failed_searches, self.offset_hz) = (0, found.cfo_hz);
            let mut found = found.clone();
            found.sample_start += window.start as f64;
            let same =
                |beam: &&mut Beam| (beam.pci, beam.ssb_index) == (found.pci, found.ssb_index);
            match self.beams.iter_mut().find(same) {
                Some(beam) if beam.tracker.misses() > 0 => {
                    let off = beam.found(&found, period);
                    if none_received && off.abs() > OFF_PERIOD {
                        self.unreported_gap += (-off).rem_euclid(period);
                    }
                    none_received = false; // the other beams have equal information
                }
                Some(_) => {}
                None => self.beams.push(Beam::new(&self.config.search, &found)?),
            }
        }
        Ok(())
    }

    /// Returns the expected start of the next SSB.
    pub(super) fn next_start(&self) -> f64 {
        let starts = self.beams.iter().map(|beam| beam.next_start);
        starts.fold(f64::INFINITY, f64::min)
    }

    /// Tracks the first expected SSB in the window; returns `false` if there is none.
    pub(super) fn track_next(
        &mut self,
        window: &Window<'_>,
        take: &mut dyn FnMut(ReceivedBeam<'_>),
    ) -> Result<bool, ReceiverError> {
        let (given, expected) = (window.antennas.len(), self.config.search.antennas);
        if given != expected {
            return Err(SearchError::AntennaCount { given, expected }.into());
        }
        let period = self.config.period();
        let first = window.start as f64 + GUARD;
        let last = window.end() - SSB_SAMPLES as f64 - GUARD;
        for beam in &mut self.beams {
            beam.skip_to(first, period);
        }
        let by_start = |(_, a): &(usize, &mut Beam), (_, b): &(usize, &mut Beam)| {
            a.next_start.total_cmp(&b.next_start)
        };
        let next = self.beams.iter_mut().enumerate().min_by(by_start);
        let Some((index, beam)) = next.filter(|(_, beam)| beam.next_start <= last) else {
            return Ok(false);
        };
        let (mut start, decode) = (window.start as f64, self.config.decode_pbch);
        let canceller = &mut self.searcher.canceller;
        let cleaned: PerAntenna<&[Complex32]>;
        let mut antennas = window.antennas;
        if canceller.is_needed() {
            // Subtract the tones from a copy of the samples around the SSB.
            let place = (beam.next_start - start) as usize;
            let from = place.saturating_sub(BEFORE);
            for (copy, samples) in self.cleaned.iter_mut().zip(antennas) {
                copy.clear();
                let to = samples.len().min(place + AFTER);
                copy.extend_from_slice(samples.get(from..to).unwrap_or_default());
            }
            canceller.subtract(&mut self.cleaned, 0);
            cleaned = self.cleaned.iter().map(Vec::as_slice).collect();
            antennas = &cleaned;
            start += from as f64;
        }
        let seen = beam
            .tracker
            .track(antennas, start, beam.next_start, decode)?;
        // The DM-RS identifies the beam; the SSB of another beam is rejected.
        if let Some(ssb) = seen.filter(|seen| seen.ssb_index == beam.ssb_index) {
            let is_followed = beam.is_followed;
            beam.seen(ssb.sample_start, period);
            take(ReceivedBeam {
                ssb: &ssb,
                tracker: &mut beam.tracker,
                is_followed,
                unreported_gap: self.unreported_gap,
                input_per_output: self.input_per_output,
            });
        } else {
            beam.skip(1.0, period);
            let lost_after = self.config.lost_after_s * self.config.search.spacing.base_rate_hz();
            if beam.is_lost(lost_after) {
                self.beams.remove(index);
            }
        }
        Ok(true)
    }
}
