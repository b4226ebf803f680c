//! Where a localizer believes the vehicle to be, and how far that can be relied on.

use crate::gaussian;
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

/// Where the vehicle is said to be at first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialPose {
    /// The pose.
    pub pose: Pose,
    /// Standard deviation in each of x and y (m).
    pub position_std_m: f64,
    /// Standard deviation of the heading (rad).
    pub heading_std_rad: f64,
}

/// Whether the position can be relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum IntegrityState {
    /// The protection level holds and is below the alert limit.
    Ok,
    /// The protection level is above the alert limit, or a fault cannot be pinned down.
    Degraded,
    /// Several sources disagree at once, as when the array itself is at fault.
    Unavailable,
}

impl IntegrityState {
    /// Name for files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Degraded => "degraded",
            Self::Unavailable => "unavailable",
        }
    }
}

/// Protection level and state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrity {
    /// Horizontal protection level (m).
    pub protection_level_m: f64,
    /// Protection level along the vehicle's heading (m).
    pub protection_level_along_m: f64,
    /// Protection level across it (m).
    pub protection_level_across_m: f64,
    /// What it amounts to.
    pub state: IntegrityState,
    /// Radio heads found faulty.
    pub faulty: usize,
}

impl Integrity {
    /// Unavailable, with one level in every direction.
    pub const fn unavailable(level_m: f64) -> Self {
        Self {
            protection_level_m: level_m,
            protection_level_along_m: level_m,
            protection_level_across_m: level_m,
            state: IntegrityState::Unavailable,
            faulty: 0,
        }
    }

    /// Raises every level to `least_m`.
    pub const fn raise(&mut self, least_m: f64) {
        self.protection_level_m = self.protection_level_m.max(least_m);
        self.protection_level_along_m = self.protection_level_along_m.max(least_m);
        self.protection_level_across_m = self.protection_level_across_m.max(least_m);
    }
}
