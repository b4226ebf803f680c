//! Identification, alignment and equalisation of an SSB, starting from a PSS candidate.

use num_complex::Complex32;

use super::identify::{SssTable, dmrs_hypothesis, pss_statistic};
use crate::dsp::alignment::Alignment;
use crate::dsp::base_rate::SYMBOL_SAMPLES;
use crate::dsp::cfo;
use crate::dsp::channel_estimate::ChannelEstimator;
use crate::dsp::demodulate::Demodulator;
use crate::dsp::matched_filter::PssCandidate;
use crate::dsp::pss_symbol::pss_symbol;
use crate::dsp::received_grid::ReceivedGrid;
use crate::dsp::timing;
use crate::numeric::phasors::wrap;
use crate::standard::coding::rate_matching::E;
use crate::standard::grid::{
    PBCH_LEN, SUBCARRIERS, SYMBOLS, SsbGrid, dmrs_indices, pbch_indices, pss_indices, sss_indices,
};
use crate::standard::pci::Pci;
use crate::standard::sequence::dmrs::dmrs;
use crate::standard::sequence::pss::{SYNC_LEN, pss};
use crate::standard::sequence::sss::sss;

/// Threshold of the SSS statistic: the median of the maximum of 336 unit exponentials is 5.8.
const SSS_FLOOR: f32 = 6.0;
/// Range of the delay search around the maximum of the matched filter, in samples.
const DELAY_REACH: f64 = 2.0;

/// Identified SSB.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Acquired {
    pub(crate) pci: Pci,
    pub(crate) ibar_ssb: u8,
    pub(crate) alignment: Alignment,
    /// Carrier frequency offset estimated within the symbols, in cycles per sample.
    pub(crate) coarse_cfo_cycles: f64,
    /// Sum of the PSS, SSS and DM-RS statistics: in noise the sum of `antennas + 4` unit
    /// exponentials.
    pub(crate) statistic: f32,
}

/// Identifies SSBs, and stores the grids and the channel of the last one.
pub(crate) struct Acquirer {
    sss: SssTable,
    pss_symbols: [Vec<Complex32>; 3],
    pub(crate) demodulator: Demodulator,
    pub(crate) estimate: ChannelEstimator,
    pub(crate) grids: Vec<ReceivedGrid>,
    /// Known resource elements of the SSB.
    pub(crate) reference: SsbGrid,
    base_rate_hz: f64,
    /// Phase step per symbol due to TS 38.211 §5.4, if the SSB's frequency is known.
    carrier_step: Option<f64>,
    /// Minimum PSS statistic with whitened noise.
    pss_floor: f32,
}

impl Acquirer {
    pub(crate) fn new(
        base_rate_hz: f64,
        ssb_freq_hz: Option<f64>,
        antennas: usize,
        pss_floor: f32,
    ) -> Self {
        Self {
            sss: SssTable::new(),
            pss_symbols: [0, 1, 2].map(pss_symbol),
            demodulator: Demodulator::new(),
            estimate: ChannelEstimator::new(antennas),
            grids: vec![[[Complex32::ZERO; SUBCARRIERS]; SYMBOLS]; antennas],
            reference: SsbGrid::zeros(),
            base_rate_hz,
            carrier_step: ssb_freq_hz.map(|hz| cfo::carrier_reset_step(hz, base_rate_hz)),
            pss_floor,
        }
    }

    /// Sets another SSB frequency.
    pub(crate) fn tune(&mut self, ssb_freq_hz: Option<f64>) {
        self.carrier_step = ssb_freq_hz.map(|hz| cfo::carrier_reset_step(hz, self.base_rate_hz));
    }

