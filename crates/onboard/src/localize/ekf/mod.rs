//! The extended Kalman filter over pose, odometer scale and array calibration, predicted by odometry and updated by
//! electrical angles.
//!
//! The electrical angle `ω = 2π (d/λ) cos θ` has Gaussian noise whose size does not depend on the
//! direction; the angle θ has neither property near end-fire, and a filter that takes θ believes
//! itself far too much there. Scatter is a second noise, the same for every measurement within half a
//! wavelength of travel, and is counted once per half wavelength.

pub mod angle_model;
mod config;
mod filter;
mod forecast;
mod lane;
pub mod motion;
mod odometer;
mod predict;
mod prior;
pub mod state;
mod update;
mod white_share;

pub use angle_model::ArrayModel;
pub use config::EkfConfig;
pub use filter::{Ekf, EstimatedConstant, EstimatedConstants};
pub(in crate::localize) use forecast::ExcludedInnovation;
pub use motion::{MotionNoise, PathBend};
pub(in crate::localize) use predict::MOST_SLIP;
pub(in crate::localize) use update::PredictedMeasurement;
