//! What became of the angles, and of each radio head.

use crate::localize::PoseEstimate;
use crate::pipeline::Execution;
use crate::radio_head::RadioHead;

/// One angle and what became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// SSB, angle and verdict.
    pub execution: Execution,
    /// By how much it lies from where the radio head is seen from the pose after it: electrical angle, or
    /// azimuth of an array that is no row, in radians; `None` without angle or radio head.
    pub residual_rad: Option<f64>,
    /// The pose after its burst, at the newer of the burst and the newest odometry.
    pub after: PoseEstimate,
}

/// What is known of the reception of one radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadStatus {
    /// The radio head.
    pub head: RadioHead,
    /// Whether [`Live::exclude`](super::Live::exclude) leaves it out.
    pub is_excluded: bool,
    /// Whether the integrity monitor has left out its last angle: it is found faulty.
    pub is_faulty: bool,
    /// SNR per antenna and resource element of its last SSB, in dB.
    pub snr_db: Option<f64>,
    /// Time of the last SSB an angle was estimated of, in seconds ...
    pub last_heard_s: Option<f64>,
    /// ... and of the last one whose angle was accepted.
    pub last_accepted_s: Option<f64>,
    /// Residual of its last angle in radians; see [`Outcome::residual_rad`].
    pub residual_rad: Option<f64>,
    /// Angles accepted ...
    pub accepted: u64,
    /// ... and those that were not.
    pub refused: u64,
}

impl HeadStatus {
    /// Of one that was not heard yet.
    pub const fn new(head: RadioHead) -> Self {
        Self {
            head,
            is_excluded: false,
            is_faulty: false,
            snr_db: None,
            last_heard_s: None,
            last_accepted_s: None,
            residual_rad: None,
            accepted: 0,
            refused: 0,
        }
    }
}
