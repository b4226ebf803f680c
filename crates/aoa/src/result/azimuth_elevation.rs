//! Estimate of azimuth and elevation.

use super::goodness_of_fit::GoodnessOfFit;
use super::verdict::{Reason, Verdict};
use crate::array::manifold::Direction;

/// Estimated direction in space with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionEstimate {
    /// Azimuth and elevation.
    pub direction: Direction,
    /// Covariance of (azimuth, elevation) in rad^2 due to noise and, if the model does not fit
    /// ([`GoodnessOfFit::misfit`]), due to the misfit. The elevation has zero variance if it is
    /// fixed.
    pub covariance: [[f64; 2]; 2],
    /// Covariance due to noise only, according to the bound at the estimated SNR, in rad^2.
    pub noise_covariance: [[f64; 2]; 2],
    /// Estimated SNR per antenna (mean over the antennas) and snapshot. The whole residual counts
    /// as noise.
    pub snr_db: f64,
    /// Goodness of fit of one plane wave and white noise.
    pub fit: GoodnessOfFit,
    /// Whether the estimate is resolved with respect to noise and geometry.
    pub verdict: Verdict,
}

impl DirectionEstimate {
    /// Returns the standard deviation of the azimuth in rad.
    pub fn azimuth_sigma_rad(&self) -> f64 {
        self.covariance[0][0].sqrt()
    }

    /// Returns the standard deviation of the elevation in rad.
    pub fn elevation_sigma_rad(&self) -> f64 {
        self.covariance[1][1].sqrt()
    }

    /// Whether the verdict is [`Verdict::Resolved`].
    pub fn is_resolved(&self) -> bool {
        self.verdict == Verdict::Resolved
    }

    /// Returns the reason why the estimate is unreliable: it is not resolved, or the model does not
    /// fit. Returns `None` for a reliable estimate.
    pub fn doubt(&self) -> Option<Reason> {
        self.verdict.reason().or_else(|| self.fit.misfit())
    }

    /// Whether the estimate is reliable: it is resolved, and the model fits.
    pub fn is_reliable(&self) -> bool {
        self.doubt().is_none()
    }
}
