//! Interface of angle estimators.

use crate::BoxError;
use crate::observation::SsbObservation;

/// Estimator of an angle from the snapshots of an SSB. [`ArrayEstimator`](super::ArrayEstimator) is
/// an example.
pub trait AngleEstimator: Send {
    /// Returns the angle of an SSB; `None` if the snapshots contain no angle (all zero, not finite,
    /// or no snapshots).
    ///
    /// # Errors
    /// Errors of the estimator; an error ends the drive.
    fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<EstimatedAngle>, BoxError>;
}

/// Estimate of the electrical angle ω = 2π(d/λ)·cos θ between neighbouring antennas of a uniform
/// linear array, or of the azimuth from the array axis otherwise
/// ([`Measurand`](crate::manifold::Measurand)).
#[derive(Debug, Clone, PartialEq)]
pub enum EstimatedAngle {
    /// One angle.
    Angle {
        /// Electrical angle, or azimuth, in radians.
        phase_rad: f64,
        /// Standard deviation due to noise, in radians. Default: the Cramér–Rao bound at the SNR of
        /// the SSB.
        phase_sigma_rad: Option<f64>,
        /// SNR per antenna and snapshot in dB, if it was estimated.
        snr_db: Option<f64>,
        /// Whether the error is Gaussian with this standard deviation, according to the estimator.
        resolved: bool,
    },
    /// Log-likelihood, up to a constant, at equally spaced angles from −π (included) to π
    /// (excluded). The localizer uses its circular mean and standard deviation.
    LogLikelihood(Vec<f64>),
}
