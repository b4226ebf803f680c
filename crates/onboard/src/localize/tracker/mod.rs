//! The tracker: an extended Kalman filter over pose, odometer scale and array calibration,
//! predicted by odometry and updated by electrical angles.
//!
//! The electrical angle `ω = 2π (d/λ) cos θ` has Gaussian noise whose size does not depend on the
//! direction; the angle θ has neither property near end-fire, and a filter that takes θ believes
//! itself far too much there. Scatter is a second noise, the same for every look within half a
//! wavelength of travel, and is counted once per half wavelength.

mod calibration;
mod config;
mod doubt;
mod filter;
mod findings;
mod forecast;
mod interface;
mod journal;
mod locate;
mod look;
mod map_watch;
pub mod motion;
mod off_map;
mod pace;
mod place;
mod prior;
pub mod sighting;
mod speed_steps;
pub mod state;
mod staying_change;
mod staying_error;
mod staying_errors;

pub use calibration::{Calibration, Departure};
pub use config::TrackerConfig;
pub(in crate::localize) use filter::MOST_SLIP;
pub use filter::Tracker;
pub use findings::{Finding, Findings};
pub(in crate::localize) use forecast::Rehearsal;
pub use interface::{InitialPose, OdometryVerdict};
pub(in crate::localize) use look::Look;
pub use motion::{MotionNoise, PathBend};
pub use sighting::ArrayModel;
