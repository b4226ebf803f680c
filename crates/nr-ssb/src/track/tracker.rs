//! The tracker of one cell.

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

use crate::dsp::alignment::Alignment;
use crate::dsp::base_rate::{CYCLIC_PREFIX, SYMBOL_SAMPLES};
use crate::dsp::timing;
use crate::numeric::decibel::decibel;
use crate::numeric::false_alarm::exponential_sum_threshold;
use crate::numeric::phasors::wrap;
use crate::numeric::sums::{complex_product, energy, inner_product, real_product};
use crate::receive::acquire::{Acquired, Acquirer};
use crate::receive::broadcast::BroadcastDecoder;
use crate::receive::measure::{Measurement, measure};
use crate::search::{DetectedSsb, SearchConfig, SearchError, Searcher};
use crate::standard::grid::{
    SUBCARRIERS, SYMBOLS, SsbGrid, dmrs_indices, pss_indices, sss_indices,
};
use crate::standard::message::payload::BchPayload;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;
use crate::standard::sequence::dmrs::{DMRS_LEN, dmrs};
use crate::standard::sequence::pss::{SYNC_LEN, pss};
use crate::standard::sequence::sss::sss;

/// Probability that noise at the expected place passes for the cell.
const FALSE_ALARM: f64 = 1e-4;
/// Wander of the frequency offset from one SSB to the next, Hz: oscillator and Doppler.
const CFO_WANDER_HZ: f64 = 5.0;
/// Uncertainty of the frequency offset after the search, Hz.
const CFO_FIRST_HZ: f64 = 200.0;
/// Part of a timing deviation that is taken for a rate error of the clocks.
const DRIFT_GAIN: f64 = 0.2;

/// One SSB of a tracked cell, seen by `A` antennas.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracked<const A: usize> {
    /// The cell.
    pub pci: Pci,
    /// The beam: SSB index, by DM-RS.
    pub ssb_index: u8,
    /// Second half of the frame: by DM-RS at Lmax 4, else by the PBCH if decoded.
    pub half_frame: Option<bool>,
    /// First sample of the SSB, its cyclic prefix included, at the base rate.
    pub sample_start: f64,
    /// Carrier frequency offset after this SSB, filtered, Hz.
    pub cfo_hz: f64,
    /// SNR of a resource element, mean over the antennas, dB.
    pub snr_db: f64,
    /// Per symbol and antenna: received times conjugated pilots, summed over the subcarriers with
    /// the delay taken out, over the root of the pilots' number: the noise keeps the variance it
    /// has on a resource element. In the scale of an unnormalised transform.
    pub blocks: [[Complex64; A]; SYMBOLS],
    /// Samples by which the SSB came later than `received` has it: the delay that is taken out of
    /// the blocks.
    pub residual_delay: f64,
    /// Pilots behind each block: 127, 60, 151, 60; with the PBCH 127, 240, 223, 240.
    pub pilots: [u16; SYMBOLS],
    /// Variance of the noise on a resource element, per antenna.
    pub noise_variance: [f64; A],
    /// SS-RSRP, SS-RSRQ and SS-SINR per antenna.
    pub measurements: [Measurement; A],
    /// What the PBCH says, if it was asked for and its checksum held.
    pub payload: Option<BchPayload>,
    /// The SSB was not where it was expected and was found again by a search.
    pub reacquired: bool,
}

/// What makes tracking impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The window does not hold the SSB.
    #[error(
        "an SSB expected from sample {expected} on does not lie in a window of {samples} from {window_start} on"
    )]
    Window {
        /// First sample of the SSB.
        expected: f64,
        /// First sample of the window.
        window_start: f64,
        /// Samples in the window.
        samples: usize,
    },
    /// As in a search.
    #[error(transparent)]
    Search(#[from] SearchError),
}

/// Tracker of one cell; owns all plans and buffers.
pub struct Tracker<const A: usize> {
    pci: Pci,
    lmax: Lmax,
    base_rate_hz: f64,
    acquirer: Acquirer,
    decoder: BroadcastDecoder,
    searcher: Searcher,
    /// All that is known beforehand, per ī_SSB.
    references: Vec<SsbGrid>,
    /// PSS and SSS.
    chips: [[f32; SYNC_LEN]; 2],
    /// DM-RS per ī_SSB, real and imaginary parts.
    dmrs: Vec<[[f32; DMRS_LEN]; 2]>,
    threshold: f64,
    phase_step: f64,
    cfo_cycles: f64,
    cfo_variance: f64,
    last_start: f64,
    /// Samples per sample that the cell's clock is slow.
    drift: f64,
    misses: u32,
}

