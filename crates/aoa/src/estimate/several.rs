//! Estimates of several sources.

use num_complex::Complex64;

use super::choice::Method;
use super::one::estimate;
use super::spread::{Averaging, Spread};
use crate::array::linear::Array;
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::dense::{adjoint, inverse, product};
use crate::linalg::eigen::{HermitianEigen, hermitian_eigen};
use crate::linalg::matrix::Matrix;
use crate::list::List;
use crate::method::alternating_projection::{self, Fit};
use crate::method::{esprit, music, root_music};
use crate::result::angle::{AngleEstimate, AngleEstimates};
use crate::result::direction::{Found, describe, threshold_doubt};
use crate::result::goodness_of_fit::{Model, Tested};
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
    let averaging = Averaging::<N, M> { forward_backward };
    let averaged = averaging.average(&full);
    let array = Array::<M>::new(array.spacing_wavelengths())?;
    let matrix = averaged.matrix();
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
    let powers = source_powers(&phases, &full, noise_variance);
    let spread = Spread {
        eigen: &eigen,
        sources,
        noise_variance,
        averaging,
        covariance: &full.matrix(),
        snapshots: full.snapshots(),
    };
    let sigmas = match &likelihood {
        Some(likelihood) => spread.of_maximum_likelihood(likelihood),
        None => spread.phase_sigmas_rad(method, &phases),
    };
    separated &= powers.is_some() && sigmas.is_some();
    let powers = powers.unwrap_or_default();
    let sigmas = sigmas.unwrap_or_else(|| List::collect(0.0, [std::f64::consts::PI; M]));
    let hidden = match method {
        // Each source must exceed the noise. Coherent sources share an eigenvector.
        Method::MaximumLikelihood => (0..sources)
            .any(|k| powers.snr(k, noise_variance) < bound::resolvable_snr::<M>(full.snapshots())),
        _ => !shows(&eigen, sources, full.snapshots()) || spread.mixing() > LINEAR,
    };
    // Without averaging, coherent sources appear as one source in the eigenvalues.
    let averaged_again = || hermitian_eigen(full.forward_backward().matrix(), N);
    let correlated = powers.largest_correlation(sources) > CORRELATED
        || hidden && shows(&averaged_again(), sources, full.snapshots());
    // The tests require the original covariance, because an average is not a sample covariance.
    let snapshots = full.snapshots();
    let model = Model::new::<N>([sources, sources], snapshots, false);
    let tests = model.tests();
    let power = full.power() * full.weight() * N as f64;
    let tested = Fit::at(full.unscaled(), &phases)
        .and_then(|fit| fit.residual())
        .map_or(Tested::NOTHING, |(left, noise)| {
            tests.of(&left, noise, power)
        });
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
            let weakest = powers.weakest_snr(sources, noise_variance);
            threshold_doubt(weakest, f64::INFINITY)
        } else if close || !separated {
            Some(Reason::SourcesNotSeparated)
        } else {
            None
        };
        let snr = powers.snr(k, noise_variance);
        let found = Found {
            phase_rad: phase,
            noise_sigma_rad: sigma,
            snr,
            tests,
            tested,
            doubt,
        };
        *place = Some(describe(&found, &array));
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

/// Returns the mean of the noise eigenvalues.
fn noise_variance<const N: usize>(eigen: &HermitianEigen<N>, sources: usize) -> f64 {
    let mean = eigen.values[sources..].iter().sum::<f64>() / (N - sources) as f64;
    mean.max(eigen.values[0] * 1e-15)
}

/// Whether the weakest source exceeds the noise.
fn shows<const N: usize>(eigen: &HermitianEigen<N>, sources: usize, snapshots: usize) -> bool {
    let ratio = eigen.values[sources - 1] / noise_variance(eigen, sources);
    (ratio - 1.0) / N as f64 >= bound::resolvable_snr::<N>(snapshots)
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

/// Covariance of the sources.
struct SourcePowers<const N: usize>(Matrix<N>);

impl<const N: usize> Default for SourcePowers<N> {
    fn default() -> Self {
        Self([[Complex64::ZERO; N]; N])
    }
}

impl<const N: usize> SourcePowers<N> {
    fn snr(&self, source: usize, noise_variance: f64) -> f64 {
        (self.0[source][source].re / noise_variance).max(1e-9)
    }

    fn weakest_snr(&self, sources: usize, noise_variance: f64) -> f64 {
        let each = (0..sources).map(|source| self.snr(source, noise_variance));
        each.fold(f64::INFINITY, f64::min)
    }

    fn largest_correlation(&self, sources: usize) -> f64 {
        let pairs = (0..sources).flat_map(|i| (0..i).map(move |j| (i, j)));
        let squared = pairs.map(|(i, j)| {
            let power = (self.0[i][i].re * self.0[j][j].re).max(f64::MIN_POSITIVE);
            self.0[i][j].norm_sqr() / power
        });
        squared.fold(0.0, f64::max).sqrt()
    }
}

/// Returns `S = A^+ (R - sigma^2 I) A^+H`; `None` if the steering vectors are linearly dependent.
fn source_powers<const N: usize>(
    phases: &[f64],
    covariance: &Covariance<N>,
    noise_variance: f64,
) -> Option<SourcePowers<N>> {
    let sources = phases.len();
    let steering = bound::steering_matrix::<N>(phases);
    let adjoint_steering = adjoint(&steering);
    let gram = product(&adjoint_steering, &steering, [sources, N, sources]);
    let pseudo_inverse = product(
        &inverse(gram, sources)?,
        &adjoint_steering,
        [sources, sources, N],
    );
    let mut signal = covariance.matrix();
    for (n, row) in signal.iter_mut().enumerate() {
        row[n] -= noise_variance;
    }
    let half = product(&pseudo_inverse, &signal, [sources, N, N]);
    let powers = product(&half, &adjoint(&pseudo_inverse), [sources, N, sources]);
    Some(SourcePowers(powers))
}
