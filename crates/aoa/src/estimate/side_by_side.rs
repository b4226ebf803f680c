//! One source in each of many items, by any method.
//!
//! None of the methods needs a branch for one source, so items go through every step side by side in
//! vector registers; a single estimate is one item. What is found in an item does not depend on its
//! neighbours, hence not on how a batch is divided among threads either.

use num_complex::Complex;

use super::choice::Method;
use crate::array::linear::Array;
use crate::array::steering::aperture;
use crate::bound;
use crate::error::Error;
use crate::kernel::real::Real;
use crate::linalg::hermitians::Hermitians;
use crate::linalg::matrix::Matrix;
use crate::method::maximum_likelihood::{residual_power, snr};
use crate::method::{esprit, music, root_music};
use crate::result::angle::AngleEstimate;
use crate::result::direction::{direction, geometric_doubt};
use crate::result::verdict::{Reason, Verdict};
use crate::simd::instructions::dispatch;
use crate::simd::math::{log10, times_plus};
use crate::spectrum::side_by_side::{Places, Spectra};

/// How to estimate one source in each item.
#[derive(Debug, Clone, Copy)]
pub(super) struct SideBySide<'a, const N: usize> {
    pub(super) method: Method,
    pub(super) array: &'a Array<N>,
    pub(super) forward_backward: bool,
    pub(super) snapshots: usize,
}