impl<const A: usize> Tracker<A> {
    /// Tracks a cell that a search with these settings found.
    ///
    /// # Errors
    /// Those of [`Searcher::new`]; [`SearchError::AntennaCount`] unless the settings are for `A`.
    pub fn new(config: &SearchConfig, cell: &DetectedSsb) -> Result<Self, TrackError> {
        if config.antennas != A {
            let (given, expected) = (config.antennas, A);
            return Err(SearchError::AntennaCount { given, expected }.into());
        }
        let config = SearchConfig {
            lmax: Some(cell.lmax),
            ..config.clone()
        };
        let searcher = Searcher::new(config.clone())?;
        let base_rate_hz = config.spacing.base_rate_hz();
        let pci = cell.pci;
        Ok(Self {
            pci,
            lmax: cell.lmax,
            base_rate_hz,
            acquirer: Acquirer::new(base_rate_hz, config.ssb_freq_hz, A, 0.0),
            decoder: BroadcastDecoder::new(config.spacing, config.lmax, config.ssb_freq_hz),
            searcher,
            references: (0..8).map(|ibar_ssb| pilots(pci, ibar_ssb)).collect(),
            chips: [pss(pci.n_id_2()), sss(pci)],
            dmrs: (0..8)
                .map(|ibar_ssb| dmrs(pci, ibar_ssb))
                .map(|r| [r.map(|r| r.re), r.map(|r| r.im)])
                .collect(),
            threshold: exponential_sum_threshold(A, FALSE_ALARM),
            phase_step: cell.symbol_phase_step_rad,
            cfo_cycles: cell.cfo_hz / base_rate_hz,
            cfo_variance: (CFO_FIRST_HZ / base_rate_hz).powi(2),
            last_start: cell.sample_start,
            drift: 0.0,
            misses: 0,
        })
    }

    /// Where the SSB that follows the last one by `samples` of the cell's clock will begin.
    pub fn expected_start(&self, samples: f64) -> f64 {
        self.last_start + samples * (1.0 + self.drift)
    }

    /// SSBs in a row that were not there.
    pub fn misses(&self) -> u32 {
        self.misses
    }

    /// Looks at the SSB expected to begin at `expected_start`, in a window whose first sample is
    /// number `window_start`. `None` if the cell is not there: not where it was expected, nor, by a
    /// search, anywhere in the window.
    ///
    /// # Errors
    /// [`TrackError::Window`] if the window does not hold the expected SSB,
    /// [`SearchError::UnequalLengths`].
    pub fn track(
        &mut self,
        antennas: &[&[Complex32]; A],
        window_start: f64,
        expected_start: f64,
        decode_pbch: bool,
    ) -> Result<Option<Tracked<A>>, TrackError> {
        let outside = || TrackError::Window {
            expected: expected_start,
            window_start,
            samples: antennas
                .iter()
                .map(|samples| samples.len())
                .min()
                .unwrap_or(0),
        };
        let pss_start = expected_start - window_start + CYCLIC_PREFIX as f64;
        if pss_start.is_nan() || pss_start < 0.0 {
            return Err(outside());
        }
        let alignment = Alignment {
            start: pss_start.round() as usize,
            delay: pss_start - pss_start.round(),
            cfo_cycles: self.cfo_cycles,
            phase_step: self.phase_step,
        };
        let Acquirer {
            demodulator, grids, ..
        } = &mut self.acquirer;
        demodulator
            .run(antennas, &alignment, grids)
            .ok_or_else(outside)?;
        let mut seen = self.look(alignment, decode_pbch);
        if seen.is_none() {
            seen = self.reacquire(antennas, decode_pbch)?;
        }
        let Some(tracked) = &mut seen else {
            self.misses += 1;
            return Ok(None);
        };
        self.misses = 0;
        tracked.sample_start += window_start;
        let elapsed = tracked.sample_start - self.last_start;
        if !tracked.reacquired && elapsed > 0.5 * self.base_rate_hz * 5e-3 {
            self.drift += DRIFT_GAIN * (tracked.sample_start - expected_start) / elapsed;
        }
        self.last_start = tracked.sample_start;
        Ok(seen)
    }

    /// Received resource elements of one antenna, `[symbol][subcarrier]`, of the last SSB, delay
    /// and frequency offset as predicted taken out; [`Tracked::residual_delay`] is left.
    pub fn received(&self, antenna: usize) -> Option<&[[Complex32; SUBCARRIERS]; SYMBOLS]> {
        self.acquirer.grids.get(antenna)
    }

    /// The resource elements known in the last SSB, zero elsewhere: least squares is
    /// [`received`](Self::received) times their conjugate.
    pub fn known(&self) -> &SsbGrid {
        &self.acquirer.reference
    }

