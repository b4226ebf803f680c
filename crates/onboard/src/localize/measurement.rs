//! What localizers take, and what becomes of it: angles of arrival and odometry.

/// An angle of arrival as a localizer takes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleMeasurement {
    /// Time in seconds.
    pub time_s: f64,
    /// Electrical angle ω = 2π(d/λ)·cos θ between neighbouring antennas of a row, in radians; of any
    /// other array the azimuth from its axis.
    pub phase_rad: f64,
    /// Its standard deviation from noise, in radians.
    pub phase_sigma_rad: f64,
    /// Angle of arrival θ from the array's axis, in radians: 0..=π of a row, −π..=π of any other.
    pub angle_rad: f64,
    /// SNR per antenna and snapshot, in dB.
    pub snr_db: f64,
    /// Whether the estimator vouches for it: that it is Gaussian with this standard deviation.
    pub resolved: bool,
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
