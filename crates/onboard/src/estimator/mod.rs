//! From an SSB's snapshots to its angle of arrival.

mod angle_estimator;
mod array_estimator;
mod likelihood;

pub use angle_estimator::{AngleEstimator, EstimatedAngle};
pub use array_estimator::{ArrayEstimator, AzimuthEstimator, built_in, measurement};
