//! What an estimate of azimuth and elevation says.

use super::goodness_of_fit::GoodnessOfFit;
use super::verdict::{Reason, Verdict};
use crate::array::manifold::Direction;

/// A direction in space, and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionEstimate {
    /// Azimuth and elevation.
    pub direction: Direction,
    /// Covariance of (azimuth, elevation) in rad^2: that of noise and, where the model does not fit
    /// ([`GoodnessOfFit::misfit`]), what the misfit displaces. Zero where the elevation is given.
    pub covariance: [[f64; 2]; 2],
    /// That of noise alone, from the bound at the estimated SNR.
    pub noise_covariance: [[f64; 2]; 2],
    /// Estimated SNR per antenna (their mean, where they differ) and snapshot. Whatever the source leaves
    /// counts as noise.
    pub snr_db: f64,
    /// How well one plane wave and white noise explain what was received.
    pub fit: GoodnessOfFit,
    /// Whether noise and geometry leave a doubt of it.
    pub verdict: Verdict,
}

impl DirectionEstimate {
    /// Standard deviation of the azimuth.
    pub fn azimuth_sigma_rad(&self) -> f64 {
        self.covariance[0][0].sqrt()
    }

    /// Standard deviation of the elevation.
    pub fn elevation_sigma_rad(&self) -> f64 {
        self.covariance[1][1].sqrt()
    }

    /// Whether the verdict is [`Verdict::Resolved`].
    pub fn is_resolved(&self) -> bool {
        self.verdict == Verdict::Resolved
    }

    /// Why the estimate should not be relied on: it is not resolved, or the model does not fit.
    pub fn doubt(&self) -> Option<Reason> {
        self.verdict.reason().or_else(|| self.fit.misfit())
    }

    /// Whether the estimate may be relied on: it is resolved, and the model fits.
    pub fn is_reliable(&self) -> bool {
        self.doubt().is_none()
    }
}
