//! Pose estimation from odometry and angles. [`Localizer`] is the interface for plug-ins;
//! [`DeadReckoning`] is the smallest example.
//!
//! Layers of the built-in localizer: an extended Kalman filter ([`ekf`]) that may estimate a
//! time-correlated bias of the angles ([`bias`]); a bank of such filters, one for each fault mode
//! ([`modes`]); protection level and integrity state ([`integrity`]); search for the initial pose
//! and relocalization ([`acquire`]); and out-of-sequence measurements ([`OutOfSequenceBuffer`]).

pub mod acquire;
pub mod bias;
mod choose;
mod dead_reckoning;
pub mod ekf;
pub mod integrity;
mod localizer;
pub mod modes;
mod out_of_sequence;
mod output;

pub use crate::observation::{AngleMeasurement, MeasurementKind};
pub use choose::built_in;
pub use dead_reckoning::DeadReckoning;
pub use ekf::Ekf;
pub use localizer::{Localizer, Recovered, copy_into};
pub use modes::AngleEvidence;
pub use out_of_sequence::{
    AngleUpdate, HISTORY_S, Measurement, OutOfSequenceBuffer, RangeUpdate, Update,
};
pub use output::{
    InitialPose, Integrity, IntegrityState, OdometryResult, PoseEstimate, SelectedHypothesis,
    UpdateReason, UpdateResult,
};