    /// Identifies the SSB of a candidate; `None` if there is none, or it is incomplete.
    pub(crate) fn acquire<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
        candidate: &PssCandidate,
    ) -> Option<Acquired> {
        let pss_symbol = self.pss_symbols.get(usize::from(candidate.n_id_2))?;
        let hypothesis_cycles = candidate.cfo_hz / self.base_rate_hz;
        let coarse_cfo_cycles =
            cfo::coarse(antennas, candidate.sample, pss_symbol, hypothesis_cycles);
        let mut alignment = Alignment {
            start: candidate.sample,
            delay: 0.0,
            cfo_cycles: coarse_cfo_cycles,
            phase_step: 0.0,
        };
        // The channel estimate for the SSS detection uses the PSS.
        self.add_known_pss(candidate.n_id_2);
        let flat = [Complex32::ONE; SYMBOLS];
        self.demodulator
            .run(antennas, &alignment, &mut self.grids)?;
        if pss_statistic(candidate.n_id_2, &self.grids) < self.pss_floor {
            return None;
        }
        self.estimate.fold(&self.grids, &self.reference, &flat);
        alignment.shift(timing::delay(&self.estimate.rows, DELAY_REACH))?;
        self.demodulator
            .run(antennas, &alignment, &mut self.grids)?;
        self.estimate.fold(&self.grids, &self.reference, &flat);
        self.estimate.fit(&self.grids, &self.reference);
        let cell = self
            .sss
            .identify(candidate.n_id_2, &self.grids, &self.estimate)?;
        if cell.statistic < SSS_FLOOR {
            return None;
        }
        // The channel estimate for the DM-RS detection uses PSS and SSS with aligned phases.
        let pci = cell.hypothesis;
        self.add_known_sss(pci);
        let phases = [
            Complex32::ONE,
            Complex32::ONE,
            cell.phase.conj(),
            Complex32::ONE,
        ];
        self.estimate.fold(&self.grids, &self.reference, &phases);
        self.estimate.fit(&self.grids, &self.reference);
        let beam = dmrs_hypothesis(pci, &self.grids, &self.estimate);
        let ibar_ssb = beam.hypothesis;
        self.add_known_dmrs(pci, ibar_ssb);
        self.align(antennas, &mut alignment)?;
        let statistic = pss_statistic(candidate.n_id_2, &self.grids);
        Some(Acquired {
            pci,
            ibar_ssb,
            alignment,
            coarse_cfo_cycles,
            statistic: statistic + cell.statistic + beam.statistic,
        })
    }

    /// Aligns the SSB with all of `reference`: frequency offset from the phase between symbols,
    /// delay from the phase over the subcarriers, then new grids, channel and noise.
    pub(crate) fn align<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
        alignment: &mut Alignment,
    ) -> Option<()> {
        let mut step = self.phase_step();
        for _ in 0..2 {
            // The grids were demodulated before, and still contain this phase step.
            let phases = Alignment {
                phase_step: step,
                ..*alignment
            }
            .symbol_phases();
            self.estimate.fold(&self.grids, &self.reference, &phases);
            let delay = timing::refine(&self.estimate.rows, 0.0, 3);
            self.estimate.fit(&self.grids, &self.reference);
            step = self.phase_step();
            alignment.phase_step = step;
            if let Some(carrier_step) = self.carrier_step {
                let turn = wrap(step - carrier_step);
                alignment.cfo_cycles += turn / (std::f64::consts::TAU * SYMBOL_SAMPLES as f64);
                alignment.phase_step = carrier_step;
                step = carrier_step;
            }
            alignment.shift(delay)?;
            self.demodulator.run(antennas, alignment, &mut self.grids)?;
        }
        self.estimate
            .fold(&self.grids, &self.reference, &alignment.symbol_phases());
        self.estimate.fit(&self.grids, &self.reference);
        Some(())
    }

    /// Computes the log-likelihood ratios of the 864 PBCH bits, positive for 0: maximum-ratio
    /// combining over the antennas, then `2√2 Re`, `2√2 Im` of `Σ h* y / σ²`.
    pub(crate) fn log_likelihood_ratios(
        &self,
        pci: Pci,
        alignment: &Alignment,
        llrs: &mut [f32; E],
    ) {
        let phases = alignment.symbol_phases();
        let indices: &[usize; PBCH_LEN] = pbch_indices(pci);
        for (pair, index) in llrs.as_chunks_mut::<2>().0.iter_mut().zip(indices) {
            let (symbol, k) = (index / SUBCARRIERS, index % SUBCARRIERS);
            let mut sum = Complex32::ZERO;
            for antenna in 0..self.grids.len() {
                let weight = 1.0 / self.estimate.noise_variance[antenna].max(1e-30);
                let product =
                    self.grids[antenna][symbol][k] * self.estimate.channel[antenna][k].conj();
                sum += product * weight as f32;
            }
            let soft = sum * phases[symbol] * (2.0 * std::f32::consts::SQRT_2);
            // Clamped, so that a recording without noise has finite values.
            *pair = [soft.re.clamp(-1e4, 1e4), soft.im.clamp(-1e4, 1e4)];
        }
    }

    /// Returns the ratio of received power to noise of a resource element, summed over the
    /// antennas.
    pub(crate) fn snr(&self) -> f64 {
        let channels = self
            .estimate
            .channel
            .iter()
            .zip(&self.estimate.noise_variance);
        channels
            .map(|(channel, noise)| {
                let power: f32 = channel.iter().map(Complex32::norm_sqr).sum();
                f64::from(power) / SUBCARRIERS as f64 / noise.max(1e-30)
            })
            .sum()
    }

    fn add_known_pss(&mut self, n_id_2: u8) {
        self.reference.elements_mut().fill(Complex32::ZERO);
        self.reference.put(
            pss_indices(),
            pss(n_id_2).map(|chip| Complex32::new(chip, 0.0)),
        );
    }

    fn add_known_sss(&mut self, pci: Pci) {
        self.reference.put(
            sss_indices(),
            sss(pci).map(|chip| Complex32::new(chip, 0.0)),
        );
    }

    fn add_known_dmrs(&mut self, pci: Pci, ibar_ssb: u8) {
        self.reference.put(*dmrs_indices(pci), dmrs(pci, ibar_ssb));
    }

    /// Adds the decoded and re-encoded PBCH to the known elements.
    pub(crate) fn add_known_pbch(&mut self, pci: Pci, symbols: &[Complex32; PBCH_LEN]) {
        self.reference.put(*pbch_indices(pci), *symbols);
    }

    /// Removes the PSS, which other cells may share, from the known elements and returns it.
    pub(crate) fn remove_known_pss(&mut self) -> [Complex32; SYNC_LEN] {
        let mut pss = [Complex32::ZERO; SYNC_LEN];
        let known = &mut self.reference.elements_mut()[pss_indices()];
        pss.copy_from_slice(known);
        known.fill(Complex32::ZERO);
        pss
    }

    /// Returns the phase step per symbol of the grids, with the last channel estimate.
    fn phase_step(&self) -> f64 {
        cfo::symbol_phase_step(&self.estimate.symbol_pairs(&self.grids, &self.reference))
    }
}
