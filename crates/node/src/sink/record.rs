//! Records: the results of the drive that the pipeline gives to the outputs.

use onboard::live::{AngleRecord, HeadStatus, LiveEnergy, Status};
use schemars::JsonSchema;
use serde::Serialize;

use crate::health::OutputStatus;
use crate::inbox::Level;

/// Cause of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PoseCause {
    /// An odometry sample; there is one pose for each.
    Odometry,
    /// The angles of a burst.
    Angles,
}

/// A pose and its integrity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRecord {
    /// State, pose and covariance.
    pub status: Status,
    /// Cause of the pose.
    pub by: PoseCause,
}

/// A record for the outputs.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// A pose.
    Pose(PoseRecord),
    /// The result of an angle.
    Verdict(AngleRecord),
    /// State of the whole node, once a second.
    Status {
        /// State, pose and reason.
        status: Status,
        /// The radio heads.
        heads: Vec<HeadStatus>,
        /// Number of operations and their energy.
        energy: LiveEnergy,
        /// Health of the outputs.
        outputs: Vec<OutputStatus>,
        /// Time of the drive (s).
        time_s: f64,
    },
    /// An event.
    Event {
        /// Time of the drive (s); `None` before the first input.
        time_s: Option<f64>,
        /// Severity.
        level: Level,
        /// Part of the node that reports.
        source: &'static str,
        /// Description.
        text: String,
        /// Number of occurrences since the last report of this cause.
        count: u64,
    },
}
