//! One source, maximum likelihood: no eigendecomposition is needed.
//!
//! For one source in white noise the likelihood is a function of `a^H R a`, whether the waveform is
//! random or unknown (Stoica and Nehorai 1989): its maximum is the direction, and what the rest of the
//! power is, the noise.

/// Linear SNR per antenna and snapshot, from the power in the direction of the source,
/// `a^H R a / N`, and the noise variance. Rounding bounds it at both ends: snapshots without noise
/// have a residual of a few eps.
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

/// Noise variance per antenna: what lies in the N - 1 dimensions outside the beam.
#[inline(always)]
pub(crate) fn residual_power<const N: usize>(trace: f64, beam_power: f64) -> f64 {
    (trace - beam_power) * (1.0 / (N - 1) as f64)
}
