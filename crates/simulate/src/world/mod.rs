//! True motion and sensors of the vehicle.

mod antennas;
mod array;
mod faults;
mod motion_profile;
mod odometer;
mod path;

pub use antennas::Antennas;
pub use array::{LineOfSight, TrueArray};
pub use faults::Faults;
pub use motion_profile::{Motion, MotionProfile};
pub use odometer::Odometer;
pub use path::{Path, VehicleState};
