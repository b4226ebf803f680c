//! Calibration of the channel gains with a source in a known direction.

use num_complex::Complex64;

use crate::array::calibration::Calibration;
use crate::array::linear::Array;
use crate::array::steering::steering_vector;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::hermitians::principal_eigenvector;

impl<const N: usize> Calibration<N> {
    /// Estimates the gains from snapshots of one source in a known direction.
    ///
    /// The principal eigenvector of the covariance is the array's response to the source. Its
    /// quotient with the steering vector is the vector of gains. The common factor is unobservable:
    /// channel 0 gets phase 0, and the mean power gain is 1.
    ///
    /// # Errors
    /// [`Error::Angle`] for an invalid direction; [`Error::CalibrationGain`] if a channel has no
    /// signal; errors of [`Covariance::from_snapshots`].
    pub fn from_reference(
        snapshots: &[[Complex64; N]],
        array: &Array<N>,
        angle_rad: f64,
    ) -> Result<Self, Error> {
        Self::from_reference_covariance(&Covariance::from_snapshots(snapshots)?, array, angle_rad)
    }

    /// Estimates the gains from the covariance of snapshots; see [`Calibration::from_reference`].
    ///
    /// # Errors
    /// See [`Calibration::from_reference`].
    pub fn from_reference_covariance(
        covariance: &Covariance<N>,
        array: &Array<N>,
        angle_rad: f64,
    ) -> Result<Self, Error> {
        if !(0.0..=std::f64::consts::PI).contains(&angle_rad) {
            return Err(Error::Angle(angle_rad));
        }
        let covariance = covariance.validated()?;
        let response = principal_eigenvector(covariance.unscaled());
        let steering = steering_vector::<N>(array.phase_from_angle(angle_rad));
        let first = response[0] / steering[0];
        let common = Complex64::from_polar((N as f64).sqrt(), -first.arg());
        Self::new(std::array::from_fn(|n| {
            response[n] * steering[n].conj() * common
        }))
    }
}
