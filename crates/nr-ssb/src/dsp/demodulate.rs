//! Demodulation of the SSB's resource elements from samples at the base rate, for all antennas.

use std::sync::Arc;

use num_complex::Complex32;

use super::alignment::Alignment;
use super::base_rate::{CYCLIC_PREFIX, SSB_SAMPLES, SYMBOL_FFT, SYMBOL_SAMPLES};
use super::received_grid::ReceivedGrid;
use crate::numeric::fft::{self, Fft};
use crate::numeric::phasors::fill_phasors;
use crate::standard::grid::SUBCARRIERS;

/// Shift of the FFT window into the cyclic prefix, which avoids interference of the neighbouring
/// symbol for paths before the strongest one and timing errors of one sample.
pub(crate) const BACK_OFF: usize = 6;

/// OFDM demodulator for SSBs: four FFTs per antenna.
pub struct Demodulator {
    fft: Arc<dyn Fft<f32>>,
    window: Vec<Complex32>,
    scratch: Vec<Complex32>,
    derotation: Vec<Complex32>,
    ramp: [Complex32; SUBCARRIERS],
}

impl Demodulator {
    /// Creates the FFT plan.
    pub fn new() -> Self {
        let fft = fft::forward(SYMBOL_FFT);
        let scratch = fft.get_inplace_scratch_len();
        Self {
            fft,
            window: vec![Complex32::ZERO; SYMBOL_FFT],
            scratch: vec![Complex32::ZERO; scratch],
            derotation: vec![Complex32::ZERO; SSB_SAMPLES],
            ramp: [Complex32::ZERO; SUBCARRIERS],
        }
    }

    /// Demodulates the resource elements of an aligned SSB. The carrier offset is compensated in
    /// the time domain, the fractional delay as a phase ramp over the subcarriers. The phase step
    /// between symbols remains. The scale is that of an unnormalised DFT: a tone of amplitude one
    /// has 256.
    ///
    /// Returns `None` without changing the grids if the SSB is not completely within the samples.
    pub(crate) fn run<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
        alignment: &Alignment,
        grids: &mut [ReceivedGrid],
    ) -> Option<()> {
        let Alignment {
            start,
            delay,
            cfo_cycles,
            ..
        } = *alignment;
        let first = start.checked_sub(CYCLIC_PREFIX)?;
        let end = first.checked_add(SSB_SAMPLES)?;
        if antennas.iter().any(|samples| samples.as_ref().len() < end) {
            return None;
        }
        fill_phasors(
            &mut self.derotation,
            CYCLIC_PREFIX as f64 * cfo_cycles,
            -cfo_cycles,
        );
        // Subcarrier 120 is at 0 Hz; the window begins BACK_OFF samples before the symbol.
        let cycles = (BACK_OFF as f64 + delay) / SYMBOL_FFT as f64;
        fill_phasors(&mut self.ramp, -120.0 * cycles, cycles);

        for (samples, grid) in antennas.iter().zip(grids) {
            for (symbol, row) in grid.iter_mut().enumerate() {
                let offset = symbol * SYMBOL_SAMPLES + CYCLIC_PREFIX - BACK_OFF;
                let source = &samples.as_ref()[first + offset..][..SYMBOL_FFT];
                let rotation = &self.derotation[offset..][..SYMBOL_FFT];
                for ((slot, sample), phasor) in self.window.iter_mut().zip(source).zip(rotation) {
                    *slot = sample * phasor;
                }
                self.fft
                    .process_with_scratch(&mut self.window, &mut self.scratch);
                let (negative, positive) = row.split_at_mut(120);
                let lower = self.window[SYMBOL_FFT - 120..].iter().zip(&self.ramp);
                for (slot, (bin, phasor)) in negative.iter_mut().zip(lower) {
                    *slot = bin * phasor;
                }
                let upper = self.window[..120].iter().zip(&self.ramp[120..]);
                for (slot, (bin, phasor)) in positive.iter_mut().zip(upper) {
                    *slot = bin * phasor;
                }
            }
        }
        Some(())
    }
}

impl Default for Demodulator {
    fn default() -> Self {
        Self::new()
    }
}
