//! One source, maximum likelihood: no eigendecomposition is needed.

use crate::Covariance;
use crate::spectrum::Spectrum;

/// Electrical angle that maximises `a^H R a`, which for one source in white noise is the likelihood,
/// whether its waveform is random or unknown (Stoica and Nehorai 1989).
pub(crate) fn phase<const N: usize>(covariance: &Covariance<N>) -> f64 {
    Spectrum::of_matrix(&covariance.matrix()).maximum()
}

/// Power received in the direction of the source, `a^H R a / N`: noise plus N times the signal's
/// power per antenna.
pub(crate) fn beam_power<const N: usize>(covariance: &Covariance<N>, phase_rad: f64) -> f64 {
    Spectrum::of_matrix(&covariance.matrix()).value(phase_rad) / N as f64
}

/// Noise variance per antenna: what lies in the N - 1 dimensions outside the beam.
pub(crate) fn residual_power<const N: usize>(covariance: &Covariance<N>, beam_power: f64) -> f64 {
    (covariance.power() * N as f64 - beam_power) / (N - 1) as f64
}

/// Linear SNR per antenna and snapshot. Rounding bounds it at both ends: noise-free snapshots have
/// a residual of a few eps.
pub(crate) fn snr<const N: usize>(beam_power: f64, noise_variance: f64) -> f64 {
    let noise = noise_variance.max(beam_power * 1e-15);
    ((beam_power / noise - 1.0) / N as f64).max(1e-9)
}
