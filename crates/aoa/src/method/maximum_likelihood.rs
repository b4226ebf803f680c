//! One source, maximum likelihood: no eigendecomposition is needed.
//!
//! For one source in white noise the likelihood is a function of `a^H R a`, whether the waveform is
//! random or unknown (Stoica and Nehorai 1989). Of the covariance only the sums along its diagonals
//! enter, and the search needs no branch, so a batch is searched in vector registers.

use num_complex::Complex;

use crate::array::linear::Array;
use crate::array::steering::aperture;
use crate::bound;
use crate::error::Error;
use crate::kernel::real::Real;
use crate::result::angle::AngleEstimate;
use crate::result::direction::{direction, geometric_doubt};
use crate::result::verdict::{Reason, Verdict};
use crate::simd::instructions::dispatch;
use crate::simd::math::{log10, times_plus};
use crate::spectrum::side_by_side::Spectra;

/// Items of a batch that are searched side by side.
pub(crate) const BLOCK: usize = 64;

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

/// Estimates up to [`BLOCK`] items of row-major samples `(items, N, snapshots)`.
///
/// # Errors
/// The first item that cannot be estimated, and why.
pub(crate) fn block<T: Real, const N: usize>(
    samples: &[Complex<T>],
    snapshots: usize,
    array: &Array<N>,
    estimates: &mut [AngleEstimate],
) -> Result<(), (usize, Error)> {
    dispatch!(
        block_generic::<false, T, N>(samples, snapshots, array, estimates),
        block_avx2(samples, snapshots, array, estimates),
        block_avx512(samples, snapshots, array, estimates)
    )
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn block_avx2<T: Real, const N: usize>(
    samples: &[Complex<T>],
    snapshots: usize,
    array: &Array<N>,
    estimates: &mut [AngleEstimate],
) -> Result<(), (usize, Error)> {
    block_generic::<true, T, N>(samples, snapshots, array, estimates)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f")]
fn block_avx512<T: Real, const N: usize>(
    samples: &[Complex<T>],
    snapshots: usize,
    array: &Array<N>,
    estimates: &mut [AngleEstimate],
) -> Result<(), (usize, Error)> {
    block_generic::<true, T, N>(samples, snapshots, array, estimates)
}

#[inline(always)]
fn block_generic<const FUSED: bool, T: Real, const N: usize>(
    samples: &[Complex<T>],
    snapshots: usize,
    array: &Array<N>,
    estimates: &mut [AngleEstimate],
) -> Result<(), (usize, Error)> {
    let mut spectra = Spectra::<N, BLOCK>::ZERO;
    T::spectra(samples, snapshots, &mut spectra);
    let items = samples.len() / (N * snapshots);
    for (w, trace) in spectra.re[0].iter().take(items).enumerate() {
        if !trace.is_finite() {
            return Err((w, Error::NotFinite));
        }
        if *trace <= 0.0 {
            return Err((w, Error::Zero));
        }
    }
    let peaks = spectra.maxima::<FUSED>();
    let end_fire = array.phase_at_end_fire_rad();
    let per_snapshot = 1.0 / (2.0 * snapshots as f64 * aperture::<N>());
    let threshold = bound::resolvable_snr::<N>(snapshots);
    let mut snrs = [0.0; BLOCK];
    let (mut snr_db, mut phase_sigma) = ([0.0; BLOCK], [0.0; BLOCK]);
    let (mut angle, mut sigma) = ([0.0; BLOCK], [0.0; BLOCK]);
    for w in 0..BLOCK {
        let beam = peaks.value[w] * (1.0 / N as f64);
        let snr = snr::<N>(beam, residual_power::<N>(spectra.re[0][w], beam));
        // The stochastic bound.
        let inverse = 1.0 / snr;
        let variance = times_plus::<FUSED>(inverse * (1.0 / N as f64), inverse, inverse);
        phase_sigma[w] = (variance * per_snapshot).sqrt();
        snrs[w] = snr;
    }
    for w in 0..BLOCK {
        snr_db[w] = 10.0 * log10::<FUSED>(snrs[w]);
        (phase_sigma[w], angle[w], sigma[w]) =
            direction::<FUSED>(peaks.phase_rad[w], phase_sigma[w], end_fire);
    }
    for (w, estimate) in estimates.iter_mut().take(items.min(BLOCK)).enumerate() {
        let doubt = (snrs[w] < threshold).then_some(Reason::ThresholdSnr);
        let doubt = doubt.or_else(|| geometric_doubt(peaks.phase_rad[w], phase_sigma[w], end_fire));
        *estimate = AngleEstimate {
            phase_rad: peaks.phase_rad[w],
            phase_sigma_rad: phase_sigma[w],
            angle_rad: angle[w],
            sigma_rad: sigma[w],
            snr_db: snr_db[w],
            verdict: doubt.map_or(Verdict::Resolved, Verdict::Unresolved),
        };
    }
    Ok(())
}
