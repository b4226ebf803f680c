//! From odometry and angles to a pose. [`Localizer`] is the door for others; [`DeadReckoning`] is
//! the smallest one to copy from.
//!
//! The built-in one, from the inside out: an extended Kalman filter ([`ekf`]) that may estimate a time-correlated
//! bias of the angles ([`bias`]); a bank of such filters, one for each fault mode ([`modes`]); protection level and
//! integrity state from their separation ([`integrity`]); acquisition of the first pose and relocalization
//! ([`acquire`]); and measurements that come out of sequence ([`History`]).

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
pub use out_of_sequence::{AngleUpdate, HISTORY_S, History};
pub use output::{
    InitialPose, Integrity, IntegrityState, OdometryVerdict, PoseEstimate, UpdateReason,
    UpdateVerdict,
};
