//! Maximum likelihood estimate of one source, without an eigendecomposition.
//!
//! For one source in white noise, the likelihood is an increasing function of `a^H R a` for random
//! and for unknown deterministic waveforms (Stoica and Nehorai 1989). The maximum gives the
//! direction, and the remaining power is the noise.

/// Returns the linear SNR per antenna and snapshot from the beam power `a^H R a / N` and the noise
/// variance. The result is limited by rounding: snapshots without noise have a residual of a few
/// eps.
#[inline(always)]
pub(crate) fn snr<const N: usize>(beam_power: f64, noise_variance: f64) -> f64 {
    let least = beam_power * 1e-15;
    let noise = if noise_variance > least {
        noise_variance
    } else {
        least
    };
    let snr = (beam_power / noise - 1.0) * (1.0 / N as f64);
    if snr > 1e-9 { snr } else { 1e-9 }
}

/// Returns the noise variance per antenna: the mean power in the N - 1 dimensions orthogonal to the
/// beam.
#[inline(always)]
pub(crate) fn residual_power<const N: usize>(trace: f64, beam_power: f64) -> f64 {
    (trace - beam_power) * (1.0 / (N - 1) as f64)
}
