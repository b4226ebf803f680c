//! Estimates of several sources.

use super::choice::Method;
use super::noise_eigenvalues::{noise_variance, shows};
use super::one::estimate;
use super::spread::Spread;
use super::whole_array::{WORST_SNR, WholeArray};
use crate::array::linear::Array;
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::eigen::{HermitianEigen, hermitian_eigen};
use crate::linalg::matrix::Matrix;
use crate::list::List;
use crate::method::alternating_projection::{self, Fit};
use crate::method::{esprit, music, root_music};
use crate::result::angle::{AngleEstimate, AngleEstimates};
use crate::result::direction::{Found, describe, threshold_doubt};
use crate::result::verdict::Reason;
use crate::spectrum::polynomial::wrap;

/// Minimum correlation of two sources for the verdict "correlated".
const CORRELATED: f64 = 0.5;
/// Maximum fraction of a signal eigenvector's power that noise may mix into it, for which the
/// first-order theory of the variance is valid.
const LINEAR: f64 = 0.02;

/// Returns the directions of `sources` sources in order of ascending angle.
///
/// # Errors
/// Errors of [`estimate`]; [`Error::TooManySources`] unless `sources` is 1 to N - 1;
/// [`Error::Singular`] if ESPRIT's equations have no solution.
pub fn estimate_several<const N: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
    sources: usize,
) -> Result<AngleEstimates<N>, Error> {
    if sources == 1 {
        let only = estimate(method, covariance, array)?;
        return Ok(List::collect(only, [only]));
    }
    estimate_several_smoothed::<N, N>(method, covariance, array, sources, false)
}

/// Returns the directions of correlated sources with spatial smoothing. The covariance is averaged
/// over the `N - M + 1` subarrays of `M` antennas ([`Covariance::spatially_smoothed`]) and
/// optionally by [`Covariance::forward_backward`]. The standard deviations account for the
/// averaging: subarrays share antennas, so that the variance is larger than with independent
/// subarrays.
///
/// # Errors
/// See [`estimate_several`] with `M` antennas; [`Error::Subarray`] if `M` exceeds `N`.
pub fn estimate_several_smoothed<const N: usize, const M: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
    sources: usize,
    forward_backward: bool,
) -> Result<AngleEstimates<M>, Error> {
    if !(2..=N).contains(&M) {
        return Err(Error::Subarray {
            subarray: M,
            antennas: N,
        });
    }
    let maximum = method.maximum_sources::<M>();
    if sources == 0 || sources > maximum {
        return Err(Error::TooManySources {
            requested: sources,
            maximum,
        });
    }
    let full = covariance.calibrated(array).validated()?;
    let smoothed = full.over_subarrays::<M>();
    let averaged = if forward_backward {
        smoothed.forward_backward()
    } else {
        smoothed
    };
    let array = Array::<M>::new(array.spacing_wavelengths())?;
    let averaged = Averaged {
        matrix: averaged.matrix(),
        forward_backward,
        whole: &full,
    };
    averaged.estimate(method, &array, sources)
}

/// Average of a covariance over the subarrays of `M` antennas, optionally with forward–backward
/// averaging.
struct Averaged<'a, const M: usize> {
    matrix: Matrix<M>,
    forward_backward: bool,
    /// Covariance of all antennas. Its number of antennas is erased, because the compiler would
    /// otherwise generate the estimate for each pair of numbers.
    whole: &'a dyn WholeArray,
}

