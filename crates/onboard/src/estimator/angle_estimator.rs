//! The door for estimators.

use crate::BoxError;
use crate::observation::SsbObservation;

/// What turns the snapshots of an SSB into an angle. To write one, copy
/// [`ArrayEstimator`](super::ArrayEstimator).
pub trait AngleEstimator: Send {
    /// The electrical angle of an SSB; `None` where its snapshots carry none (all zero, not finite,
    /// none at all).
    ///
    /// # Errors
    /// Whatever the estimator fails with; it ends the drive.
    fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<EstimatedAngle>, BoxError>;
}

/// What an estimator says of the electrical angle ω = 2π(d/λ)·cos θ between neighbours in a row, or of
/// the azimuth from the axis of any other array ([`Measurand`](crate::manifold::Measurand)).
#[derive(Debug, Clone, PartialEq)]
pub enum EstimatedAngle {
    /// One angle.
    Angle {
        /// Electrical angle, or azimuth, in radians.
        phase_rad: f64,
        /// Its standard deviation from noise, in radians; without it, the Cramér–Rao bound at the
        /// SSB's SNR is taken.
        phase_sigma_rad: Option<f64>,
        /// SNR per antenna and snapshot in dB, as far as it was estimated along.
        snr_db: Option<f64>,
        /// Whether the estimator vouches for it: that it is Gaussian with this standard deviation.
        resolved: bool,
    },
    /// The logarithm of its likelihood, up to a constant, at equally many and equally spaced
    /// such angles from −π (included) to π (not included). The localizer takes its mean and
    /// spread on the circle.
    LogLikelihood(Vec<f64>),
}
