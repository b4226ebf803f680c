//! Estimate of one source.

use super::choice::Method;
use super::side_by_side::SideBySide;
use crate::array::linear::Array;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::result::angle::{AngleEstimate, UntestedEstimate};
use crate::result::direction::Output;

/// Returns the direction of the strongest source.
///
/// The covariance is that of the received snapshots; the array's calibration is applied here.
///
/// # Errors
/// An error if the covariance is empty, zero or not finite.
pub fn estimate<const N: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
) -> Result<AngleEstimate, Error> {
    strongest(method, covariance, array)
}

/// Returns the direction of the strongest source like [`estimate`], without the goodness of fit.
///
/// # Errors
/// Errors of [`estimate`].
pub fn estimate_untested<const N: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
) -> Result<UntestedEstimate, Error> {
    strongest(method, covariance, array)
}

fn strongest<O: Output + Default, const N: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
) -> Result<O, Error> {
    let covariance = covariance.calibrated(array).validated()?;
    let single = SideBySide {
        method,
        array,
        forward_backward: false,
        snapshots: covariance.snapshots(),
    };
    single.of_covariance(covariance.unscaled())
}