/// What an estimate needs of the samples.
#[derive(Clone, Copy)]
enum Moments<'a, const N: usize, const W: usize> {
    /// For maximum likelihood, the sums along the diagonals of the covariances.
    Lags(&'a Spectra<N, W>),
    Covariances(&'a Hermitians<N, W>),
}

impl<const N: usize> SideBySide<'_, N> {
    /// Estimates up to `W` items of row-major samples `(items, N, snapshots)`.
    ///
    /// # Errors
    /// The first item that cannot be estimated, and why.
    pub(super) fn of_samples<T: Real, const W: usize>(
        &self,
        samples: &[Complex<T>],
        estimates: &mut [AngleEstimate],
    ) -> Result<(), (usize, Error)> {
        let items = samples.chunks_exact(N * self.snapshots).take(W);
        let estimates = &mut estimates[..items.len()];
        let items = items.map(|item| {
            let mut channels = item.chunks_exact(self.snapshots);
            std::array::from_fn(|_| channels.next().unwrap_or_default())
        });
        if self.method == Method::MaximumLikelihood && self.array.is_ideal() {
            // Forward–backward averaging leaves the sums along the diagonals as they are.
            let mut lags = Spectra::<N, W>::ZERO;
            for (w, channels) in items.enumerate() {
                lags.set(w, &T::lags(&channels));
            }
            return self.of_moments(Moments::Lags(&lags), estimates);
        }
        let mut covariances = Hermitians::<N, W>::ZERO;
        for (w, channels) in items.enumerate() {
            covariances.set(w, &T::products(&channels));
        }
        if !self.array.is_ideal() {
            covariances = covariances.scaled(&self.array.calibration().inverse_gains());
        }
        if self.forward_backward {
            covariances = covariances.forward_backward();
        }
        self.of_moments(Moments::Covariances(&covariances), estimates)
    }

    fn of_moments<const W: usize>(
        &self,
        moments: Moments<'_, N, W>,
        estimates: &mut [AngleEstimate],
    ) -> Result<(), (usize, Error)> {
        dispatch!(
            self.of_moments_generic::<false, W>(moments, estimates),
            self.of_moments_generic::<true, W>(moments, estimates),
            self.of_moments_avx2(moments, estimates),
            self.of_moments_avx512(moments, estimates)
        )
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn of_moments_avx2<const W: usize>(
        &self,
        moments: Moments<'_, N, W>,
        estimates: &mut [AngleEstimate],
    ) -> Result<(), (usize, Error)> {
        self.of_moments_generic::<true, W>(moments, estimates)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,avx512f")]
    fn of_moments_avx512<const W: usize>(
        &self,
        moments: Moments<'_, N, W>,
        estimates: &mut [AngleEstimate],
    ) -> Result<(), (usize, Error)> {
        self.of_moments_generic::<true, W>(moments, estimates)
    }

    #[inline(always)]
    fn of_moments_generic<const FUSED: bool, const W: usize>(
        &self,
        moments: Moments<'_, N, W>,
        estimates: &mut [AngleEstimate],
    ) -> Result<(), (usize, Error)> {
        let spectra = match moments {
            Moments::Lags(lags) => *lags,
            Moments::Covariances(covariances) => Spectra::of_matrices(covariances),
        };
        spectra.check(estimates.len())?;
        let places = match (self.method, moments) {
            (Method::MaximumLikelihood, _) | (_, Moments::Lags(_)) => spectra.maxima::<FUSED>(),
            (method, Moments::Covariances(covariances)) => {
                let principal = covariances.principal_eigenvectors::<FUSED>();
                match method {
                    Method::RootMusic => root_music::places::<FUSED, N, W>(&principal),
                    Method::EspritLs | Method::EspritTls => {
                        esprit::places::<FUSED, N, W>(&principal)
                    }
                    _ => music::places::<FUSED, N, W>(&principal),
                }
            }
        };
        self.describe::<FUSED, W>(&spectra, &places, estimates);
        Ok(())
    }

    /// What is known of sources at these places: SNR, standard deviations, verdict.
    #[inline(always)]
    fn describe<const FUSED: bool, const W: usize>(
        &self,
        spectra: &Spectra<N, W>,
        places: &Places<W>,
        estimates: &mut [AngleEstimate],
    ) {
        let phases = &places.phase_rad;
        let end_fire = self.array.phase_at_end_fire_rad();
        let excess = match self.method {
            Method::EspritLs | Method::EspritTls => esprit::excess::<N>(),
            _ => 1.0,
        };
        let per_snapshot = excess * excess / (2.0 * self.snapshots as f64 * aperture::<N>());
        let threshold = bound::resolvable_snr::<N>(self.snapshots);
        let values = spectra.values::<FUSED>(places);
        let mut snrs = [0.0; W];
        let (mut snr_db, mut phase_sigma) = ([0.0; W], [0.0; W]);
        let (mut angle, mut sigma) = ([0.0; W], [0.0; W]);
        for w in 0..W {
            let beam = values[w] * (1.0 / N as f64);
            let snr = snr::<N>(beam, residual_power::<N>(spectra.re[0][w], beam));
            // The stochastic bound.
            let inverse = 1.0 / snr;
            let variance = times_plus::<FUSED>(inverse * (1.0 / N as f64), inverse, inverse);
            phase_sigma[w] = (variance * per_snapshot).sqrt();
            snrs[w] = snr;
        }
        for w in 0..W {
            snr_db[w] = 10.0 * log10::<FUSED>(snrs[w]);
            (phase_sigma[w], angle[w], sigma[w]) =
                direction::<FUSED>(phases[w], phase_sigma[w], end_fire);
        }
        for (w, estimate) in estimates.iter_mut().enumerate() {
            let doubt = (snrs[w] < threshold).then_some(Reason::ThresholdSnr);
            let doubt = doubt.or_else(|| geometric_doubt(phases[w], phase_sigma[w], end_fire));
            *estimate = AngleEstimate {
                phase_rad: phases[w],
                phase_sigma_rad: phase_sigma[w],
                angle_rad: angle[w],
                sigma_rad: sigma[w],
                snr_db: snr_db[w],
                verdict: doubt.map_or(Verdict::Resolved, Verdict::Unresolved),
            };
        }
    }

    /// Estimates from a single covariance of calibrated channels.
    pub(super) fn of_covariance(&self, covariance: &Matrix<N>) -> Result<AngleEstimate, Error> {
        let mut single = Hermitians::<N, 1>::ZERO;
        single.set(0, covariance);
        let mut estimate = [AngleEstimate::default()];
        self.of_moments(Moments::Covariances(&single), &mut estimate)
            .map_err(|(_, error)| error)?;
        let [only] = estimate;
        Ok(only)
    }
}
