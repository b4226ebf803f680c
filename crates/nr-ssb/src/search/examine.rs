//! Examination of a candidate: identification, decoding, measurement and subtraction of its SSB.

use std::f32::consts::SQRT_2;

use num_complex::Complex32;

use super::detected::{DetectedSsb, ReceivedElements, SearchCounts};
use super::settings::SearchConfig;
use crate::dsp::alignment::Alignment;
use crate::dsp::base_rate::{CYCLIC_PREFIX, SSB_SAMPLES};
use crate::dsp::cancel::Canceller;
use crate::dsp::matched_filter::PssCandidate;
use crate::dsp::received_grid::{MAX_ANTENNAS, ReceivedGrid};
use crate::numeric::decibel::decibel;
use crate::one_ssb::acquire::{Acquired, Acquirer};
use crate::one_ssb::broadcast::{Broadcast, BroadcastDecoder};
use crate::one_ssb::measure::{Measurement, measure, sss_power};
use crate::standard::grid::{SUBCARRIERS, pss_indices};
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;
use crate::standard::sequence::pss::SYNC_LEN;

/// Fraction of the cell threshold above which the PBCH is decoded.
const DECODE_FLOOR: f32 = 0.7;
/// SNR after combining above which a PBCH is always decodable (its block error rate is 1 % at −8
/// dB). A stronger "cell" without a decodable PBCH, overlapping another SSB, is a residue of that
/// SSB.
const CERTAIN_DECODE_SNR_DB: f64 = -2.0;
/// Minimum power ratio of a stronger cell to its residue, in dB. A residue is a cell without a
/// decodable PBCH that has the time and the PSS of the stronger cell. A cell clipped at 0.3 to 1.5
/// times its RMS amplitude leaves an apparent cell 15.4 to 31 dB below it
/// (`tests/all/distorted.rs`).
const RESIDUE_DB: f64 = 15.0;
/// Maximum distance of a residue from the stronger cell, in samples.
const RESIDUE_SAMPLES: f64 = 1.0;
/// Maximum distance of two detections of one SSB, in samples.
const SAME_SSB_SAMPLES: f64 = CYCLIC_PREFIX as f64;

/// Examines candidates, and stores the SSBs of a block.
pub(super) struct Examiner {
    antennas: usize,
    base_rate_hz: f64,
    /// Central carrier frequency offset of the search, in Hz.
    centre_hz: f64,
    /// Maximum distance of a carrier frequency offset from the central one, in Hz.
    tolerated_hz: f64,
    cell_threshold: f32,
    acquirer: Acquirer,
    decoder: BroadcastDecoder,
    canceller: Canceller,
    found: Vec<DetectedSsb>,
    counts: SearchCounts,
    /// Last SSBs of the previous block, to recognise repeated detections.
    recent: Vec<(Pci, f64)>,
}

impl Examiner {
    /// Creates an examiner. Candidates with a PSS statistic below `pss_floor` or a total statistic
    /// below `cell_threshold` are rejected.
    pub(super) fn new(config: &SearchConfig, pss_floor: f32, cell_threshold: f32) -> Self {
        let &SearchConfig {
            spacing,
            antennas,
            ssb_freq_hz,
            lmax,
            cfo_centre_hz,
            cfo_range_hz,
            ..
        } = config;
        let base_rate_hz = spacing.base_rate_hz();
        Self {
            antennas,
            base_rate_hz,
            centre_hz: cfo_centre_hz,
            tolerated_hz: cfo_range_hz + spacing.hz() / 6.0,
            cell_threshold,
            acquirer: Acquirer::new(base_rate_hz, ssb_freq_hz, antennas, pss_floor),
            decoder: BroadcastDecoder::new(spacing, lmax, ssb_freq_hz),
            canceller: Canceller::new(),
            found: Vec::new(),
            counts: SearchCounts::default(),
            recent: Vec::new(),
        }
    }

    /// Sets another SSB frequency.
    pub(super) fn tune(&mut self, ssb_freq_hz: Option<f64>) {
        self.acquirer.tune(ssb_freq_hz);
        self.decoder.tune(ssb_freq_hz);
    }

