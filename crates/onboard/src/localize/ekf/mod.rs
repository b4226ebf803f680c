//! Extended Kalman filter for pose, odometer scale and array calibration, with odometry as the
//! prediction and electrical angles as the measurements.
//!
//! The noise of the electrical angle `ω = 2π (d/λ) cos θ` is Gaussian, with a variance independent
//! of the direction. The angle θ has neither property near end-fire, where a filter of θ would be
//! overconfident. Scatter is a second noise, identical for all measurements within half a
//! wavelength of travel, and counted once per half wavelength.

pub mod angle_model;
mod config;
mod filter;
mod forecast;
mod free_motion;
mod lane;
pub mod motion;
mod odometer;
mod predict;
mod prior;
mod range;
pub mod state;
mod update;
mod white_noise_fraction;

pub use angle_model::ArrayModel;
pub use config::EkfConfig;
pub use filter::{Ekf, EstimatedConstant, EstimatedConstants};
pub(in crate::localize) use forecast::ExcludedInnovation;
pub(crate) use free_motion::FreeMotion;
pub use motion::{MotionNoise, PathBend};
pub(in crate::localize) use predict::MAX_SLIP;
pub use range::RangeState;
pub(in crate::localize) use range::{OUTLIERS, PredictedRange, with_range_outliers};
pub(in crate::localize) use update::PredictedMeasurement;
