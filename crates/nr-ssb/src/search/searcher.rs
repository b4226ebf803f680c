//! The search through a recording, or through a stream block by block.

use num_complex::Complex32;

use super::detected::{DetectedSsb, ReceivedSsb, SearchCounts};
use super::error::SearchError;
use super::settings::{SearchConfig, check_frequency};
use crate::dsp::alignment::Alignment;
use crate::dsp::base_rate::{CYCLIC_PREFIX, SSB_SAMPLES};
use crate::dsp::cancel::Canceller;
use crate::dsp::hypotheses::cfo_hypotheses;
use crate::dsp::matched_filter::{MatchedFilter, PssCandidate};
use crate::dsp::received_grid::MAX_ANTENNAS;
use crate::numeric::decibel::decibel;
use crate::numeric::false_alarm::exponential_sum_threshold;
use crate::receive::acquire::{Acquired, Acquirer};
use crate::receive::broadcast::{Broadcast, BroadcastDecoder};
use crate::receive::measure::{Measurement, measure, sss_power};
use crate::standard::grid::pss_indices;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// Candidates examined per 20 ms at most; what noise and sidelobes offer beyond is not worth it.
const CANDIDATES_PER_20_MS: usize = 200;
/// PSS candidates that noise may offer in 20 ms. Each costs an examination, none a false cell.
const NOISE_CANDIDATES_PER_20_MS: f64 = 4.0;
/// Part of the threshold that a candidate must keep once the correlation of the antennas' noise is
/// allowed for, its timing still off by up to half a sample.
const PSS_FLOOR: f32 = 0.75;
/// Part of the threshold for a cell from which on its PBCH is decoded.
const DECODE_FLOOR: f32 = 0.7;
/// SNR after combining above which a PBCH always decodes (its block error rate is 1 % at −8 dB):
/// a stronger "cell" whose PBCH does not decode is none.
const CERTAIN_DECODE_SNR_DB: f64 = -2.0;
/// Sums of a million samples' energies stay finite below this.
const MAX_ENERGY: f32 = 1e30;
/// A cell whose PBCH does not decode, with the PSS of a cell so much stronger and so near to it in
/// time, is taken for what was left of that one.
const RESIDUE_DB: f64 = 25.0;
const RESIDUE_SAMPLES: f64 = 1.0;
/// Two detections of one cell closer than this, in samples, are one SSB.
const SAME_SSB_SAMPLES: f64 = CYCLIC_PREFIX as f64;

/// Searches blocks of samples at the base rate; owns all plans and buffers.
pub struct Searcher {
    config: SearchConfig,
    base_rate_hz: f64,
    filter: MatchedFilter,
    acquirer: Acquirer,
    decoder: BroadcastDecoder,
    canceller: Canceller,
    pss_threshold: f32,
    cell_threshold: f32,
    /// Samples of the end of the last block and of this one, per antenna.
    buffer: Vec<Vec<Complex32>>,
    /// Number of samples before the buffer's first.
    buffer_start: u64,
    candidates: Vec<PssCandidate>,
    found: Vec<DetectedSsb>,
    counts: SearchCounts,
    /// The last SSBs of the block before, to know them again.
    recent: Vec<(Pci, f64)>,
}

impl Searcher {
    /// Plans a search.
    ///
    /// # Errors
    /// [`SearchError::Antennas`], [`SearchError::Setting`].
    pub fn new(config: SearchConfig) -> Result<Self, SearchError> {
        if config.antennas == 0 || config.antennas > MAX_ANTENNAS {
            return Err(SearchError::Antennas(config.antennas));
        }
        let setting = |name, value, allowed| SearchError::Setting {
            name,
            value,
            allowed,
        };
        if !(0.0..=5.0 * config.spacing.hz()).contains(&config.cfo_range_hz) {
            let allowed = "from 0 to 5 subcarriers";
            return Err(setting("cfo_range_hz", config.cfo_range_hz, allowed));
        }
        if !(config.false_alarm > 0.0 && config.false_alarm < 1.0) {
            return Err(setting(
                "false_alarm",
                config.false_alarm,
                "between 0 and 1",
            ));
        }
        check_frequency(config.ssb_freq_hz)?;
        let base_rate_hz = config.spacing.base_rate_hz();
        let hypotheses = cfo_hypotheses(config.cfo_range_hz, config.spacing.hz());
        let trials = 0.02 * base_rate_hz * 3.0 * hypotheses.len() as f64;
        let pss_probability = NOISE_CANDIDATES_PER_20_MS / trials;
        // Any of 336 SSS and 8 DM-RS may make the sum large.
        let cell_probability = config.false_alarm / (trials * 336.0 * 8.0);
        let antennas = config.antennas;
        let pss_threshold = exponential_sum_threshold(antennas, pss_probability) as f32;
        let pss_floor = PSS_FLOOR * pss_threshold;
        Ok(Self {
            base_rate_hz,
            filter: MatchedFilter::new(config.spacing.hz(), &hypotheses, antennas),
            acquirer: Acquirer::new(base_rate_hz, config.ssb_freq_hz, antennas, pss_floor),
            decoder: BroadcastDecoder::new(&config),
            canceller: Canceller::new(),
            pss_threshold,
            cell_threshold: exponential_sum_threshold(antennas + 4, cell_probability) as f32,
            buffer: vec![Vec::new(); antennas],
            buffer_start: 0,
            candidates: Vec::new(),
            found: Vec::new(),
            counts: SearchCounts::default(),
            recent: Vec::new(),
            config,
        })
    }

