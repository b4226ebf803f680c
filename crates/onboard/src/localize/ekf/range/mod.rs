//! Updates with ranges, range rates and carrier phases: one file per kind with prediction,
//! Jacobian, noise and offset.

mod blocked_path;
mod carrier_phase;
mod clock_step;
mod distance;
mod late_path;
mod noise;
mod outliers;
mod pseudorange;
mod range_rate;
mod update;

pub(super) use blocked_path::BlockedPath;
pub(super) use clock_step::ClockStepTest;
pub(super) use late_path::LatePath;
pub(super) use noise::RangeNoise;
pub(in crate::localize) use outliers::{OUTLIERS, with_range_outliers};
pub(in crate::localize) use pseudorange::PredictedRange;
pub use update::RangeState;
