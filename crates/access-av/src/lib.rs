//! ACCESS-AV: where a vehicle is, from the synchronization signal blocks (SSBs) of 5G cells.
//!
//! The angle of arrival at the vehicle's antenna array, wheel odometry and the known place of the
//! radio heads give a pose; a wake-up policy decides how often an angle is worth its energy.
//! Simulation and the vehicle drive the same pipeline.
//!
//! SI units and radians throughout, with the unit in every name. Frames follow REP-103: `map` is
//! right-handed, headings run counter-clockwise from +x. Angles of arrival are measured from the
//! vehicle's forward axis.

pub mod channel;
pub mod energy;
pub mod estimator;
pub mod geometry;
pub mod localize;
pub mod observation;
pub mod onboard;
pub mod platform;
pub mod random;
pub mod receive;
pub mod recording;
pub mod replay;
pub mod scenario;
pub mod simulate;
pub mod wake_up;
pub mod world;

/// Whatever a user's own code fails with.
pub type BoxError = Box<dyn std::error::Error + Send + Sync>;
