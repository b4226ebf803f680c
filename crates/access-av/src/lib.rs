//! ACCESS-AV: where a vehicle is, from the synchronization signal blocks (SSBs) of 5G cells.
//!
//! The angle of arrival at the vehicle's antenna array, wheel odometry and the known place of the
//! radio heads give a pose; a wake-up policy decides how often an angle is worth its energy.
//! Simulation and the vehicle drive the same pipeline.
//!
//! SI units and radians throughout, with the unit in every name. Frames follow REP-103: `map` is
//! right-handed, headings run counter-clockwise from +x. Angles of arrival are measured from the
//! vehicle's forward axis.

pub mod geometry;
pub mod localize;
pub mod observation;
pub mod scenario;
pub mod world;
