//! Receiver of a stream.

use num_complex::Complex32;

use super::config::ReceiverConfig;
use super::error::ReceiverError;
use super::window::{GUARD, ReceivedBeam, Window, WindowReceiver};
use crate::dsp::base_rate::SSB_SAMPLES;
use crate::dsp::received_grid::PerAntenna;
use crate::input::front_end::FrontEnd;

/// Duration of the samples that are searched together (s).
const SEARCHED_S: f64 = 0.005;

/// Number of samples required after the start of an SSB.
const BEYOND: f64 = SSB_SAMPLES as f64 + GUARD;

/// Receiver of samples of any rate, in blocks of any length: front end and [`WindowReceiver`]. The
/// results do not depend on the block boundaries. See the [module](super).
pub struct Receiver {
    windows: WindowReceiver,
    front_end: FrontEnd,
    /// Number of samples that are searched together, at the base rate.
    stretch: i64,
    /// Samples at the base rate that may still be processed; the index of the first one is `start`.
    base: Vec<Vec<Complex32>>,
    start: i64,
    /// Index of the next input sample.
    next_input: u64,
    /// End of the samples that were either searched or skipped, at the base rate.
    searched: i64,
}

impl Receiver {
    /// Creates FFT plans and buffers. `centre_frequency_hz` is the frequency at 0 Hz of the
    /// samples.
    ///
    /// # Errors
    /// [`ReceiverError`] for an invalid rate, band, number of antennas or setting.
    pub fn new(
        config: ReceiverConfig,
        sample_rate_hz: f64,
        centre_frequency_hz: f64,
    ) -> Result<Self, ReceiverError> {
        let search = &config.search;
        let ssb_freq_hz = search.ssb_freq_hz.unwrap_or(centre_frequency_hz);
        let (offset_hz, scs_hz) = (ssb_freq_hz - centre_frequency_hz, search.spacing.hz());
        let front_end = FrontEnd::new(sample_rate_hz, offset_hz, scs_hz, search.antennas)?;
        let mut made = Self {
            stretch: (SEARCHED_S * search.spacing.base_rate_hz()).round() as i64,
            base: vec![Vec::new(); search.antennas],
            windows: WindowReceiver::of_stream(config, front_end.input_per_output())?,
            front_end,
            start: 0,
            next_input: 0,
            searched: 0,
        };
        made.resume_at_sample(0);
        Ok(made)
    }

    /// Returns the receiver of windows.
    pub const fn windows(&self) -> &WindowReceiver {
        &self.windows
    }

    /// Returns the number of input samples per sample at the base rate, the unit of SSB positions.
    pub fn input_per_output(&self) -> f64 {
        self.front_end.input_per_output()
    }

    /// Returns the sample at the base rate before which all SSBs of tracked beams have been passed
    /// on. A burst is complete once its last beam has been.
    pub fn passed_until(&self) -> f64 {
        let next_start = self.windows.next_start();
        if next_start.is_finite() {
            next_start
        } else {
            self.end() as f64 - BEYOND
        }
    }

    /// Processes the next samples of every antenna and passes each completed SSB to `take`, in
    /// order of time. Positions are in samples at the base rate, relative to the first one.
    ///
    /// # Errors
    /// [`ReceiverError::FrontEnd`] for a wrong number of antennas or unequal lengths.
    pub fn push(
        &mut self,
        antennas: &[&[Complex32]],
        take: &mut dyn FnMut(ReceivedBeam<'_>),
    ) -> Result<(), ReceiverError> {
        self.front_end.push(antennas, &mut self.base)?;
        self.next_input += antennas.first().map_or(0, |it| it.len()) as u64;
        self.process(false, take)
    }

    /// Sets the index of the next input sample to `sample`; the samples before it are missing.
    /// Passes on pending SSBs.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn gap_to(
        &mut self,
        sample: u64,
        take: &mut dyn FnMut(ReceivedBeam<'_>),
    ) -> Result<(), ReceiverError> {
        self.end_segment(take)?;
        self.resume_at(sample);
        Ok(())
    }

    /// Ends a segment of samples and passes on pending SSBs. Subsequent samples follow a gap of
    /// zero length.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn finish(&mut self, take: &mut dyn FnMut(ReceivedBeam<'_>)) -> Result<(), ReceiverError> {
        self.end_segment(take)?;
        self.resume_at(self.next_input);
        Ok(())
    }

    fn end_segment(&mut self, take: &mut dyn FnMut(ReceivedBeam<'_>)) -> Result<(), ReceiverError> {
        self.front_end.finish(&mut self.base);
        for samples in &mut self.base {
            samples.extend([Complex32::ZERO; GUARD as usize]);
        }
        self.process(true, take)
    }

    /// Continues at this input sample.
    fn resume_at(&mut self, sample: u64) {
        self.next_input = sample;
        let next = self.front_end.resume_at(sample);
        self.resume_at_sample(next as i64);
    }

    /// Removes beams and samples, for a restarted stream.
    pub fn reset(&mut self) {
        self.front_end.finish(&mut self.base);
        self.windows.reset();
        self.resume_at(0);
    }

    /// Returns the index after the last sample.
    fn end(&self) -> i64 {
        self.start + self.base.first().map_or(0, Vec::len) as i64
    }

    /// Continues at this sample of the base rate, after silence. An SSB may begin at it.
    fn resume_at_sample(&mut self, number: i64) {
        for samples in &mut self.base {
            samples.clear();
            samples.resize(GUARD as usize, Complex32::ZERO);
        }
        (self.start, self.searched) = (number - GUARD as i64, number);
    }

    /// Searches and tracks in the order in which the samples become available; at the end, all of
    /// them.
    fn process(
        &mut self,
        is_end: bool,
        take: &mut dyn FnMut(ReceivedBeam<'_>),
    ) -> Result<(), ReceiverError> {
        let end = self.end();
        loop {
            let last = end as f64 - BEYOND;
            let next_start = self.windows.next_start();
            let mut stretch_end = self.searched + self.stretch;
            if is_end && stretch_end as f64 > last {
                stretch_end = last.floor() as i64;
            }
            let window = |from: i64, to: i64| -> PerAntenna<&[Complex32]> {
                let part = from as usize..to as usize;
                let samples = self.base.iter().map(|it| it.get(part.clone()));
                samples.map(Option::unwrap_or_default).collect()
            };
            if stretch_end > self.searched
                && stretch_end as f64 <= last
                && stretch_end as f64 <= next_start
            {
                let start = self.searched - GUARD as i64;
                let to = stretch_end + BEYOND as i64;
                let antennas = &window(start - self.start, to - self.start);
                let window = Window { start, antennas };
                self.windows.measure_tones(&window);
                if self.windows.searches_at(self.searched as f64) {
                    self.windows.search(&window)?;
                }
                self.searched = stretch_end;
            } else if next_start <= last {
                let (start, antennas) = (self.start, &window(0, end - self.start));
                self.windows.track_next(&Window { start, antennas }, take)?;
            } else {
                break;
            }
        }
        let next_start = self.windows.next_start().min(end as f64).floor() as i64;
        let from = self.searched.min(next_start) - GUARD as i64 - 1;
        let gone = (from - self.start).clamp(0, end - self.start);
        for samples in &mut self.base {
            samples.drain(..gone as usize);
        }
        self.start += gone;
        Ok(())
    }
}
