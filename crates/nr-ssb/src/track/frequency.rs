//! Carrier frequency offset of a tracked cell, from one SSB to the next.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::dsp::base_rate::SYMBOL_SAMPLES;
use crate::dsp::received_grid::PerAntenna;
use crate::numeric::phasors::wrap;
use crate::search::DetectedSsb;
use crate::standard::grid::SYMBOLS;

/// Random walk of the frequency offset in Hz per square root of second: oscillator and Doppler.
const CFO_WANDER_HZ_PER_SQRT_S: f64 = 35.0;
/// Standard deviation of the frequency offset after the search, in Hz.
const CFO_FIRST_HZ: f64 = 200.0;

/// Frequency tracking loop.
pub(super) struct FrequencyLoop {
    base_rate_hz: f64,
    /// Frequency offset in cycles per sample.
    pub(super) cfo_cycles: f64,
    variance: f64,
    /// Phase step between symbols minus the step caused by the frequency offset, in radians.
    pub(super) phase_step: f64,
}

impl FrequencyLoop {
    /// Creates the loop from the result of a search.
    pub(super) fn new(cell: &DetectedSsb, base_rate_hz: f64) -> Self {
        Self {
            base_rate_hz,
            cfo_cycles: cell.cfo_hz / base_rate_hz,
            variance: (CFO_FIRST_HZ / base_rate_hz).powi(2),
            phase_step: cell.symbol_phase_step_rad,
        }
    }

    /// Updates the frequency offset, after a time in seconds, with the phase between PSS and SSS,
    /// weighted by its noise.
    pub(super) fn follow(
        &mut self,
        elapsed_s: f64,
        blocks: &[PerAntenna<Complex64>; SYMBOLS],
        noise: &[f64],
    ) {
        let (mut turn, mut snr) = (Complex64::ZERO, 0.0);
        for ((pss, sss), noise) in blocks[0].iter().zip(&blocks[2]).zip(noise) {
            let weight = 1.0 / noise.max(1e-30);
            turn += pss.conj() * sss * weight;
            snr += (0.5 * (pss.norm_sqr() + sss.norm_sqr()) * weight - 1.0).max(0.1);
        }
        let base = TAU * 2.0 * SYMBOL_SAMPLES as f64;
        let measured = wrap(turn.arg() - 2.0 * self.phase_step) / base;
        let variance = 1.0 / (snr * base * base);
        self.variance += elapsed_s * (CFO_WANDER_HZ_PER_SQRT_S / self.base_rate_hz).powi(2);
        let gain = self.variance / (self.variance + variance);
        self.cfo_cycles += gain * measured;
        self.variance *= 1.0 - gain;
    }
}
