//! Where a localizer believes the vehicle to be.

use super::gaussian;
use super::integrity_state::Integrity;
use crate::geometry::Pose;

/// Where a localizer believes the vehicle to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseEstimate {
    /// Time in seconds.
    pub time_s: f64,
    /// Place and heading.
    pub pose: Pose,
    /// Covariance of (x, y, heading), row-major, in m², m·rad and rad²; `None` where the
    /// localizer does not know its own error.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Protection level and state, where the localizer is guarded.
    pub integrity: Option<Integrity>,
}

impl PoseEstimate {
    /// Variances of the horizontal error along its principal axes, larger first, in m²; infinite
    /// where the localizer does not know them.
    pub fn principal_variances(&self) -> [f64; 2] {
        let Some([[xx, xy, _], [_, yy, _], _]) = self.covariance else {
            return [f64::INFINITY; 2];
        };
        gaussian::principal_variances(xx, xy, yy)
    }
}
