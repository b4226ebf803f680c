//! Where an SSB lies in time and frequency.

use num_complex::{Complex32, Complex64};

use crate::grid::SYMBOLS;

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
}
