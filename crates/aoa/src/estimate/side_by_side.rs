//! Estimates of one source in each of many items.
//!
//! For one source, all methods are branch-free. Therefore, `W` items are processed together in
//! vector registers; a single estimate is one item. The result of an item does not depend on its
//! neighbours, so that the partition of a batch among threads does not matter.

use num_complex::Complex;

use super::choice::Method;
use super::residual::Residuals;
use crate::array::linear::Array;
use crate::array::steering::aperture;
use crate::bound;
use crate::error::Error;
use crate::kernel::real::Real;
use crate::linalg::hermitians::Hermitians;
use crate::linalg::matrix::Matrix;
use crate::method::maximum_likelihood::{residual_power, snr};
use crate::method::{esprit, music, root_music};
use crate::result::direction::{
    Described, Output, direction, geometric_doubt, limit_to_uniform_sigma, threshold_doubt,
};
use crate::result::goodness_of_fit::{Model, Tested};
use crate::simd::instructions::{LARGEST_VECTORISED, dispatch};
use crate::simd::math::{log10, times_plus};
use crate::spectrum::side_by_side::{Places, Spectra};

/// Settings for the estimate of one source per item.
#[derive(Debug, Clone, Copy)]
pub(super) struct SideBySide<'a, const N: usize> {
    pub(super) method: Method,
    pub(super) array: &'a Array<N>,
    pub(super) forward_backward: bool,
    pub(super) snapshots: usize,
}

