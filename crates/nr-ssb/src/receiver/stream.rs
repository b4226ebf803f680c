//! The receiver of a stream.

use num_complex::Complex32;

use super::config::ReceiverConfig;
use super::error::ReceiverError;
use super::window::{GUARD, Seen, Window, WindowReceiver};
use crate::dsp::base_rate::SSB_SAMPLES;
use crate::input::front_end::FrontEnd;

/// Time that is searched at once (s).
const SEARCHED_S: f64 = 0.005;

/// What is needed beyond the place where an SSB begins.
const BEYOND: f64 = SSB_SAMPLES as f64 + GUARD;

/// Front end and [`WindowReceiver`] for samples of any rate, in blocks of any length: what it says does
/// not depend on where blocks end.
pub struct StreamReceiver<const A: usize> {
    receiver: WindowReceiver<A>,
    front_end: FrontEnd,
    /// Samples searched at once, at the base rate.
    stretch: i64,
    /// Samples at the base rate that may still be looked at; the first is number `start`.
    base: [Vec<Complex32>; A],
    start: i64,
    /// Up to where it is decided whether to search.
    searched: i64,
}

impl<const A: usize> StreamReceiver<A> {
    /// Plans transforms and buffers. `centre_frequency_hz` stands at 0 Hz in the samples.
    ///
    /// # Errors
    /// [`ReceiverError`] for a rate, band, number of antennas or setting that is not possible.
    pub fn new(
        config: ReceiverConfig,
        sample_rate_hz: f64,
        centre_frequency_hz: f64,
    ) -> Result<Self, ReceiverError> {
        let search = &config.search;
        let ssb_freq_hz = search.ssb_freq_hz.unwrap_or(centre_frequency_hz);
        let (offset_hz, scs_hz) = (ssb_freq_hz - centre_frequency_hz, search.spacing.hz());
        let mut made = Self {
            front_end: FrontEnd::new(sample_rate_hz, offset_hz, scs_hz, search.antennas)?,
            stretch: (SEARCHED_S * search.spacing.base_rate_hz()).round() as i64,
            receiver: WindowReceiver::new(config)?,
            base: std::array::from_fn(|_| Vec::new()),
            start: 0,
            searched: 0,
        };
        made.go_on_at(0);
        Ok(made)
    }

    /// What keeps to the beams.
    pub const fn receiver(&self) -> &WindowReceiver<A> {
        &self.receiver
    }

    /// Samples of the input for each one at the base rate, which SSBs are counted at.
    pub fn input_per_output(&self) -> f64 {
        self.front_end.input_per_output()
    }

    /// Up to where all SSBs of the beams that are tracked have been shown, samples at the base rate: a burst
    /// is complete once the last of its beams was there.
    pub fn heard_until(&self) -> f64 {
        let next_start = self.receiver.next_start();
        if next_start.is_finite() {
            next_start
        } else {
            self.end() as f64 - BEYOND
        }
    }

    /// Takes the next samples of every antenna and shows `take` the SSBs that they complete, in order
    /// of time; places are in samples at the base rate from the first of all.
    ///
    /// # Errors
    /// [`ReceiverError::FrontEnd`] for another number of antennas or unequal lengths.
    pub fn push(
        &mut self,
        antennas: &[&[Complex32]],
        take: &mut dyn FnMut(Seen<'_, A>),
    ) -> Result<(), ReceiverError> {
        self.front_end.push(antennas, &mut self.base)?;
        self.hear(false, take)
    }

    /// The samples go on at number `sample` of the input: those between are missing. Shows what was held
    /// back.
    ///
    /// # Errors
    /// None that [`push`](Self::push) has not.
    pub fn gap_to(
        &mut self,
        sample: u64,
        take: &mut dyn FnMut(Seen<'_, A>),
    ) -> Result<(), ReceiverError> {
        self.finish(take)?;
        self.go_on_at((sample as f64 / self.input_per_output()).round() as i64);
        Ok(())
    }

    /// Ends a stretch of samples: shows what is held back. What comes next is after a gap of no length.
    ///
    /// # Errors
    /// None that [`push`](Self::push) has not.
    pub fn finish(&mut self, take: &mut dyn FnMut(Seen<'_, A>)) -> Result<(), ReceiverError> {
        self.front_end.finish(&mut self.base);
        for samples in &mut self.base {
            samples.extend([Complex32::ZERO; GUARD as usize]);
        }
        self.hear(true, take)?;
        self.go_on_at(self.end() - GUARD as i64);
        Ok(())
    }

    /// Forgets beams and samples, for a stream that begins anew.
    pub fn reset(&mut self) {
        let mut unheard: [Vec<Complex32>; A] = std::array::from_fn(|_| Vec::new());
        self.front_end.finish(&mut unheard);
        self.receiver.reset();
        self.go_on_at(0);
    }

    /// Number of the sample after the last.
    fn end(&self) -> i64 {
        self.start + self.base[0].len() as i64
    }

    /// The next sample at the base rate is this one, after silence: an SSB may begin with it.
    fn go_on_at(&mut self, number: i64) {
        for samples in &mut self.base {
            samples.clear();
            samples.resize(GUARD as usize, Complex32::ZERO);
        }
        (self.start, self.searched) = (number - GUARD as i64, number);
    }

    /// Searches and tracks in the order in which the samples for it are there; all that are there at the end.
    fn hear(
        &mut self,
        is_end: bool,
        take: &mut dyn FnMut(Seen<'_, A>),
    ) -> Result<(), ReceiverError> {
        let end = self.end();
        loop {
            let last = end as f64 - BEYOND;
            let next_start = self.receiver.next_start();
            let mut stretch_end = self.searched + self.stretch;
            if is_end && stretch_end as f64 > last {
                stretch_end = last.floor() as i64;
            }
            let slices = self.base.each_ref().map(Vec::as_slice);
            let window = |from: i64, to: i64| {
                slices.map(|it| it.get(from as usize..to as usize).unwrap_or_default())
            };
            if stretch_end > self.searched
                && stretch_end as f64 <= last
                && stretch_end as f64 <= next_start
            {
                let start = self.searched - GUARD as i64;
                let to = stretch_end + BEYOND as i64;
                let antennas = window(start - self.start, to - self.start);
                let antennas = antennas.as_slice();
                let window = Window { start, antennas };
                self.receiver.measure_tones(&window);
                if self.receiver.searches_at(self.searched as f64) {
                    self.receiver.search(&window)?;
                }
                self.searched = stretch_end;
            } else if next_start <= last {
                let (start, antennas) = (self.start, slices.as_slice());
                self.receiver
                    .track_next(&Window { start, antennas }, take)?;
            } else {
                break;
            }
        }
        let next_start = self.receiver.next_start().min(end as f64).floor() as i64;
        let from = self.searched.min(next_start) - GUARD as i64 - 1;
        let gone = (from - self.start).clamp(0, end - self.start);
        for samples in &mut self.base {
            samples.drain(..gone as usize);
        }
        self.start += gone;
        Ok(())
    }
}
