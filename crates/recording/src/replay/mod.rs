//! A recorded drive through the pipeline: odometry and SSBs, or angles, in order of time.

mod angles;
mod bursts;
mod doubts;
mod drive;
mod error;
mod innovations;
mod locate;
mod located;
mod mistakes;
mod receive;
mod start;
mod stated;
mod suspicion;

pub use angles::{RecordedAngles, all_of_error, estimate_angles, scatter_sigma_rad};
pub use drive::Replay;
pub use error::ReplayError;
pub use innovations::{Met, innovations};
pub use locate::{locate_angles, locate_recording};
pub use located::{LocatedDrive, LocatedPose, Remark};
pub use receive::receive_recording;
pub use start::{StartChoice, starting};
pub use stated::as_stated;