    /// Everything from the demodulated grids on.
    fn look(&mut self, mut alignment: Alignment, decode_pbch: bool) -> Option<Tracked<A>> {
        let phases = alignment.symbol_phases();
        let ibar_ssb = self.identify(&phases)?;
        self.acquirer
            .reference
            .clone_from(self.references.get(usize::from(ibar_ssb))?);
        let mut payload = None;
        if decode_pbch {
            payload = self.decode(ibar_ssb, alignment);
        }
        let Acquirer {
            estimate,
            grids,
            reference,
            ..
        } = &mut self.acquirer;
        estimate.fold(grids, reference, &phases);
        estimate.estimate_noise();
        let delay = timing::refine_combined(&estimate.rows);
        let (blocks, pilots) = despread(grids, reference, delay);
        let noise_variance = std::array::from_fn(|antenna| estimate.noise_variance[antenna]);
        // Samples that are no numbers, or beyond all bounds, must not reach what is kept.
        if !(blocks.iter().flatten().all(|block| block.is_finite())
            && noise_variance.iter().all(|noise| noise.is_finite()))
        {
            return None;
        }
        alignment.shift(delay)?;
        let known: f64 = pilots.iter().map(|count| f64::from(*count)).sum();
        let mut snr = 0.0;
        let measurements = std::array::from_fn(|antenna| {
            let energy: f64 = blocks.iter().map(|block| block[antenna].norm_sqr()).sum();
            let noise = noise_variance[antenna];
            let power = ((energy - SYMBOLS as f64 * noise) / known).max(0.0);
            snr += power / noise.max(1e-30) / A as f64;
            measure(&grids[antenna], power, noise)
        });
        self.follow_frequency(&blocks, &noise_variance);
        let half_frame = match (payload, self.lmax) {
            (Some(BchPayload { half_frame, .. }), _) => Some(half_frame),
            (None, Lmax::L4) => Some(ibar_ssb >= 4),
            (None, _) => None,
        };
        Some(Tracked {
            pci: self.pci,
            ssb_index: self.lmax.index_lsb(ibar_ssb),
            half_frame,
            sample_start: alignment.first_sample(),
            cfo_hz: self.cfo_cycles * self.base_rate_hz,
            snr_db: decibel(snr),
            blocks,
            residual_delay: delay,
            pilots,
            noise_variance,
            measurements,
            payload,
            reacquired: false,
        })
    }

