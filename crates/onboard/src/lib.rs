//! What runs on the vehicle: odometry and SSBs in; poses, verdicts and the next wake-up out.
//!
//! The angle of arrival at the vehicle's antenna array, wheel odometry and the known place of the
//! radio heads give a pose; a wake-up policy decides how often an angle is worth its energy.
//! [`Onboard`] is the pipeline, the same in simulation, replay and on the vehicle. What it believes
//! of plant and vehicle is in [`settings`]; nothing here knows what is really so, draws random
//! numbers, starts threads or opens files.
//!
//! SI units and radians throughout, with the unit in every name. Frames follow REP-103: `map` is
//! right-handed, headings run counter-clockwise from +x. Angles of arrival are measured from the
//! vehicle's forward axis.

pub mod burst;
mod clone_in_place;
mod elements;
pub mod energy;
pub mod estimator;
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
pub mod receive;
pub mod road;
pub mod settings;
pub mod sight;
pub mod thermal;
pub mod time_unit;
pub mod wake_up;
pub mod walls;

pub use live::Live;
pub use pipeline::{Custom, Execution, Heard, Observed, OdometryDefect, Onboard, SsbSource};

/// Whatever a user's own code fails with.
pub type BoxError = Box<dyn std::error::Error + Send + Sync>;
