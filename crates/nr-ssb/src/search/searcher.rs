//! Search in a recording, or in a stream block by block.

use num_complex::Complex32;

use super::detected::{DetectedSsb, ReceivedElements, SearchCounts};
use super::error::SearchError;
use super::examine::Examiner;
use super::settings::{SearchConfig, check_frequency};
use crate::dsp::base_rate::{CYCLIC_PREFIX, SSB_SAMPLES};
use crate::dsp::hypotheses::cfo_hypotheses;
use crate::dsp::matched_filter::{MatchedFilter, PssCandidate};
use crate::dsp::tones::{Tone, ToneCanceller};
use crate::numeric::false_alarm::exponential_sum_threshold;

/// Maximum number of examined candidates per 20 ms; further ones are noise and sidelobes.
const CANDIDATES_PER_20_MS: usize = 200;
/// Expected number of PSS candidates due to noise in 20 ms. Each costs an examination, but causes
/// no false cell.
const NOISE_CANDIDATES_PER_20_MS: f64 = 4.0;
/// Fraction of the threshold that a candidate must reach after whitening over the antennas, with a
/// timing error of up to half a sample.
const PSS_FLOOR: f32 = 0.75;
/// Maximum energy of a sample, for which sums over a million samples are finite.
const MAX_ENERGY: f32 = 1e30;

/// Searcher of sample blocks at the base rate. It owns all plans and buffers.
pub struct Searcher {
    config: SearchConfig,
    base_rate_hz: f64,
    filter: MatchedFilter,
    examiner: Examiner,
    pss_threshold: f32,
    pub(crate) canceller: ToneCanceller,
    /// End of the last block followed by the current block, for each antenna.
    buffer: Vec<Vec<Complex32>>,
    /// Number of samples before the first one of the buffer.
    buffer_start: u64,
    candidates: Vec<PssCandidate>,
}

impl Searcher {
    /// Creates a searcher.
    ///
    /// # Errors
    /// [`SearchError::Antennas`], [`SearchError::Setting`].
    pub fn new(config: SearchConfig) -> Result<Self, SearchError> {
        config.check()?;
        let base_rate_hz = config.spacing.base_rate_hz();
        let hypotheses = cfo_hypotheses(config.cfo_range_hz, config.spacing.hz() / 3.0);
        let trials = 0.02 * base_rate_hz * 3.0 * hypotheses.len() as f64;
        let pss_probability = NOISE_CANDIDATES_PER_20_MS / trials;
        // The maximum over 336 SSS and 8 DM-RS determines the false-alarm probability.
        let cell_probability = config.false_alarm / (trials * 336.0 * 8.0);
        let antennas = config.antennas;
        let mut filter = MatchedFilter::new(config.spacing.hz(), &hypotheses, antennas);
        filter.centre(config.cfo_centre_hz);
        let pss_threshold = exponential_sum_threshold(antennas, pss_probability) as f32;
        let cell_threshold = exponential_sum_threshold(antennas + 4, cell_probability) as f32;
        Ok(Self {
            base_rate_hz,
            filter,
            examiner: Examiner::new(&config, PSS_FLOOR * pss_threshold, cell_threshold),
            pss_threshold,
            canceller: ToneCanceller::new(antennas),
            buffer: vec![Vec::new(); antennas],
            buffer_start: 0,
            candidates: Vec::new(),
            config,
        })
    }

    /// Returns all SSBs of one recording, in order of time.
    ///
    /// # Errors
    /// [`SearchError::AntennaCount`], [`SearchError::UnequalLengths`], [`SearchError::TooShort`].
    pub fn search(&mut self, antennas: &[&[Complex32]]) -> Result<&[DetectedSsb], SearchError> {
        self.reset();
        let samples = self.common_length(antennas)?;
        if samples < SSB_SAMPLES {
            return Err(SearchError::TooShort {
                samples,
                needed: SSB_SAMPLES,
            });
        }
        self.push(antennas)
    }

    /// Returns the SSBs that the next block of a stream completes, in order of time. SSBs across
    /// the end of the block are returned with the next one.
    ///
    /// # Errors
    /// [`SearchError::AntennaCount`], [`SearchError::UnequalLengths`].
    pub fn push(&mut self, antennas: &[&[Complex32]]) -> Result<&[DetectedSsb], SearchError> {
        self.push_with(antennas, &mut |_, _| {})
    }

