//! One source, by any method.

use super::choice::{Method, checked_grid};
use crate::array::linear::Array;
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::eigen::principal_eigenvector;
use crate::method::{esprit, maximum_likelihood, music, root_music};
use crate::result::angle::AngleEstimate;
use crate::result::direction::describe;
use crate::result::verdict::Reason;

/// Direction of the strongest source.
///
/// The covariance is of the snapshots as received: the array's calibration is applied here.
///
/// # Errors
/// If the covariance is empty, zero or not finite, or the method's grid makes no sense.
pub fn estimate<const N: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
) -> Result<AngleEstimate, Error> {
    let covariance = covariance.calibrated(array).validated()?;
    let spectrum = covariance.spectrum();
    let (phase_rad, excess) = match method {
        Method::MaximumLikelihood => (spectrum.maximum().0, 1.0),
        Method::Music { grid_deg, refine } => {
            let signal = music::signal_spectrum_of_one(&covariance);
            (
                music::phase(&signal, array, checked_grid(grid_deg)?, refine),
                1.0,
            )
        }
        Method::RootMusic => {
            let signal = music::signal_spectrum_of_one(&covariance);
            (root_music::phase(&signal), 1.0)
        }
        Method::EspritLs | Method::EspritTls => {
            let (_, principal) = principal_eigenvector(covariance.unscaled());
            (esprit::phase(&principal), esprit::excess::<N>())
        }
    };
    let beam = spectrum.value(phase_rad) / N as f64;
    let noise = maximum_likelihood::residual_power::<N>(spectrum.lags[0].re, beam);
    let snr = maximum_likelihood::snr::<N>(beam, noise);
    let snapshots = covariance.snapshots();
    let sigma = bound::stochastic::<N>(snr, snapshots) * excess;
    let threshold = snr < bound::resolvable_snr::<N>(snapshots);
    Ok(describe(
        phase_rad,
        sigma,
        snr,
        threshold.then_some(Reason::ThresholdSnr),
        array,
    ))
}
