//! What an estimate of azimuth and elevation says.

use super::goodness_of_fit::GoodnessOfFit;
use super::verdict::Verdict;
use crate::array::manifold::Direction;

/// A direction in space, and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionEstimate {
    /// Azimuth and elevation.
    pub direction: Direction,
    /// Covariance of (azimuth, elevation) in rad^2: that of noise and, where the model does not fit
    /// ([`Reason::is_misfit`](crate::Reason::is_misfit)), what the misfit displaces. Zero where the
    /// elevation is given.
    pub covariance: [[f64; 2]; 2],
    /// That of noise alone, from the bound at the estimated SNR.
    pub noise_covariance: [[f64; 2]; 2],
    /// Estimated SNR per antenna (their mean, where they differ) and snapshot. Whatever the source leaves
    /// counts as noise.
    pub snr_db: f64,
    /// How well one plane wave and white noise explain what was received.
    pub fit: GoodnessOfFit,
    /// Whether the estimate may be relied on.
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
}
