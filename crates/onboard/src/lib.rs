//! Software on the vehicle: inputs are odometry and SSBs; outputs are poses, verdicts and the next
//! wake-up.
//!
//! The pose is estimated from the angle of arrival at the vehicle's antenna array, wheel odometry
//! and the known positions of the radio heads. A wake-up policy determines when an angle is
//! estimated. [`Pipeline`] is the pipeline, identical in simulation, replay and on the vehicle. Its
//! nominal model of plant and vehicle is in [`settings`]. This crate does not access the truth of a
//! simulation, and uses no random numbers, threads or files.
//!
//! All quantities are in SI units and radians, and names contain the unit. Frames follow REP-103:
//! `map` is right-handed, and headings are counter-clockwise from +x. Angles of arrival are
//! relative to the vehicle's forward axis.

pub mod burst;
mod clone_in_place;
mod elements;
pub mod energy;
pub mod estimator;
pub mod expected_angle;
pub mod gaussian;
pub mod geometry;
pub mod link_budget;
pub mod live;
pub mod localize;
pub mod manifold;
pub mod monitor;
pub mod observation;
mod pipeline;
pub mod plausible;
pub mod radio_head;
pub mod range;
pub mod receive;
pub mod road;
pub mod settings;
pub mod thermal;
pub mod time_unit;
pub mod wake_up;
pub mod walls;

pub use live::Live;
pub use pipeline::{
    AngleResult, BurstResult, Custom, OdometryDefect, Pipeline, SsbInput, SsbSource,
};

/// Error of user code.
pub type BoxError = Box<dyn std::error::Error + Send + Sync>;
