//! Gain and phase of the receive channels.

use crate::array::steering_vector;
use crate::eigen::principal_eigenvector;
use crate::{Array, Complex64, Covariance, Error};

/// One complex gain per channel. Estimators divide what channel `n` received by gain `n`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration<const N: usize> {
    gains: [Complex64; N],
}

impl<const N: usize> Calibration<N> {
    /// Ideal channels.
    pub const IDENTITY: Self = Self {
        gains: [Complex64::ONE; N],
    };

    /// Channels with these gains.
    ///
    /// # Errors
    /// [`Error::CalibrationGain`] if a gain is zero or not finite.
    pub fn new(gains: [Complex64; N]) -> Result<Self, Error> {
        match gains.iter().position(|gain| !gain.norm_sqr().is_normal()) {
            Some(channel) => Err(Error::CalibrationGain(channel)),
            None => Ok(Self { gains }),
        }
    }

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
        let (_, response) = principal_eigenvector(covariance.unscaled());
        let steering = steering_vector::<N>(array.phase_from_angle(angle_rad));
        let first = response[0] / steering[0];
        let common = Complex64::from_polar((N as f64).sqrt(), -first.arg());
        Self::new(std::array::from_fn(|n| {
            response[n] * steering[n].conj() * common
        }))
    }

    /// The gains, one per channel.
    pub const fn gains(&self) -> &[Complex64; N] {
        &self.gains
    }

    /// A snapshot as ideal channels would have received it.
    pub fn apply(&self, snapshot: &[Complex64; N]) -> [Complex64; N] {
        std::array::from_fn(|n| snapshot[n] / self.gains[n])
    }
}

impl<const N: usize> Default for Calibration<N> {
    fn default() -> Self {
        Self::IDENTITY
    }
}
