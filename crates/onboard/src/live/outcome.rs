//! Results of angles, and reception status of radio heads.

use crate::localize::PoseEstimate;
use crate::pipeline::AngleResult;
use crate::radio_head::RadioHead;

/// Angle with its verdict, its residual and the resulting pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleRecord {
    /// SSB, angle and verdict.
    pub angle_result: AngleResult,
    /// Measured minus predicted angle for the pose after the update: electrical angle, or azimuth
    /// of a non-linear array, in radians; `None` without an angle or radio head.
    pub residual_rad: Option<f64>,
    /// Pose after the burst, at the later of the burst and the newest odometry.
    pub after: PoseEstimate,
}

/// Reception status of one radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadStatus {
    /// The radio head.
    pub head: RadioHead,
    /// Whether [`Live::exclude`](super::Live::exclude) has excluded the radio head.
    pub is_excluded: bool,
    /// Whether the integrity monitor has identified the radio head as faulty and excluded its last
    /// angle.
    pub is_faulty: bool,
    /// SNR of the last SSB of the radio head, per antenna and resource element, in dB.
    pub snr_db: Option<f64>,
    /// Time of the last SSB with an angle estimate, in seconds.
    pub last_angle_s: Option<f64>,
    /// Time of the last SSB with an accepted angle, in seconds.
    pub last_accepted_s: Option<f64>,
    /// Residual of the last angle in radians; see [`AngleRecord::residual_rad`].
    pub residual_rad: Option<f64>,
    /// Number of accepted angles.
    pub accepted: u64,
    /// Number of rejected angles.
    pub refused: u64,
}

impl HeadStatus {
    /// Creates the status of a radio head without angles.
    pub const fn new(head: RadioHead) -> Self {
        Self {
            head,
            is_excluded: false,
            is_faulty: false,
            snr_db: None,
            last_angle_s: None,
            last_accepted_s: None,
            residual_rad: None,
            accepted: 0,
            refused: 0,
        }
    }
}
