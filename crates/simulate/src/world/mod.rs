//! The truth: where the road runs, how the vehicle moves on it, what its odometer makes of that.

mod array_drift;
mod faults;
mod lane_keeping;
mod motion;
mod odometer;
mod radio_head;
mod track;
mod vehicle;

pub use array_drift::ArrayDrift;
pub use faults::Faults;
pub use lane_keeping::LaneKeeping;
pub use motion::{Motion, MotionProfile};
pub use odometer::Odometer;
pub use radio_head::RadioHead;
pub use track::{Gap, Projection, Segment, Track, TrackError};
pub use vehicle::{Vehicle, VehicleState};
