//! What a localizer answers: verdicts on odometry and angles, and the pose with its integrity.

use crate::gaussian;
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
    /// The covariance about this estimate where one of several others is right, each with a probability.
    pub fn mix(&mut self, others: impl Iterator<Item = (f64, Self)>) {
        let mut mixed = [[0.0; 3]; 3];
        for (probability, other) in others {
            other.add_about(self.pose, probability, &mut mixed);
        }
        self.covariance = Some(mixed);
    }

    /// Widens the covariance by another estimate that may be the right one.
    pub fn cover(&mut self, other: &Self) {
        if let Some(own) = &mut self.covariance {
            other.add_about(self.pose, 1.0, own);
        }
    }

    /// Adds its second moments about a pose to a covariance, by a weight.
    pub(super) fn add_about(&self, pose: Pose, weight: f64, covariance: &mut [[f64; 3]; 3]) {
        let (Some(own), apart) = (self.covariance, pose.offset_of(self.pose)) else {
            return;
        };
        for ((row, own), a) in covariance.iter_mut().zip(own).zip(apart) {
            for ((value, own), b) in row.iter_mut().zip(own).zip(apart) {
                *value += weight * (own + a * b);
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

/// What a localizer did with an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateVerdict {
    /// Whether the angle changed the pose.
    pub accepted: bool,
    /// Why, or why not.
    pub reason: UpdateReason,
    /// Squared Mahalanobis distance of the innovation, where the localizer has a covariance.
    pub mahalanobis_squared: Option<f64>,
    /// The largest it may be.
    pub threshold: Option<f64>,
}

impl UpdateVerdict {
    /// An angle that never met the localizer's covariance.
    pub const fn unused(reason: UpdateReason) -> Self {
        Self {
            accepted: false,
            reason,
            mahalanobis_squared: None,
            threshold: None,
        }
    }
}

/// Why an angle was taken or left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum UpdateReason {
    /// It agrees with the prediction, or there is none to compare it with.
    Consistent,
    /// It lies too far from the prediction.
    Outlier,
    /// It carries no angle: no number, no valid standard deviation, no resolved source, or a radio
    /// head within a metre of the array.
    Unusable,
    /// No radio head with this PCI and SSB index is on the map.
    UnknownRadioHead,
    /// It is older than what the localizer can go back to.
    TooLate,
    /// Its radio head is excluded, by the user or as faulty.
    Excluded,
}

impl UpdateReason {
    /// Short name for logs and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Outlier => "outlier",
            Self::Unusable => "unusable",
            Self::UnknownRadioHead => "unknown radio head",
            Self::TooLate => "too late",
            Self::Excluded => "excluded",
        }
    }
}

/// What became of one odometry sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OdometryVerdict {
    /// Used.
    Accepted,
    /// The first one: it sets the origin of the distance.
    First,
    /// Used, after this many seconds without odometry.
    AfterGap {
        /// Length of the gap in seconds.
        gap_s: f64,
    },
    /// Used, as in the plane: the vehicle has certainly driven off the end of the map.
    BeyondMap {
        /// How far from its end, in metres.
        by_m: f64,
    },
    /// Used, as in the plane: the vehicle may be where the road was not surveyed.
    InMapGap {
        /// Where that stretch begins, along the road in metres.
        from_m: f64,
        /// Where it ends.
        to_m: f64,
    },
    /// The distance jumped; the speed was used instead, with its uncertainty.
    DistanceJump {
        /// By how much, in metres.
        jump_m: f64,
    },
    /// Used, but for its yaw rate, by which no vehicle turns: it turned on as before.
    YawRateRefused {
        /// What was read, in rad/s.
        radps: f64,
    },
    /// Refused: the same time as the one before.
    Duplicate,
    /// Refused: older than the one before.
    TimeBackwards,
    /// Refused: a value that is not a number.
    NotFinite,
}

impl OdometryVerdict {
    /// Whether the sample moved the state.
    pub const fn accepted(&self) -> bool {
        !matches!(
            self,
            Self::Duplicate | Self::TimeBackwards | Self::NotFinite
        )
    }
}
