//! Angle of arrival from the snapshots of an SSB.

mod angle_estimator;
mod array_estimator;
mod likelihood;

pub use angle_estimator::{AngleEstimator, EstimatedAngle};
pub use array_estimator::{ArrayEstimator, AzimuthEstimator, built_in, measurement};
