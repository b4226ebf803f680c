//! The gains of the receive channels, from a source in a known direction.

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
    /// The principal eigenvector of the covariance is the array's response to the source; divided
    /// by the steering vector it leaves the gains. Their common factor cannot be seen: channel 0
    /// gets phase 0, the mean power gain is 1.
    ///
    /// # Errors
    /// [`Error::Angle`] for an impossible direction, [`Error::CalibrationGain`] if a channel is
    /// silent, and those of [`Covariance::from_snapshots`].
    pub fn from_reference(
        snapshots: &[[Complex64; N]],
        array: &Array<N>,
        angle_rad: f64,
    ) -> Result<Self, Error> {
        Self::from_reference_covariance(&Covariance::from_snapshots(snapshots)?, array, angle_rad)
    }

    /// As [`Calibration::from_reference`], from the covariance of the snapshots.
    ///
    /// # Errors
    /// As [`Calibration::from_reference`].
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