    /// All SSBs in one recording, in order of time.
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

    /// The SSBs that are complete with the next block of a stream, in order of time. Those that
    /// reach over the block's end come with the next one.
    ///
    /// # Errors
    /// [`SearchError::AntennaCount`], [`SearchError::UnequalLengths`].
    pub fn push(&mut self, antennas: &[&[Complex32]]) -> Result<&[DetectedSsb], SearchError> {
        self.push_with(antennas, &mut |_, _| {})
    }

    /// As [`push`](Self::push), and shows `look` every SSB as it is found, stronger ones first. Its
    /// payload may become known later, from another SSB.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn push_with(
        &mut self,
        antennas: &[&[Complex32]],
        look: &mut dyn FnMut(&DetectedSsb, &ReceivedSsb<'_>),
    ) -> Result<&[DetectedSsb], SearchError> {
        let length = self.common_length(antennas)?;
        let kept = self.buffer.first().map_or(0, Vec::len);
        let tail = kept.min(SSB_SAMPLES + CYCLIC_PREFIX);
        self.buffer_start += (kept - tail) as u64;
        for (buffer, input) in self.buffer.iter_mut().zip(antennas) {
            buffer.copy_within(kept - tail.., 0);
            buffer.truncate(tail);
            // One sample that is not a number, or whose energy is none, would spoil a whole transform.
            let usable = |x: &Complex32| x.norm_sqr() < MAX_ENERGY;
            buffer.extend(
                input
                    .iter()
                    .map(|x| if usable(x) { *x } else { Complex32::ZERO }),
            );
        }
        self.remember();
        self.examine_all(tail + length, look);
        self.found
            .sort_unstable_by(|a, b| a.sample_start.total_cmp(&b.sample_start));
        Ok(&self.found)
    }

    /// Moves to an SSB at another frequency, and forgets the stream so far.
    ///
    /// # Errors
    /// [`SearchError::Setting`] unless the frequency is finite.
    pub fn tune(&mut self, ssb_freq_hz: Option<f64>) -> Result<(), SearchError> {
        check_frequency(ssb_freq_hz)?;
        self.config.ssb_freq_hz = ssb_freq_hz;
        self.acquirer.tune(ssb_freq_hz);
        self.decoder.tune(&self.config);
        self.reset();
        Ok(())
    }

    /// Forgets the stream so far.
    pub fn reset(&mut self) {
        self.buffer.iter_mut().for_each(Vec::clear);
        self.buffer_start = 0;
        self.found.clear();
        self.recent.clear();
        self.decoder.forget();
    }

    /// The settings.
    pub fn config(&self) -> &SearchConfig {
        &self.config
    }