impl<const N: usize> SideBySide<'_, N> {
    /// Estimates up to `W` items of row-major samples `(items, N, snapshots)`.
    ///
    /// # Errors
    /// Index and error of the first invalid item.
    pub(super) fn of_samples<T: Real, O: Output, const W: usize>(
        &self,
        samples: &[Complex<T>],
        estimates: &mut [O],
    ) -> Result<(), (usize, Error)> {
        let items = samples.chunks_exact(N * self.snapshots).take(W);
        let estimates = &mut estimates[..items.len()];
        let items = items.map(|item| {
            let mut channels = item.chunks_exact(self.snapshots);
            std::array::from_fn(|_| channels.next().unwrap_or_default())
        });
        let mut covariances = Hermitians::<N, W>::ZERO;
        for (w, channels) in items.enumerate() {
            covariances.set(w, &T::products(&channels));
        }
        if !self.array.is_ideal() {
            covariances = covariances.scaled(&self.array.calibration().inverse_gains());
        }
        self.of_covariances(&covariances, estimates)
    }

    // Both sample types share one copy of the code.
    #[inline(never)]
    fn of_covariances<O: Output, const W: usize>(
        &self,
        covariances: &Hermitians<N, W>,
        estimates: &mut [O],
    ) -> Result<(), (usize, Error)> {
        if const { N > LARGEST_VECTORISED } {
            return self.of_covariances_generic::<O, false, W>(covariances, estimates);
        }
        if const { W == 1 } {
            // A single item uses scalar instructions, which AVX-512 does not change.
            return dispatch!(
                self.of_covariances_generic::<O, false, W>(covariances, estimates),
                self.of_covariances_generic::<O, true, W>(covariances, estimates),
                self.of_covariances_avx2(covariances, estimates),
                self.of_covariances_avx2(covariances, estimates)
            );
        }
        dispatch!(
            self.of_covariances_generic::<O, false, W>(covariances, estimates),
            self.of_covariances_generic::<O, true, W>(covariances, estimates),
            self.of_covariances_avx2(covariances, estimates),
            self.of_covariances_avx512(covariances, estimates)
        )
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn of_covariances_avx2<O: Output, const W: usize>(
        &self,
        covariances: &Hermitians<N, W>,
        estimates: &mut [O],
    ) -> Result<(), (usize, Error)> {
        self.of_covariances_generic::<O, true, W>(covariances, estimates)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,avx512f")]
    fn of_covariances_avx512<O: Output, const W: usize>(
        &self,
        covariances: &Hermitians<N, W>,
        estimates: &mut [O],
    ) -> Result<(), (usize, Error)> {
        self.of_covariances_generic::<O, true, W>(covariances, estimates)
    }

    #[inline(always)]
    fn of_covariances_generic<O: Output, const FUSED: bool, const W: usize>(
        &self,
        covariances: &Hermitians<N, W>,
        estimates: &mut [O],
    ) -> Result<(), (usize, Error)> {
        let spectra = Spectra::of_matrices(covariances);
        spectra.check(estimates.len())?;
        let places = if self.method == Method::MaximumLikelihood {
            // Forward–backward averaging does not change the sums along the diagonals.
            spectra.maxima::<FUSED>()
        } else {
            let averaged = self
                .forward_backward
                .then(|| covariances.forward_backward());
            let principal = averaged
                .as_ref()
                .unwrap_or(covariances)
                .principal_eigenvectors::<FUSED>();
            match self.method {
                Method::RootMusic => root_music::places::<FUSED, N, W>(&principal),
                Method::EspritLs | Method::EspritTls => esprit::places::<FUSED, N, W>(&principal),
                _ => music::places::<FUSED, N, W>(&principal),
            }
        };
        let residuals = O::IS_TESTED.then(|| Residuals::of::<FUSED, N>(covariances, &places));
        self.describe::<O, FUSED, W>(&spectra, &places, residuals.as_ref(), estimates);
        Ok(())
    }

    /// Computes SNR, standard deviations and verdict of sources at the given positions.
    #[inline(always)]
    fn describe<O: Output, const FUSED: bool, const W: usize>(
        &self,
        spectra: &Spectra<N, W>,
        places: &Places<W>,
        residuals: Option<&Residuals<W>>,
        estimates: &mut [O],
    ) {
        let phases = &places.phase_rad;
        let end_fire = self.array.phase_at_end_fire_rad();
        let excess = match self.method {
            Method::EspritLs | Method::EspritTls => esprit::excess::<N>(),
            _ => 1.0,
        };
        let values = spectra.values::<FUSED>(places);
        let tests = Model::one::<N>(self.snapshots, false).tests();
        let needed = tests.needed_snr(bound::resolvable_snr::<N>(self.snapshots));
        let per_snapshot = excess * excess / (2.0 * self.snapshots as f64 * aperture::<N>());
        let (mut snrs, mut snr_db) = ([0.0; W], [0.0; W]);
        let (mut noise_sigma, mut phase_sigma) = ([0.0; W], [0.0; W]);
        let (mut coherent, mut noise, mut inflation) = ([1.0; W], [1.0; W], [1.0; W]);
        let (mut angle, mut sigma) = ([0.0; W], [0.0; W]);
        for w in 0..W {
            let beam = values[w] * (1.0 / N as f64);
            let power = residual_power::<N>(spectra.re[0][w], beam);
            let snr = snr::<N>(beam, power);
            // Standard deviation according to the stochastic bound.
            let inverse = 1.0 / snr;
            let variance = times_plus::<FUSED>(inverse * (1.0 / N as f64), inverse, inverse);
            let variance = variance * (per_snapshot * tests.variance_factor(snr, needed));
            noise_sigma[w] = limit_to_uniform_sigma(variance.sqrt());
            if let Some(residuals) = residuals {
                let tested = tests.of(&residuals.item(w), power, spectra.re[0][w]);
                (coherent[w], noise[w]) = (tested.coherent, tested.noise);
                inflation[w] = tested.inflation;
            }
            snrs[w] = snr;
        }
        for w in 0..W {
            snr_db[w] = 10.0 * log10::<FUSED>(snrs[w]);
            let with_misfit = noise_sigma[w] * inflation[w].sqrt();
            (phase_sigma[w], angle[w], sigma[w]) =
                direction::<FUSED>(phases[w], with_misfit, end_fire);
        }
        for (w, estimate) in estimates.iter_mut().enumerate() {
            let tested = Tested {
                coherent: coherent[w],
                noise: noise[w],
                inflation: inflation[w],
            };
            let described = Described {
                phase_rad: phases[w],
                phase_sigma_rad: phase_sigma[w],
                phase_noise_sigma_rad: noise_sigma[w],
                angle_rad: angle[w],
                sigma_rad: sigma[w],
                snr_db: snr_db[w],
                doubt: threshold_doubt(snrs[w], needed).or(tests.noise_doubt()),
                geometric: geometric_doubt(phases[w], noise_sigma[w], end_fire),
            };
            *estimate = O::new(&described, &tests, &tested);
        }
    }

    /// Estimates one source from a single covariance of calibrated channels.
    pub(super) fn of_covariance<O: Output + Default>(
        &self,
        covariance: &Matrix<N>,
    ) -> Result<O, Error> {
        let mut single = Hermitians::<N, 1>::ZERO;
        single.set(0, covariance);
        let mut estimate = [O::default()];
        self.of_covariances(&single, &mut estimate)
            .map_err(|(_, error)| error)?;
        let [only] = estimate;
        Ok(only)
    }
}
