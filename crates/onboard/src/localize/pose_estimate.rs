//! Where a localizer believes the vehicle to be.

use super::gaussian;
use super::integrity_state::Integrity;
use crate::geometry::{Pose, wrap_angle};

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
    /// The covariance about this estimate where one of several others is right, each with a probability.
    pub fn mix(&mut self, others: impl Iterator<Item = (f64, Self)>) {
        let mut mixed = [[0.0; 3]; 3];
        for (probability, other) in others {
            let mut alone = Self {
                covariance: Some([[0.0; 3]; 3]),
                ..*self
            };
            alone.cover(&other);
            for (sum, row) in mixed.iter_mut().zip(alone.covariance.unwrap_or_default()) {
                for (sum, value) in sum.iter_mut().zip(row) {
                    *sum += probability * value;
                }
            }
        }
        self.covariance = Some(mixed);
    }

    /// Widens the covariance by another estimate that may be the right one.
    pub fn cover(&mut self, other: &Self) {
        let apart = [
            other.pose.x_m - self.pose.x_m,
            other.pose.y_m - self.pose.y_m,
            wrap_angle(other.pose.heading_rad - self.pose.heading_rad),
        ];
        if let (Some(own), Some(theirs)) = (&mut self.covariance, &other.covariance) {
            for ((row, theirs), a) in own.iter_mut().zip(theirs).zip(apart) {
                for ((value, theirs), b) in row.iter_mut().zip(theirs).zip(apart) {
                    *value += theirs + a * b;
                }
            }
        }
    }

    /// Variances of the horizontal error along its principal axes, larger first, in m²; infinite
    /// where the localizer does not know them.
    pub fn principal_variances(&self) -> [f64; 2] {
        let Some([[xx, xy, _], [_, yy, _], _]) = self.covariance else {
            return [f64::INFINITY; 2];
        };
        gaussian::principal_variances(xx, xy, yy)
    }
}
