//! Angles, and numbers that turn.

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

/// An angle brought into ±π.
pub(crate) fn wrap(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

/// `phasors[n] = exp(j2π (first + n · step))`, cycles. The recursion runs in four strands of
/// double precision, so that its latency does not matter and its error stays below 1e-12.
pub(crate) fn fill_phasors(phasors: &mut [Complex32], first: f64, step: f64) {
    const STRANDS: usize = 4;
    let stride = Complex64::cis(TAU * step * STRANDS as f64);
    let mut strands: [Complex64; STRANDS] =
        std::array::from_fn(|strand| Complex64::cis(TAU * (first + step * strand as f64)));
    for chunk in phasors.chunks_mut(STRANDS) {
        for (slot, phasor) in chunk.iter_mut().zip(&mut strands) {
            *slot = Complex32::new(phasor.re as f32, phasor.im as f32);
            *phasor = Complex64::new(
                phasor.re * stride.re - phasor.im * stride.im,
                phasor.re * stride.im + phasor.im * stride.re,
            );
        }
    }
}
