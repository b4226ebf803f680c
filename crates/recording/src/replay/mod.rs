//! Replay of a recorded drive: odometry and SSBs, or angles, are processed in order of time.

mod angles;
mod clock;
mod data_quality;
mod diagnosis;
mod direction;
mod drive;
mod error;
mod evidence;
mod hypotheses;
mod innovations;
mod locate;
mod located;
mod moved_head;
mod ranges;
mod receive;
mod start;
mod stated;
mod time_units;
mod yaw_rate;

pub use angles::{RecordedAngles, all_of_error, estimate_angles, scatter_sigma_rad};
pub use drive::Replay;
pub use error::ReplayError;
pub use innovations::{InnovationRecord, innovations};
pub use locate::{locate_angles, locate_recording};
pub use located::{Diagnosis, LocatedDrive, LocatedPose, LocatedRange, Remark};
pub use ranges::locate_ranges;
pub use receive::{InferredGap, receive_recording};
pub use start::{StartChoice, starting};
pub use stated::{as_stated, with_phase};
pub use time_units::check_times;