    /// Sets another central carrier frequency offset.
    pub(super) fn centre(&mut self, cfo_centre_hz: f64) {
        self.centre_hz = cfo_centre_hz;
    }

    /// Removes the state of the stream.
    pub(super) fn forget(&mut self) {
        self.found.clear();
        self.recent.clear();
        self.decoder.forget();
    }

    /// Starts a block at sample `block_start`, and keeps the previous SSBs close to its start.
    pub(super) fn begin_block(&mut self, block_start: f64) {
        self.counts = SearchCounts::default();
        self.recent.clear();
        let near = self
            .found
            .iter()
            .filter(|ssb| ssb.sample_start > block_start - SAME_SSB_SAMPLES);
        self.recent
            .extend(near.map(|ssb| (ssb.pci, ssb.sample_start)));
        self.found.clear();
    }

    /// Returns the SSBs of this block, in order of time.
    pub(super) fn found_in_order(&mut self) -> &[DetectedSsb] {
        self.settle_lmax();
        self.found
            .sort_unstable_by(|a, b| a.sample_start.total_cmp(&b.sample_start));
        &self.found
    }

    /// Applies the burst set size of one SSB of a cell to all its SSBs.
    fn settle_lmax(&mut self) {
        for index in 0..self.found.len() {
            let DetectedSsb { pci, lmax, .. } = self.found[index];
            if lmax.is_some() {
                let open = |ssb: &&mut DetectedSsb| ssb.pci == pci && ssb.lmax.is_none();
                self.found
                    .iter_mut()
                    .filter(open)
                    .for_each(|ssb| ssb.lmax = lmax);
            }
        }
    }

    /// Returns the number of candidates at each stage in this block.
    pub(super) fn counts(&self) -> SearchCounts {
        self.counts
    }

    /// Identifies, decodes, measures and subtracts the SSB of a candidate.
    ///
    /// The samples are those of a block, for each antenna; the index of the first sample is
    /// `block_start`.
    pub(super) fn examine(
        &mut self,
        (samples, block_start): (&mut [Vec<Complex32>], f64),
        candidate: &PssCandidate,
        inspect: &mut dyn FnMut(&DetectedSsb, &ReceivedElements<'_>),
    ) -> Option<Alignment> {
        self.counts.pss_candidates += 1;
        let mut acquired = self.acquirer.acquire(samples, candidate)?;
        let cfo_hz = acquired.alignment.cfo_cycles * self.base_rate_hz;
        if (cfo_hz - self.centre_hz).abs() > self.tolerated_hz {
            return None;
        }
        let time = block_start + acquired.alignment.first_sample();
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
            if acquired.statistic < self.cell_threshold
                || self.acquirer.snr() > certain && self.is_overlaid(time)
            {
                return None;
            }
            broadcast = self.decoder.combine(&acquired, time);
            if broadcast.is_none() && self.is_residue(acquired.pci, time) {
                return None;
            }
        }
        if let Some(broadcast) = &broadcast {
            self.acquirer
                .add_known_pbch(acquired.pci, &broadcast.symbols);
            self.acquirer.align(samples, &mut acquired.alignment)?;
            self.complete_earlier(&acquired, broadcast, time);
        }
        self.report(block_start, &acquired, broadcast.as_ref());
        if let Some(ssb) = self.found.last() {
            let received = ReceivedElements {
                channel_covariance: &self.acquirer.estimate.covariance(),
                elements: &self.acquirer.grids,
                known: &self.acquirer.reference,
                channel: &self.acquirer.estimate.channel,
                noise_variance: &self.acquirer.estimate.noise_variance,
            };
            inspect(ssb, &received);
        }
        self.remove(samples, &acquired.alignment);
        Some(acquired.alignment)
    }

    /// Whether an SSB that begins at `time` overlaps a detected one.
    fn is_overlaid(&self, time: f64) -> bool {
        let found = self.found.iter().map(|ssb| ssb.sample_start);
        let mut starts = found.chain(self.recent.iter().map(|(_, start)| *start));
        starts.any(|start| (start - time).abs() < SSB_SAMPLES as f64)
    }

