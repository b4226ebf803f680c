//! Several sources, by any method that can tell them apart.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::choice::{Method, checked_grid};
use super::one::estimate;
use crate::array::linear::Array;
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::dense::{adjoint, inverse, product};
use crate::linalg::eigen::{HermitianEigen, hermitian_eigen};
use crate::list::List;
use crate::method::{esprit, music, root_music};
use crate::result::angle::{AngleEstimate, AngleEstimates};
use crate::result::direction::describe;
use crate::result::verdict::Reason;
use crate::spectrum::polynomial::wrap;

/// Directions of `sources` sources, by ascending angle.
///
/// # Errors
/// As [`estimate`]; [`Error::TooManySources`] unless `sources` is 1 to N - 1 (1 for maximum
/// likelihood); [`Error::Singular`] if ESPRIT's equations have no solution.
pub fn estimate_several<const N: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
    sources: usize,
) -> Result<AngleEstimates<N>, Error> {
    let maximum = method.maximum_sources::<N>();
    if sources == 0 || sources > maximum {
        return Err(Error::TooManySources {
            requested: sources,
            maximum,
        });
    }
    if sources == 1 {
        let only = estimate(method, covariance, array)?;
        return Ok(List::collect(only, [only]));
    }
    let covariance = covariance.calibrated(array).validated()?;
    let eigen = hermitian_eigen(covariance.matrix(), N);
    let mut phases = subspace_phases(method, &eigen, sources, array)?;
    let mut separated = phases.len() == sources;
    if !separated {
        // The spectrum has fewer peaks than sources; the roots of the same polynomial are complete.
        phases = subspace_phases(Method::RootMusic, &eigen, sources, array)?;
    }
    let noise_variance = eigen.values[sources..].iter().sum::<f64>() / (N - sources) as f64;
    let noise_variance = noise_variance.max(eigen.values[0] * 1e-15);
    let strengths = strengths(&phases, &covariance, noise_variance);
    separated &= strengths.is_some();
    let strengths = strengths.unwrap_or(Strengths {
        snr: [1e-9; N],
        phase_sigma_rad: [PI; N],
    });
    let weakest = (eigen.values[sources - 1] / noise_variance - 1.0) / N as f64;
    let hidden = weakest < bound::resolvable_snr::<N>(covariance.snapshots());
    let mut estimates = [None; N];
    for (k, place) in estimates[..sources].iter_mut().enumerate() {
        let (phase, sigma) = (phases[k], strengths.phase_sigma_rad[k]);
        let close = (0..sources).any(|other| {
            let gap = wrap(phases[other] - phase).abs();
            other != k && gap < 2.0 * sigma.hypot(strengths.phase_sigma_rad[other])
        });
        let doubt = if hidden {
            Some(Reason::ThresholdSnr)
        } else if close || !separated {
            Some(Reason::SourcesNotSeparated)
        } else {
            None
        };
        *place = Some(describe(phase, sigma, strengths.snr[k], doubt, array));
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

/// Electrical angles from the eigenvectors.
fn subspace_phases<const N: usize>(
    method: Method,
    eigen: &HermitianEigen<N>,
    sources: usize,
    array: &Array<N>,
) -> Result<List<f64, N>, Error> {
    match method {
        Method::Music { grid_deg, refine } => {
            let spectrum = music::signal_spectrum(eigen, sources);
            Ok(music::phases(
                &spectrum,
                sources,
                array,
                checked_grid(grid_deg)?,
                refine,
            ))
        }
        Method::MaximumLikelihood | Method::RootMusic => {
            let null = music::null_spectrum(eigen, sources);
            Ok(root_music::phases(&null, sources))
        }
        Method::EspritLs => esprit::least_squares(eigen, sources).ok_or(Error::Singular),
        Method::EspritTls => esprit::total_least_squares(eigen, sources).ok_or(Error::Singular),
    }
}

struct Strengths<const N: usize> {
    snr: [f64; N],
    phase_sigma_rad: [f64; N],
}

/// Each source's SNR, from `S = A^+ (R - sigma^2 I) A^+H`, and the stochastic bound for that `S`.
/// `None` if the steering vectors do not tell the sources apart.
fn strengths<const N: usize>(
    phases: &[f64],
    covariance: &Covariance<N>,
    noise_variance: f64,
) -> Option<Strengths<N>> {
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
    let mut powers = product(&half, &adjoint(&pseudo_inverse), [sources, N, sources]);
    let floor = noise_variance * 1e-9;
    for k in 0..sources {
        powers[k][k] = Complex64::from(powers[k][k].re.max(floor));
    }
    let sigma =
        bound::stochastic_of(phases, &powers, noise_variance, covariance.snapshots()).ok()?;
    let mut strengths = Strengths {
        snr: [0.0; N],
        phase_sigma_rad: [0.0; N],
    };
    for k in 0..sources {
        strengths.snr[k] = powers[k][k].re / noise_variance;
        strengths.phase_sigma_rad[k] = sigma[k];
    }
    Some(strengths)
}