    /// ī_SSB, if PSS and SSS say that the cell is there.
    fn identify(&self, phases: &[Complex32; SYMBOLS]) -> Option<u8> {
        let grids = &self.acquirer.grids;
        let mut statistic = 0.0;
        let mut combined = [Complex32::ZERO; DMRS_LEN];
        for grid in grids {
            // PSS and SSS lie on the same subcarriers of their symbols.
            let mut gain = Complex32::ZERO;
            let mut power = 0.0_f32;
            for (l, chips) in [0, 2].into_iter().zip(&self.chips) {
                let received = grid[l].get(pss_indices())?.first_chunk::<SYNC_LEN>()?;
                gain += real_product(received, chips) * phases[l];
                power += energy(received);
            }
            // |Σ|²/N against the energy that it leaves over: noise whatever the channel's level.
            let explained = gain.norm_sqr() / (2 * SYNC_LEN) as f32;
            let noise = ((power - explained) / (2 * SYNC_LEN - 1) as f32).max(f32::MIN_POSITIVE);
            statistic += f64::from(explained / noise);
            let weight = gain.conj() / noise;
            for (slot, index) in combined.iter_mut().zip(dmrs_indices(self.pci)) {
                let l = index / SUBCARRIERS;
                *slot += grid[l][index % SUBCARRIERS] * phases[l] * weight;
            }
        }
        if statistic.is_nan() || statistic <= self.threshold {
            return None;
        }
        let (re, im) = (combined.map(|w| w.re), combined.map(|w| w.im));
        let fit = |[real, imaginary]: &[[f32; DMRS_LEN]; 2]| {
            inner_product(&re, real) + inner_product(&im, imaginary)
        };
        let fits = self.dmrs.iter().map(fit).zip(0..);
        fits.max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, ibar_ssb)| ibar_ssb)
    }

    /// Decodes the PBCH and adds it to what is known.
    fn decode(&mut self, ibar_ssb: u8, alignment: Alignment) -> Option<BchPayload> {
        let Acquirer {
            estimate,
            grids,
            reference,
            ..
        } = &mut self.acquirer;
        estimate.fold(grids, reference, &alignment.symbol_phases());
        estimate.fit(grids, reference);
        let acquired = Acquired {
            pci: self.pci,
            ibar_ssb,
            alignment,
            coarse_cfo_cycles: alignment.cfo_cycles,
            statistic: 0.0,
        };
        let broadcast = self.decoder.decode(&self.acquirer, &acquired)?;
        self.acquirer.know_pbch(self.pci, &broadcast.symbols);
        Some(broadcast.payload)
    }

    /// Moves the frequency offset by the PSS–SSS phase, weighted by what noise leaves of it.
    fn follow_frequency(&mut self, blocks: &[[Complex64; A]; SYMBOLS], noise: &[f64; A]) {
        let (mut turn, mut snr) = (Complex64::ZERO, 0.0);
        for antenna in 0..A {
            let weight = 1.0 / noise[antenna].max(1e-30);
            let (pss, sss) = (blocks[0][antenna], blocks[2][antenna]);
            turn += pss.conj() * sss * weight;
            snr += (0.5 * (pss.norm_sqr() + sss.norm_sqr()) * weight - 1.0).max(0.1);
        }
        let base = TAU * 2.0 * SYMBOL_SAMPLES as f64;
        let measured = wrap(turn.arg() - 2.0 * self.phase_step) / base;
        let variance = 1.0 / (snr * base * base);
        self.cfo_variance += (CFO_WANDER_HZ / self.base_rate_hz).powi(2);
        let gain = self.cfo_variance / (self.cfo_variance + variance);
        self.cfo_cycles += gain * measured;
        self.cfo_variance *= 1.0 - gain;
    }

    /// Searches the whole window for the cell.
    fn reacquire(
        &mut self,
        antennas: &[&[Complex32]; A],
        decode_pbch: bool,
    ) -> Result<Option<Tracked<A>>, TrackError> {
        let found = match self.searcher.search(antennas) {
            Ok(found) => found,
            Err(SearchError::TooShort { .. }) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let Some(cell) = found.iter().find(|ssb| ssb.pci == self.pci) else {
            return Ok(None);
        };
        let mut alignment = Alignment {
            start: 0,
            delay: 0.0,
            cfo_cycles: cell.cfo_hz / self.base_rate_hz,
            phase_step: cell.symbol_phase_step_rad,
        };
        self.cfo_cycles = alignment.cfo_cycles;
        self.cfo_variance = (CFO_FIRST_HZ / self.base_rate_hz).powi(2);
        self.phase_step = alignment.phase_step;
        if alignment
            .shift(cell.sample_start + CYCLIC_PREFIX as f64)
            .is_none()
        {
            return Ok(None);
        }
        let Acquirer {
            demodulator, grids, ..
        } = &mut self.acquirer;
        if demodulator.run(antennas, &alignment, grids).is_none() {
            return Ok(None);
        }
        let seen = self.look(alignment, decode_pbch);
        Ok(seen.map(|tracked| Tracked {
            reacquired: true,
            ..tracked
        }))
    }
}

/// PSS, SSS and DM-RS of one SSB.
fn pilots(pci: Pci, ibar_ssb: u8) -> SsbGrid {
    let real = |chip| Complex32::new(chip, 0.0);
    let mut grid = SsbGrid::zeros();
    grid.put(pss_indices(), pss(pci.n_id_2()).map(real));
    grid.put(sss_indices(), sss(pci).map(real));
    grid.put(*dmrs_indices(pci), dmrs(pci, ibar_ssb));
    grid
}

/// Blocks and numbers of pilots of [`Tracked`], with `delay` samples more taken out.
fn despread<const A: usize>(
    grids: &[[[Complex32; SUBCARRIERS]; SYMBOLS]],
    reference: &SsbGrid,
    delay: f64,
) -> ([[Complex64; A]; SYMBOLS], [u16; SYMBOLS]) {
    let ramp = timing::ramp(delay);
    let mut blocks = [[Complex64::ZERO; A]; SYMBOLS];
    let mut pilots = [0; SYMBOLS];
    for (l, known) in reference.symbols().enumerate() {
        let mut weights = [Complex32::ZERO; SUBCARRIERS];
        let mut energy = 0.0_f32;
        for ((weight, s), phasor) in weights.iter_mut().zip(known).zip(&ramp) {
            *weight = s.conj() * phasor;
            energy += s.norm_sqr();
        }
        pilots[l] = energy.round() as u16;
        let scale = 1.0 / f64::from(energy.max(1.0)).sqrt();
        for (slot, grid) in blocks[l].iter_mut().zip(grids) {
            let sum = complex_product(&grid[l], &weights);
            *slot = Complex64::new(f64::from(sum.re), f64::from(sum.im)) * scale;
        }
    }
    (blocks, pilots)
}