    /// Whether an SSB may be the residue of a clipped or otherwise distorted stronger SSB: same
    /// PSS, same time, and far weaker.
    fn is_residue(&self, pci: Pci, time: f64) -> bool {
        let snr_db = decibel(self.acquirer.snr() / self.antennas as f64);
        self.found.iter().any(|ssb| {
            ssb.pci.n_id_2() == pci.n_id_2()
                && (ssb.sample_start - time).abs() < RESIDUE_SAMPLES
                && ssb.snr_db > snr_db + RESIDUE_DB
        })
    }

    fn report(&mut self, block_start: f64, acquired: &Acquired, broadcast: Option<&Broadcast>) {
        let alignment = &acquired.alignment;
        let antennas = self.antennas;
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
        let lmax = broadcast.map_or_else(|| self.decoder.certain_lmax(), |it| it.lmax);
        let payload = broadcast.map(|broadcast| broadcast.payload);
        let half_frame = match (payload, lmax) {
            (Some(payload), _) => Some(payload.half_frame),
            (None, Some(Lmax::L4)) => Some(acquired.ibar_ssb >= 4),
            (None, _) => None,
        };
        let by_dmrs = lmax
            .unwrap_or(self.decoder.likely_lmax())
            .index_lsb(acquired.ibar_ssb);
        self.found.push(DetectedSsb {
            pci: acquired.pci,
            ibar_ssb: acquired.ibar_ssb,
            ssb_index: payload.map_or(by_dmrs, |payload| payload.ssb_index),
            half_frame,
            lmax,
            payload,
            sample_start: block_start + alignment.first_sample(),
            cfo_hz: alignment.cfo_cycles * self.base_rate_hz,
            symbol_phase_step_rad: alignment.phase_step,
            snr_db: decibel(self.acquirer.snr() / antennas as f64),
            statistic: acquired.statistic,
            coarse_cfo_hz: acquired.coarse_cfo_cycles * self.base_rate_hz,
            measurements,
            antennas,
        });
    }

    /// Completes earlier SSBs of the same beam, which were not decodable alone, with the message
    /// implied for their time.
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

    /// Subtracts the SSB. Its channel estimate does not use the PSS, which other cells may share.
    fn remove(&mut self, samples: &mut [Vec<Complex32>], alignment: &Alignment) {
        let phases = alignment.symbol_phases();
        let pss = self.acquirer.remove_known_pss();
        let Acquirer {
            estimate,
            grids,
            reference,
            ..
        } = &mut self.acquirer;
        estimate.fold(grids, reference, &phases);
        estimate.fit(grids, reference);
        let amplitude = pss_amplitude(grids, &estimate.channel, &pss);
        reference.put(pss_indices(), pss.map(|chip| chip * amplitude));
        for (samples, channel) in samples.iter_mut().zip(&estimate.channel) {
            self.canceller
                .subtract(samples, alignment, reference, channel);
        }
    }
}

/// Returns the amplitude of the PSS relative to the rest of its SSB: 0 dB or 3 dB, the values of TS
/// 38.213 §4.1. Other values are excluded, because they would subtract parts of another cell's
/// identical PSS.
fn pss_amplitude(
    grids: &[ReceivedGrid],
    channels: &[[Complex32; SUBCARRIERS]],
    pss: &[Complex32; SYNC_LEN],
) -> f32 {
    let (mut matched, mut power) = (0.0, 0.0);
    for (grid, channel) in grids.iter().zip(channels) {
        let received = &grid[0][pss_indices()];
        for ((y, h), chip) in received.iter().zip(&channel[pss_indices()]).zip(pss) {
            let expected = h * chip;
            matched += (y * expected.conj()).re;
            power += expected.norm_sqr();
        }
    }
    let middle = 0.5 * (1.0 + SQRT_2);
    if matched > middle * power {
        SQRT_2
    } else {
        1.0
    }
}
