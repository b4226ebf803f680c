//! Phase wrapping and phasors.

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

/// Wraps an angle into ±π.
pub(crate) fn wrap(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

/// Fills `phasors[n] = exp(j2π (first + n · step))`, with `first` and `step` in cycles. The
/// recursion has four interleaved lanes in double precision, which hides its latency and keeps its
/// error below 1e-12.
pub(crate) fn fill_phasors(phasors: &mut [Complex32], first: f64, step: f64) {
    const LANES: usize = 4;
    let stride = Complex64::cis(TAU * step * LANES as f64);
    let mut lanes: [Complex64; LANES] =
        std::array::from_fn(|lane| Complex64::cis(TAU * (first + step * lane as f64)));
    for chunk in phasors.chunks_mut(LANES) {
        for (slot, phasor) in chunk.iter_mut().zip(&mut lanes) {
            *slot = Complex32::new(phasor.re as f32, phasor.im as f32);
            *phasor = Complex64::new(
                phasor.re * stride.re - phasor.im * stride.im,
                phasor.re * stride.im + phasor.im * stride.re,
            );
        }
    }
}