    /// What became of the candidates in the block searched last.
    pub fn counts(&self) -> SearchCounts {
        self.counts
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

    /// Keeps what was found near the end of the last block.
    fn remember(&mut self) {
        self.recent.clear();
        let start = self.buffer_start as f64;
        let near = self
            .found
            .iter()
            .filter(|ssb| ssb.sample_start > start - SAME_SSB_SAMPLES);
        self.recent
            .extend(near.map(|ssb| (ssb.pci, ssb.sample_start)));
        self.found.clear();
    }

    fn examine_all(&mut self, length: usize, look: &mut dyn FnMut(&DetectedSsb, &ReceivedSsb<'_>)) {
        self.counts = SearchCounts::default();
        // The PSS of an SSB that lies inside the buffer.
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
            self.counts.pss_candidates += 1;
            let Some(alignment) = self.examine(&candidate, look) else {
                continue;
            };
            // Around an SSB that is now gone the matched filter is run again.
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

    /// Identifies, decodes, measures and removes the SSB of a candidate.
    fn examine(
        &mut self,
        candidate: &PssCandidate,
        look: &mut dyn FnMut(&DetectedSsb, &ReceivedSsb<'_>),
    ) -> Option<Alignment> {
        let mut acquired = self.acquirer.acquire(&self.buffer, candidate)?;
        let tolerated_hz = self.config.cfo_range_hz + self.config.spacing.hz() / 6.0;
        if (acquired.alignment.cfo_cycles * self.base_rate_hz).abs() > tolerated_hz {
            return None;
        }
        let time = self.buffer_start as f64 + acquired.alignment.first_sample();
        let known = self.found.iter().map(|ssb| (ssb.pci, ssb.sample_start));
        if known
            .chain(self.recent.iter().copied())
            .any(|(pci, start)| pci == acquired.pci && (start - time).abs() < SAME_SSB_SAMPLES)
        {
            return None;
        }
        if acquired.statistic < DECODE_FLOOR * self.cell_threshold {
            return None;
        }
        self.counts.pbch_tried += 1;
        let mut broadcast = self.decoder.decode(&self.acquirer, &acquired);
        if broadcast.is_none() {
            let certain = 10.0_f64.powf(0.1 * CERTAIN_DECODE_SNR_DB);
            if acquired.statistic < self.cell_threshold || self.acquirer.snr() > certain {
                return None;
            }
            broadcast = self.decoder.combine(&acquired, time);
            if broadcast.is_none() && self.is_residue(acquired.pci, time) {
                return None;
            }
        }
        if let Some(broadcast) = &broadcast {
            self.acquirer.know_pbch(acquired.pci, &broadcast.symbols);
            self.acquirer.align(&self.buffer, &mut acquired.alignment)?;
            self.complete_earlier(&acquired, broadcast, time);
        }
        self.report(&acquired, broadcast.as_ref());
        if let Some(ssb) = self.found.last() {
            let received = ReceivedSsb {
                elements: &self.acquirer.grids,
                known: &self.acquirer.reference,
                noise_variance: &self.acquirer.estimate.noise_variance,
            };
            look(ssb, &received);
        }
        self.remove(&acquired.alignment);
        Some(acquired.alignment)
    }

    /// Whether an SSB may be what a clipped or otherwise distorted stronger one has left: with its
    /// PSS, in its place, and far below it.
    fn is_residue(&self, pci: Pci, time: f64) -> bool {
        let snr_db = decibel(self.acquirer.snr() / self.config.antennas as f64);
        self.found.iter().any(|ssb| {
            ssb.pci.n_id_2() == pci.n_id_2()
                && (ssb.sample_start - time).abs() < RESIDUE_SAMPLES
                && ssb.snr_db > snr_db + RESIDUE_DB
        })
    }

    fn report(&mut self, acquired: &Acquired, broadcast: Option<&Broadcast>) {
        let alignment = &acquired.alignment;
        let antennas = self.config.antennas;
        let mut measurements = [Measurement::default(); MAX_ANTENNAS];
        let estimate = &self.acquirer.estimate;
        let inputs = self
            .acquirer
            .grids
            .iter()
            .zip(&estimate.channel)
            .zip(&estimate.noise_variance);
        for (slot, ((grid, channel), noise)) in measurements.iter_mut().zip(inputs) {
            *slot = measure(grid, sss_power(channel), *noise);
        }
        let lmax = broadcast.map_or_else(|| self.decoder.likely_lmax(), |broadcast| broadcast.lmax);
        let payload = broadcast.map(|broadcast| broadcast.payload);
        let half_frame = match (payload, lmax) {
            (Some(payload), _) => Some(payload.half_frame),
            (None, Lmax::L4) => Some(acquired.ibar_ssb >= 4),
            (None, _) => None,
        };
        self.found.push(DetectedSsb {
            pci: acquired.pci,
            ibar_ssb: acquired.ibar_ssb,
            ssb_index: lmax.index_lsb(acquired.ibar_ssb),
            half_frame,
            lmax,
            payload,
            sample_start: self.buffer_start as f64 + alignment.first_sample(),
            cfo_hz: alignment.cfo_cycles * self.base_rate_hz,
            symbol_phase_step_rad: alignment.phase_step,
            snr_db: decibel(self.acquirer.snr() / antennas as f64),
            statistic: acquired.statistic,
            coarse_cfo_hz: acquired.coarse_cfo_cycles * self.base_rate_hz,
            measurements,
            antennas,
        });
    }

    /// Gives earlier SSBs of the same beam, not decoded by themselves, what they must have said.
    fn complete_earlier(&mut self, acquired: &Acquired, broadcast: &Broadcast, time: f64) {
        let same = |ssb: &&mut DetectedSsb| {
            ssb.payload.is_none() && ssb.pci == acquired.pci && ssb.ibar_ssb == acquired.ibar_ssb
        };
        for ssb in self.found.iter_mut().filter(same) {
            let before = ssb.sample_start - time;
            ssb.payload = self.decoder.repeated(broadcast.payload, before);
            if let Some(payload) = ssb.payload {
                ssb.lmax = broadcast.lmax;
                ssb.ssb_index = payload.ssb_index;
                ssb.half_frame = Some(payload.half_frame);
            }
        }
    }

    /// Subtracts the SSB. Its channel is estimated without the PSS, which other cells share.
    fn remove(&mut self, alignment: &Alignment) {
        let phases = alignment.symbol_phases();
        let pss = self.acquirer.forget_pss();
        let Acquirer {
            estimate,
            grids,
            reference,
            ..
        } = &mut self.acquirer;
        estimate.fold(grids, reference, &phases);
        estimate.fit(grids, reference);
        reference.put(pss_indices(), pss);
        for (samples, channel) in self.buffer.iter_mut().zip(&estimate.channel) {
            self.canceller
                .subtract(samples, alignment, reference, channel);
        }
    }
}
