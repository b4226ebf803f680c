//! Despreading of received resource elements to one complex amplitude per symbol and antenna.

use num_complex::{Complex32, Complex64};

use crate::dsp::received_grid::{PerAntenna, ReceivedGrid};
use crate::dsp::timing;
use crate::numeric::sums::complex_product;
use crate::standard::grid::{SUBCARRIERS, SYMBOLS, SsbGrid};

/// Computes the blocks and pilot numbers of [`TrackerOutput`](super::TrackerOutput), after the compensation of
/// another `delay` samples.
pub(super) fn despread(
    grids: &[ReceivedGrid],
    reference: &SsbGrid,
    delay: f64,
) -> ([PerAntenna<Complex64>; SYMBOLS], [u16; SYMBOLS]) {
    let ramp = timing::ramp(delay);
    let mut blocks: [PerAntenna<Complex64>; SYMBOLS] = Default::default();
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
        blocks[l].extend(grids.iter().map(|grid| {
            let sum = complex_product(&grid[l], &weights);
            Complex64::new(f64::from(sum.re), f64::from(sum.im)) * scale
        }));
    }
    (blocks, pilots)
}