    /// Processes a block like [`push`](Self::push), and passes every SSB to `inspect` upon
    /// detection, stronger ones first. The payload of an SSB may become known later, from another
    /// SSB.
    ///
    /// # Errors
    /// Those of [`push`](Self::push).
    pub fn push_with(
        &mut self,
        antennas: &[&[Complex32]],
        inspect: &mut dyn FnMut(&DetectedSsb, &ReceivedElements<'_>),
    ) -> Result<&[DetectedSsb], SearchError> {
        let length = self.common_length(antennas)?;
        let kept = self.buffer.first().map_or(0, Vec::len);
        let tail = kept.min(SSB_SAMPLES + CYCLIC_PREFIX);
        self.buffer_start += (kept - tail) as u64;
        for (buffer, input) in self.buffer.iter_mut().zip(antennas) {
            buffer.copy_within(kept - tail.., 0);
            buffer.truncate(tail);
            // A single sample that is not finite, or too large, would corrupt a whole transform.
            let usable = |x: &Complex32| x.norm_sqr() < MAX_ENERGY;
            buffer.extend(
                input
                    .iter()
                    .map(|x| if usable(x) { *x } else { Complex32::ZERO }),
            );
        }
        self.canceller.detect(&self.buffer, tail);
        self.canceller.subtract(&mut self.buffer, tail);
        self.examiner.begin_block(self.buffer_start as f64);
        self.examine_all(tail + length, inspect);
        Ok(self.examiner.found_in_order())
    }

    /// Sets another SSB frequency, and removes the state of the stream.
    ///
    /// # Errors
    /// [`SearchError::Setting`] unless the frequency is finite.
    pub fn tune(&mut self, ssb_freq_hz: Option<f64>) -> Result<(), SearchError> {
        check_frequency(ssb_freq_hz)?;
        self.config.ssb_freq_hz = ssb_freq_hz;
        self.examiner.tune(ssb_freq_hz);
        self.reset();
        Ok(())
    }

    /// Sets the central carrier frequency offset of the search.
    ///
    /// # Errors
    /// [`SearchError::Setting`] if it is more than 32 subcarriers.
    pub fn centre(&mut self, cfo_centre_hz: f64) -> Result<(), SearchError> {
        let config = SearchConfig {
            cfo_centre_hz,
            ..self.config.clone()
        };
        config.check()?;
        self.config = config;
        self.filter.centre(cfo_centre_hz);
        self.examiner.centre(cfo_centre_hz);
        Ok(())
    }

    /// Removes the state of the stream.
    pub fn reset(&mut self) {
        self.buffer.iter_mut().for_each(Vec::clear);
        self.buffer_start = 0;
        self.canceller.forget();
        self.examiner.forget();
    }

    /// Returns the configuration.
    pub fn config(&self) -> &SearchConfig {
        &self.config
    }

    /// Returns the number of candidates at each stage in the last block.
    pub fn counts(&self) -> SearchCounts {
        self.examiner.counts()
    }

    /// Returns the DC offset and tones that were subtracted from the last block, the strongest
    /// first.
    pub fn tones(&self) -> impl Iterator<Item = Tone> + '_ {
        self.canceller.tones(self.base_rate_hz)
    }

    fn common_length(&self, antennas: &[&[Complex32]]) -> Result<usize, SearchError> {
        let (given, expected) = (antennas.len(), self.config.antennas);
        if given != expected {
            return Err(SearchError::AntennaCount { given, expected });
        }
        let first = antennas.first().map_or(0, |samples| samples.len());
        match antennas.iter().find(|samples| samples.len() != first) {
            Some(samples) => Err(SearchError::UnequalLengths {
                first,
                other: samples.len(),
            }),
            None => Ok(first),
        }
    }

    fn examine_all(
        &mut self,
        length: usize,
        inspect: &mut dyn FnMut(&DetectedSsb, &ReceivedElements<'_>),
    ) {
        // PSS of an SSB within the buffer.
        let Some(end) = (length + 1).checked_sub(SSB_SAMPLES - CYCLIC_PREFIX) else {
            return;
        };
        let first = CYCLIC_PREFIX;
        self.candidates.clear();
        self.filter.run(
            &self.buffer,
            first,
            end,
            self.pss_threshold,
            &mut self.candidates,
        );
        let blocks = (length as f64 / (0.02 * self.base_rate_hz)).ceil() as usize;
        for _ in 0..CANDIDATES_PER_20_MS * blocks.max(1) {
            let strongest = self
                .candidates
                .iter()
                .enumerate()
                .max_by(|a, b| a.1.statistic.total_cmp(&b.1.statistic))
                .map(|(index, _)| index);
            let Some(index) = strongest else { break };
            let candidate = self.candidates.swap_remove(index);
            let start = self.buffer_start;
            let place = (self.buffer.as_mut_slice(), start as f64);
            let Some(alignment) = self.examiner.examine(place, &candidate, inspect) else {
                continue;
            };
            // The matched filter is repeated around an SSB that was subtracted.
            let from = alignment.start.saturating_sub(SSB_SAMPLES / 4).max(first);
            let to = (alignment.start + SSB_SAMPLES).min(end);
            self.candidates
                .retain(|other| !(from..to).contains(&other.sample));
            self.filter.run(
                &self.buffer,
                from,
                to,
                self.pss_threshold,
                &mut self.candidates,
            );
        }
    }
}
