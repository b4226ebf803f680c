//! Known resource elements of a cell's SSBs, and identification of the received beam.

use num_complex::Complex32;

use super::late::{DelaySearch, Groups, INDEPENDENT, grouped, ramp};
use crate::dsp::base_rate::SYMBOL_FFT;
use crate::dsp::received_grid::ReceivedGrid;
use crate::numeric::false_alarm::exponential_sum_threshold;
use crate::numeric::phasors::fill_phasors;
use crate::numeric::sums::{complex_product, energy, inner_product};
use crate::standard::grid::{
    SUBCARRIERS, SYMBOLS, SsbGrid, dmrs_indices, pss_indices, sss_indices,
};
use crate::standard::pci::Pci;
use crate::standard::sequence::dmrs::{DMRS_LEN, dmrs};
use crate::standard::sequence::pss::{SYNC_LEN, pss};
use crate::standard::sequence::sss::sss;

/// Probability that noise at the expected position is accepted as the cell.
const FALSE_ALARM: f64 = 1e-4;
/// Minimum statistic of the identified beam's DM-RS, in standard deviations of chance: 17 without
/// noise, and exceeded by chance once in 6 million.
const BEAM_STANDS_OUT: f32 = 5.5;

/// Relative rounding error of the energy of a signal without noise.
const ROUNDING: f32 = 1e-6;

/// Received beam, and its delay in samples relative to the grids.
#[derive(Debug, Clone, Copy)]
pub(super) struct BeamDetection {
    pub(super) ibar_ssb: u8,
    pub(super) delay: f64,
}

/// Pilots of a cell's beams.
pub(super) struct Beams {
    pci: Pci,
    /// Known elements for each ī_SSB.
    references: Vec<SsbGrid>,
    /// PSS and SSS.
    chips: [[f32; SYNC_LEN]; 2],
    /// DM-RS for each ī_SSB, real and imaginary parts.
    dmrs: Vec<[[f32; DMRS_LEN]; 2]>,
    delays: DelaySearch,
    /// Despread PSS and SSS with their energies, for each antenna.
    sync: Vec<Groups>,
    energies: Vec<f32>,
    threshold: f64,
}

impl Beams {
    /// Creates the pilots of a cell for a number of antennas.
    pub(super) fn new(pci: Pci, antennas: usize) -> Self {
        Self {
            pci,
            references: (0..8).map(|ibar_ssb| pilots(pci, ibar_ssb)).collect(),
            chips: [pss(pci.n_id_2()), sss(pci)],
            dmrs: (0..8)
                .map(|ibar_ssb| dmrs(pci, ibar_ssb))
                .map(|r| [r.map(|r| r.re), r.map(|r| r.im)])
                .collect(),
            delays: DelaySearch::new(),
            sync: vec![Groups::default(); antennas],
            energies: vec![0.0; antennas],
            threshold: exponential_sum_threshold(antennas, FALSE_ALARM / INDEPENDENT),
        }
    }

    /// Returns PSS, SSS and DM-RS of a beam.
    pub(super) fn reference(&self, ibar_ssb: u8) -> Option<&SsbGrid> {
        self.references.get(usize::from(ibar_ssb))
    }

    /// Returns beam and delay of an SSB, if PSS and SSS confirm the cell and the DM-RS identifies
    /// the beam.
    pub(super) fn identify(
        &mut self,
        grids: &[ReceivedGrid],
        phases: &[Complex32; SYMBOLS],
    ) -> Option<BeamDetection> {
        // PSS and SSS are on the same subcarriers of their symbols.
        let outputs = self.sync.iter_mut().zip(&mut self.energies);
        for (grid, (groups, power)) in grids.iter().zip(outputs) {
            let pss = grid[0].get(pss_indices())?.first_chunk::<SYNC_LEN>()?;
            let sss = grid[2].get(pss_indices())?.first_chunk::<SYNC_LEN>()?;
            let [pss_chips, sss_chips] = &self.chips;
            let sums = grouped(pss, pss_chips)
                .into_iter()
                .zip(grouped(sss, sss_chips));
            for (sum, (a, b)) in groups.iter_mut().zip(sums) {
                *sum = a * phases[0] + b * phases[2];
            }
            *power = energy(pss) + energy(sss);
        }
        let delay = self.delays.run(&self.sync);
        let sync_ramp = ramp(delay);
        let mut statistic = 0.0;
        let mut combined = [Complex32::ZERO; DMRS_LEN];
        for (grid, (groups, power)) in grids.iter().zip(self.sync.iter().zip(&self.energies)) {
            // |Σ|²/N relative to the residual energy: independent of the power of the channel.
            let gain = complex_product(groups, &sync_ramp);
            let explained = gain.norm_sqr() / (2 * SYNC_LEN) as f32;
            let left = (power - explained).max(ROUNDING * power);
            let noise = (left / (2 * SYNC_LEN - 1) as f32).max(f32::MIN_POSITIVE);
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
        // The DM-RS is on every fourth subcarrier.
        let mut undelayed = [Complex32::ZERO; SUBCARRIERS / 4];
        let cycles = delay / SYMBOL_FFT as f64;
        let first = f64::from(self.pci.get() % 4) - 120.0;
        fill_phasors(&mut undelayed, first * cycles, 4.0 * cycles);
        for (slot, index) in combined.iter_mut().zip(dmrs_indices(self.pci)) {
            *slot *= undelayed[index % SUBCARRIERS / 4];
        }
        let by_chance = (0.5 * energy(&combined)).sqrt();
        let (re, im) = (combined.map(|w| w.re), combined.map(|w| w.im));
        let fit = |[real, imaginary]: &[[f32; DMRS_LEN]; 2]| {
            inner_product(&re, real) + inner_product(&im, imaginary)
        };
        let fits = self.dmrs.iter().map(fit).zip(0..);
        let (best, ibar_ssb) = fits.max_by(|a, b| a.0.total_cmp(&b.0))?;
        (best > BEAM_STANDS_OUT * by_chance).then_some(BeamDetection { ibar_ssb, delay })
    }
}

/// Returns PSS, SSS and DM-RS of one SSB.
fn pilots(pci: Pci, ibar_ssb: u8) -> SsbGrid {
    let real = |chip| Complex32::new(chip, 0.0);
    let mut grid = SsbGrid::zeros();
    grid.put(pss_indices(), pss(pci.n_id_2()).map(real));
    grid.put(sss_indices(), sss(pci).map(real));
    grid.put(*dmrs_indices(pci), dmrs(pci, ibar_ssb));
    grid
}
