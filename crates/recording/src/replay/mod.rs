//! A recorded drive through the pipeline: odometry and SSBs, or angles, in order of time.

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

pub use drive::Replay;
pub use error::ReplayError;
pub use innovations::{Met, innovations};
pub use locate::{locate_angles, locate_recording};
pub use located::{LocatedDrive, LocatedPose, Remark};
pub use receive::receive_recording;
pub use start::{StartChoice, starting};
pub use stated::as_stated;