impl<const M: usize> Averaged<'_, M> {
    fn estimate(
        &self,
        method: Method,
        array: &Array<M>,
        sources: usize,
    ) -> Result<AngleEstimates<M>, Error> {
        let (matrix, whole) = (self.matrix, self.whole);
        let snapshots = whole.snapshots();
        let eigen = hermitian_eigen(matrix, M);
        let mut phases = match method {
            Method::MaximumLikelihood => {
                alternating_projection::phases(&matrix, sources).ok_or(Error::Singular)?
            }
            _ => subspace_phases(method, &eigen, sources)?,
        };
        let mut separated = phases.len() == sources;
        if !separated {
            // If the spectrum has fewer peaks than sources, the roots of the polynomial replace them.
            phases = subspace_phases(Method::RootMusic, &eigen, sources)?;
        }
        let likelihood = match method {
            Method::MaximumLikelihood => Fit::at(&matrix, &phases),
            _ => None,
        };
        let noise_variance = match &likelihood {
            Some(likelihood) => likelihood.noise_variance(),
            None => noise_variance(&eigen, sources),
        };
        let mut snrs = [WORST_SNR; M];
        let correlation = whole.source_snrs(&phases, noise_variance, &mut snrs);
        let spread = Spread {
            eigen: &eigen,
            sources,
            noise_variance,
            forward_backward: self.forward_backward,
            whole,
        };
        let sigmas = match &likelihood {
            Some(likelihood) => spread.of_maximum_likelihood(likelihood),
            None => spread.phase_sigmas_rad(method, &phases),
        };
        separated &= correlation.is_some() && sigmas.is_some();
        let sigmas = sigmas.unwrap_or_else(|| List::collect(0.0, [std::f64::consts::PI; M]));
        let hidden = match method {
            // Each source must exceed the noise. Coherent sources share an eigenvector.
            Method::MaximumLikelihood => {
                (0..sources).any(|k| snrs[k] < bound::resolvable_snr::<M>(snapshots))
            }
            _ => !shows(&eigen, sources, snapshots) || spread.mixing() > LINEAR,
        };
        // Without averaging, coherent sources appear as one source in the eigenvalues.
        let correlated = correlation.is_some_and(|correlation| correlation > CORRELATED)
            || hidden && whole.shows_after_averaging(sources);
        // The tests require the original covariance, because an average is not a sample covariance.
        let (tests, tested) = whole.tests(&phases);
        let mut estimates: [Option<AngleEstimate>; M] = [None; M];
        for (k, place) in estimates[..sources].iter_mut().enumerate() {
            let (phase, sigma) = (phases[k], sigmas[k]);
            let close = (0..sources).any(|other| {
                let gap = wrap(phases[other] - phase).abs();
                other != k && gap < 2.0 * sigma.hypot(sigmas[other])
            });
            let doubt = if (hidden || close || !separated) && correlated {
                Some(Reason::Correlated)
            } else if hidden {
                let weakest = snrs[..sources]
                    .iter()
                    .copied()
                    .fold(f64::INFINITY, f64::min);
                threshold_doubt(weakest, f64::INFINITY)
            } else if close || !separated {
                Some(Reason::SourcesNotSeparated)
            } else {
                None
            };
            let snr = snrs[k];
            let found = Found {
                phase_rad: phase,
                noise_sigma_rad: sigma,
                snr,
                tests,
                tested,
                doubt,
            };
            *place = Some(describe(&found, array));
        }
        estimates[..sources].sort_unstable_by(|a, b| match (a, b) {
            (Some(a), Some(b)) => a.angle_rad.total_cmp(&b.angle_rad),
            _ => std::cmp::Ordering::Equal,
        });
        Ok(List::collect(
            AngleEstimate::default(),
            estimates.into_iter().flatten(),
        ))
    }
}

/// Returns the electrical angles from the eigenvectors.
fn subspace_phases<const N: usize>(
    method: Method,
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Result<List<f64, N>, Error> {
    match method {
        Method::Music => {
            let spectrum = music::signal_spectrum(eigen, sources);
            Ok(music::phases(&spectrum, sources))
        }
        Method::RootMusic | Method::MaximumLikelihood => {
            let null = music::null_spectrum(eigen, sources);
            Ok(root_music::phases(&null, sources))
        }
        Method::EspritLs => esprit::least_squares(eigen, sources).ok_or(Error::Singular),
        Method::EspritTls => esprit::total_least_squares(eigen, sources).ok_or(Error::Singular),
    }
}
