//! Outputs of a localizer: verdicts on odometry and angles, and the pose with its integrity.

use crate::gaussian;
use crate::geometry::Pose;

/// Estimated pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseEstimate {
    /// Time in seconds.
    pub time_s: f64,
    /// Position and heading.
    pub pose: Pose,
    /// Covariance of (x, y, heading), row-major, in m², m·rad and rad²; `None` if the localizer
    /// does not estimate it.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Protection level and state, if the localizer is monitored.
    pub integrity: Option<Integrity>,
}

impl PoseEstimate {
    /// Extends the covariance by other estimates, each correct with a given probability.
    pub fn mix(&mut self, others: impl Iterator<Item = (f64, Self)>) {
        let mut mixed = [[0.0; 3]; 3];
        for (probability, other) in others {
            other.add_about(self.pose, probability, &mut mixed);
        }
        self.covariance = Some(mixed);
    }

    /// Extends the covariance by another estimate that may be the correct one.
    pub fn cover(&mut self, other: &Self) {
        if let Some(own) = &mut self.covariance {
            other.add_about(self.pose, 1.0, own);
        }
    }

    /// Adds its second moments about a pose to a covariance, with a weight.
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

    /// Returns the variances of the horizontal error along its principal axes, larger first, in m²;
    /// infinite if there is no covariance.
    pub fn principal_variances(&self) -> [f64; 2] {
        let Some([[xx, xy, _], [_, yy, _], _]) = self.covariance else {
            return [f64::INFINITY; 2];
        };
        gaussian::principal_variances(xx, xy, yy)
    }
}

/// Given initial pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialPose {
    /// The pose.
    pub pose: Pose,
    /// Standard deviation of x and y, each (m).
    pub position_std_m: f64,
    /// Standard deviation of the heading (rad).
    pub heading_std_rad: f64,
}

/// Integrity state: whether the position may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum IntegrityState {
    /// The protection level is valid and below the alert limit.
    Ok,
    /// The protection level exceeds the alert limit, or a fault is not identified.
    Degraded,
    /// Several sources contradict each other, for example with an array fault.
    Unavailable,
}

impl IntegrityState {
    /// Returns the name for files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Degraded => "degraded",
            Self::Unavailable => "unavailable",
        }
    }
}

/// Hypothesis that explains the measurements best, and whose position is reported. The state does
/// not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SelectedHypothesis {
    /// Every error is within its specified standard deviation.
    Nominal,
    /// Radio heads are identified as faulty and excluded; every other error is nominal.
    RadioHeadsExcluded,
    /// Wheel slip.
    WheelSlip,
    /// Wrong mounting angle or phases of the array.
    UncalibratedArray,
    /// Odometer noise above the specified one.
    NoisyOdometer,
    /// Displacement of the whole site plan.
    DisplacedSite,
    /// Persistent biases of radio heads.
    BiasedRadioHeads,
    /// Angle noise above the specified one.
    NoisyAngles,
}

impl SelectedHypothesis {
    /// All hypotheses.
    pub const ALL: [Self; 8] = [
        Self::Nominal,
        Self::RadioHeadsExcluded,
        Self::WheelSlip,
        Self::UncalibratedArray,
        Self::NoisyOdometer,
        Self::DisplacedSite,
        Self::BiasedRadioHeads,
        Self::NoisyAngles,
    ];

    /// Returns the name for files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nominal => "nominal",
            Self::RadioHeadsExcluded => "radio_heads_excluded",
            Self::WheelSlip => "wheel_slip",
            Self::UncalibratedArray => "uncalibrated_array",
            Self::NoisyOdometer => "noisy_odometer",
            Self::DisplacedSite => "displaced_site",
            Self::BiasedRadioHeads => "biased_radio_heads",
            Self::NoisyAngles => "noisy_angles",
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
    /// Protection level across the vehicle's heading (m).
    pub protection_level_across_m: f64,
    /// State that follows from the protection level and the faults.
    pub state: IntegrityState,
    /// Selected hypothesis.
    pub hypothesis: SelectedHypothesis,
    /// Number of radio heads identified as faulty.
    pub faulty: usize,
}

impl Integrity {
    /// Creates the state `unavailable` with one level in every direction.
    pub const fn unavailable(level_m: f64) -> Self {
        Self {
            protection_level_m: level_m,
            protection_level_along_m: level_m,
            protection_level_across_m: level_m,
            state: IntegrityState::Unavailable,
            hypothesis: SelectedHypothesis::Nominal,
            faulty: 0,
        }
    }

    /// Raises every level to a minimum of `min_m`.
    pub const fn raise(&mut self, min_m: f64) {
        self.protection_level_m = self.protection_level_m.max(min_m);
        self.protection_level_along_m = self.protection_level_along_m.max(min_m);
        self.protection_level_across_m = self.protection_level_across_m.max(min_m);
    }
}

/// Result of an update with an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateResult {
    /// Whether the angle changed the pose.
    pub accepted: bool,
    /// Reason for acceptance or rejection.
    pub reason: UpdateReason,
    /// Squared Mahalanobis distance of the innovation, if the localizer has a covariance.
    pub mahalanobis_squared: Option<f64>,
    /// Gate of the squared Mahalanobis distance.
    pub threshold: Option<f64>,
}

impl UpdateResult {
    /// Creates the verdict on an angle without an innovation.
    pub const fn unused(reason: UpdateReason) -> Self {
        Self {
            accepted: false,
            reason,
            mahalanobis_squared: None,
            threshold: None,
        }
    }
}

/// Reason for the acceptance or rejection of an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum UpdateReason {
    /// The angle agrees with the prediction, or there is no prediction.
    Consistent,
    /// The innovation exceeds the gate.
    Outlier,
    /// The measurement contains no angle: not finite, no valid standard deviation, no resolved
    /// source, or a radio head within a metre of the array.
    Unusable,
    /// The site has no radio head with this PCI and SSB index.
    UnknownRadioHead,
    /// The angle is older than the stored history.
    TooLate,
    /// The radio head is excluded, by the user or as faulty.
    Excluded,
}

impl UpdateReason {
    /// Returns the short name for logs and tables.
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

/// Result of the processing of an odometry sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OdometryResult {
    /// The sample was used.
    Accepted,
    /// First sample: it defines the origin of the distance.
    First,
    /// The sample was used after a gap in the odometry.
    AfterGap {
        /// Duration of the gap in seconds.
        gap_s: f64,
    },
    /// The sample was used without the map, because the vehicle is certainly beyond the end of the
    /// road.
    BeyondMap {
        /// Distance beyond the end, in metres.
        by_m: f64,
    },
    /// The sample was used without the map, because the vehicle may be on an unsurveyed stretch.
    InMapGap {
        /// Start of the stretch, along the road in metres.
        from_m: f64,
        /// End of the stretch.
        to_m: f64,
    },
    /// The distance jumped; the speed was used instead, with its uncertainty.
    DistanceJump {
        /// Size of the jump, in metres.
        jump_m: f64,
    },
    /// The sample was used without its physically impossible yaw rate; the previous rate was
    /// continued.
    YawRateRefused {
        /// Measured yaw rate, in rad/s.
        radps: f64,
    },
    /// Rejected: equal time to the previous sample.
    Duplicate,
    /// Rejected: older than the previous sample.
    TimeBackwards,
    /// Rejected: a value is not finite.
    NotFinite,
}

impl OdometryResult {
    /// Whether the sample changed the state.
    pub const fn accepted(&self) -> bool {
        !matches!(
            self,
            Self::Duplicate | Self::TimeBackwards | Self::NotFinite
        )
    }
}
