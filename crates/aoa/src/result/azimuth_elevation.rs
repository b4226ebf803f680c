//! What an estimate of azimuth and elevation says.

use super::verdict::Verdict;
use crate::array::manifold::Direction;

/// A direction in space, and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionEstimate {
    /// Azimuth and elevation.
    pub direction: Direction,
    /// Covariance of (azimuth, elevation) in rad^2, from the bound at the estimated SNR; zero where the
    /// elevation is given.
    pub covariance: [[f64; 2]; 2],
    /// Estimated SNR per antenna (their mean, where they differ) and snapshot.
    pub snr_db: f64,
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
