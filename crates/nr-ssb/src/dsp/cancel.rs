//! Subtraction of a received SSB from the samples, so that weaker cells can be detected.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::{Complex32, Complex64};

use super::alignment::Alignment;
use super::base_rate::{CYCLIC_PREFIX, SYMBOL_FFT, SYMBOL_SAMPLES};
use crate::numeric::fft::{self, Fft};
use crate::numeric::phasors::fill_phasors;
use crate::standard::grid::{SUBCARRIERS, SYMBOLS, SsbGrid};

/// Remodulator that subtracts a received SSB from the samples.
pub(crate) struct Canceller {
    fft: Arc<dyn Fft<f32>>,
    spectrum: Vec<Complex32>,
    scratch: Vec<Complex32>,
    rotation: Vec<Complex32>,
}

impl Canceller {
    pub(crate) fn new() -> Self {
        let fft = fft::inverse(SYMBOL_FFT);
        let scratch = fft.get_inplace_scratch_len();
        Self {
            fft,
            spectrum: vec![Complex32::ZERO; SYMBOL_FFT],
            scratch: vec![Complex32::ZERO; scratch],
            rotation: vec![Complex32::ZERO; SYMBOLS * SYMBOL_SAMPLES],
        }
    }

    /// Subtracts `reference`, filtered by `channel` and aligned, from the samples of one antenna.
    pub(crate) fn subtract(
        &mut self,
        samples: &mut [Complex32],
        alignment: &Alignment,
        reference: &SsbGrid,
        channel: &[Complex32; SUBCARRIERS],
    ) {
        let Some(first) = alignment.start.checked_sub(CYCLIC_PREFIX) else {
            return;
        };
        let Some(place) = samples.get_mut(first..first + SYMBOLS * SYMBOL_SAMPLES) else {
            return;
        };
        let cycles = alignment.cfo_cycles;
        fill_phasors(&mut self.rotation, -(CYCLIC_PREFIX as f64) * cycles, cycles);
        let mut ramp = [Complex32::ZERO; SUBCARRIERS];
        let per_subcarrier = alignment.delay / SYMBOL_FFT as f64;
        fill_phasors(&mut ramp, 120.0 * per_subcarrier, -per_subcarrier);

        let symbols = place.chunks_exact_mut(SYMBOL_SAMPLES);
        let rotations = self.rotation.chunks_exact(SYMBOL_SAMPLES);
        for (l, ((place, rotation), known)) in
            symbols.zip(rotations).zip(reference.symbols()).enumerate()
        {
            let step = Complex64::cis((alignment.phase_step * l as f64) % TAU);
            let scale = Complex32::new(step.re as f32, step.im as f32) / SYMBOL_FFT as f32;
            self.spectrum.fill(Complex32::ZERO);
            for (k, ((s, h), phasor)) in known.iter().zip(channel).zip(&ramp).enumerate() {
                self.spectrum[(k + SYMBOL_FFT - 120) % SYMBOL_FFT] = s * h * phasor * scale;
            }
            self.fft
                .process_with_scratch(&mut self.spectrum, &mut self.scratch);
            let (prefix, body) = place.split_at_mut(CYCLIC_PREFIX);
            let (prefix_rotation, body_rotation) = rotation.split_at(CYCLIC_PREFIX);
            let tail = &self.spectrum[SYMBOL_FFT - CYCLIC_PREFIX..];
            for ((sample, value), phasor) in prefix.iter_mut().zip(tail).zip(prefix_rotation) {
                *sample -= value * phasor;
            }
            for ((sample, value), phasor) in body.iter_mut().zip(&self.spectrum).zip(body_rotation)
            {
                *sample -= value * phasor;
            }
        }
    }
}
