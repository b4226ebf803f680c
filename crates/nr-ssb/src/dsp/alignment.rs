//! Position of an SSB in time and frequency.

use num_complex::{Complex32, Complex64};

use super::base_rate::{SYMBOL_FFT, SYMBOL_SAMPLES};
use crate::standard::grid::SYMBOLS;

/// Position of an SSB in time and frequency, estimated by the receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Alignment {
    /// First sample of the PSS without cyclic prefix; `delay` is the fraction of a sample after it.
    pub(crate) start: usize,
    pub(crate) delay: f64,
    /// Carrier frequency offset, in cycles per sample.
    pub(crate) cfo_cycles: f64,
    /// Residual phase step per symbol after the offset is removed, in radians.
    pub(crate) phase_step: f64,
}

impl Alignment {
    /// Returns phasors that align the phases of the four symbols.
    pub(crate) fn symbol_phases(&self) -> [Complex32; SYMBOLS] {
        std::array::from_fn(|symbol| {
            let phasor = Complex64::cis(-self.phase_step * symbol as f64);
            Complex32::new(phasor.re as f32, phasor.im as f32)
        })
    }

    /// Shifts the position by `delay` samples; the fraction remains within half a sample.
    pub(crate) fn shift(&mut self, delay: f64) -> Option<()> {
        let total = self.delay + delay;
        let whole = total.round();
        self.delay = total - whole;
        self.start = self.start.checked_add_signed(whole as isize)?;
        Some(())
    }

    /// Returns the first sample of the SSB including its cyclic prefix, as a real number.
    pub(crate) fn first_sample(&self) -> f64 {
        self.start as f64 + self.delay - (SYMBOL_SAMPLES - SYMBOL_FFT) as f64
    }
}
