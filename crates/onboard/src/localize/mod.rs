//! From odometry and angles to a pose. [`Localizer`] is the door for others; [`DeadReckoning`] is
//! the smallest one to copy from.

mod area;
mod choose;
mod contest;
mod dead_reckoning;
pub mod gaussian;
mod history;
mod initialise;
pub mod integrity;
mod integrity_state;
mod localizer;
mod measurement;
mod pose_estimate;
mod quantile;
mod recovery;
mod search;
pub mod smoother;
pub mod thermal;
mod tracked;
pub mod tracker;
mod watch;

pub use area::Area;
pub use choose::built_in;
pub use dead_reckoning::DeadReckoning;
pub use history::{HISTORY_S, History, Sighted};
pub use initialise::Initialiser;
pub use integrity_state::{Integrity, IntegrityState};
pub use localizer::{Localizer, Recovered, copy_into};
pub use measurement::{AngleMeasurement, UpdateReason, UpdateVerdict};
pub use pose_estimate::PoseEstimate;
pub use quantile::{RadialQuantile, normal_quantile};
pub use recovery::Recovery;
pub use search::Search;
pub use tracker::Tracker;
