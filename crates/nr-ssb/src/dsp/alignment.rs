//! Where an SSB lies in time and frequency.

use num_complex::{Complex32, Complex64};

use super::base_rate::{SYMBOL_FFT, SYMBOL_SAMPLES};
use crate::standard::grid::SYMBOLS;

/// Where an SSB lies in time and frequency, as the receiver found it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Alignment {
    /// First sample of the PSS without cyclic prefix, and the fraction beyond it.
    pub(crate) start: usize,
    pub(crate) delay: f64,
    /// Carrier frequency offset, cycles per sample.
    pub(crate) cfo_cycles: f64,
    /// Phase from symbol to symbol that remains once the offset is taken out, radians.
    pub(crate) phase_step: f64,
}

impl Alignment {
    /// Phasors that bring the four symbols to one phase.
    pub(crate) fn symbol_phases(&self) -> [Complex32; SYMBOLS] {
        std::array::from_fn(|symbol| {
            let phasor = Complex64::cis(-self.phase_step * symbol as f64);
            Complex32::new(phasor.re as f32, phasor.im as f32)
        })
    }

    /// Moves by `delay` samples, keeping the fraction within half a sample.
    pub(crate) fn shift(&mut self, delay: f64) -> Option<()> {
        let total = self.delay + delay;
        let whole = total.round();
        self.delay = total - whole;
        self.start = self.start.checked_add_signed(whole as isize)?;
        Some(())
    }

    /// First sample of the SSB, its cyclic prefix included, as a real number.
    pub(crate) fn first_sample(&self) -> f64 {
        self.start as f64 + self.delay - (SYMBOL_SAMPLES - SYMBOL_FFT) as f64
    }
}
