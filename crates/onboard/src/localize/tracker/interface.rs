//! What goes into the tracker and comes out of it.

use crate::geometry::Pose;

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
        matches!(
            self,
            Self::Accepted
                | Self::First
                | Self::AfterGap { .. }
                | Self::BeyondMap { .. }
                | Self::InMapGap { .. }
                | Self::DistanceJump { .. }
                | Self::YawRateRefused { .. }
        )
    }
}
