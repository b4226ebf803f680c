//! Plans of the fast Fourier transform (FFT).
//!
//! RustFFT is generic, and its code takes half of this crate's build time. Every crate that calls
//! its planner compiles that code again, so that they call these functions instead.

use std::sync::Arc;

pub use rustfft::Fft;
use rustfft::FftDirection;
#[cfg(not(test))]
use rustfft::FftPlanner as Planner;
// The code of AVX and SSE is half of the build time of the unit tests.
#[cfg(test)]
use rustfft::FftPlannerScalar as Planner;

/// Returns the plan of an unnormalised forward transform of `length` samples.
///
/// ```
/// use nr_ssb::{Complex32, fft};
///
/// let mut samples = [Complex32::ONE; 4];
/// fft::forward(4).process(&mut samples);
/// assert_eq!(samples.map(|bin| bin.re), [4.0, 0.0, 0.0, 0.0]);
/// ```
pub fn forward(length: usize) -> Arc<dyn Fft<f32>> {
    plan(length, FftDirection::Forward)
}

/// Returns the plan of an unnormalised inverse transform of `length` samples.
pub fn inverse(length: usize) -> Arc<dyn Fft<f32>> {
    plan(length, FftDirection::Inverse)
}

#[inline(never)]
fn plan(length: usize, direction: FftDirection) -> Arc<dyn Fft<f32>> {
    Planner::new().plan_fft(length, direction)
}
