//! A drive that has been located.

use onboard::Execution;
use onboard::localize::PoseEstimate;
use onboard::localize::tracker::Calibration;

/// Where the vehicle was at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocatedPose {
    /// Time, pose and covariance.
    pub estimate: PoseEstimate,
    /// Odometer speed in m/s.
    pub speed_mps: f64,
    /// Yaw rate in rad/s, where there is a gyroscope.
    pub yaw_rate_radps: Option<f64>,
    /// Number of places the vehicle may be at, while the first pose is searched for; the estimate
    /// is their mean.
    pub searching: Option<usize>,
    /// Whether the angles came from elsewhere than expected, so that the pose is not to be relied on.
    pub is_lost: bool,
    /// How far the array has come from its survey.
    pub calibration: Option<Calibration>,
}

/// What is remarkable about one item of the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// When in the drive it came, in seconds.
    pub time_s: f64,
    /// Which item, what is wrong with it, and whether it was left out.
    pub text: String,
}

/// A located drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LocatedDrive {
    /// One pose per odometry sample.
    pub poses: Vec<LocatedPose>,
    /// The angles and what became of them.
    pub executions: Vec<Execution>,
    /// The poses as seen from the end of the drive, from the first known one on, where asked for.
    pub smoothed: Vec<LocatedPose>,
    /// What was remarkable about single items of the input, in order of time.
    pub remarks: Vec<Remark>,
}
