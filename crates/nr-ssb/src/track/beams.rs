//! What is known of a cell's SSBs beforehand, and which of them was received.

use num_complex::Complex32;

use crate::dsp::received_grid::ReceivedGrid;
use crate::numeric::false_alarm::exponential_sum_threshold;
use crate::numeric::sums::{energy, inner_product, real_product};
use crate::standard::grid::{
    SUBCARRIERS, SYMBOLS, SsbGrid, dmrs_indices, pss_indices, sss_indices,
};
use crate::standard::pci::Pci;
use crate::standard::sequence::dmrs::{DMRS_LEN, dmrs};
use crate::standard::sequence::pss::{SYNC_LEN, pss};
use crate::standard::sequence::sss::sss;

/// Probability that noise at the expected place passes for the cell.
const FALSE_ALARM: f64 = 1e-4;

/// The pilots of one cell's beams.
pub(super) struct Beams {
    pci: Pci,
    /// All that is known beforehand, per ī_SSB.
    references: Vec<SsbGrid>,
    /// PSS and SSS.
    chips: [[f32; SYNC_LEN]; 2],
    /// DM-RS per ī_SSB, real and imaginary parts.
    dmrs: Vec<[[f32; DMRS_LEN]; 2]>,
    threshold: f64,
}

impl Beams {
    /// The beams of this cell, to be received with so many antennas.
    pub(super) fn new(pci: Pci, antennas: usize) -> Self {
        Self {
            pci,
            references: (0..8).map(|ibar_ssb| pilots(pci, ibar_ssb)).collect(),
            chips: [pss(pci.n_id_2()), sss(pci)],
            dmrs: (0..8)
                .map(|ibar_ssb| dmrs(pci, ibar_ssb))
                .map(|r| [r.map(|r| r.re), r.map(|r| r.im)])
                .collect(),
            threshold: exponential_sum_threshold(antennas, FALSE_ALARM),
        }
    }

    /// PSS, SSS and DM-RS of a beam.
    pub(super) fn reference(&self, ibar_ssb: u8) -> Option<&SsbGrid> {
        self.references.get(usize::from(ibar_ssb))
    }

    /// ī_SSB, if PSS and SSS say that the cell is there.
    pub(super) fn identify(
        &self,
        grids: &[ReceivedGrid],
        phases: &[Complex32; SYMBOLS],
    ) -> Option<u8> {
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
