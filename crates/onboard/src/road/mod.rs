//! Road geometry and lane keeping.

mod build;
mod course;
mod lane_keeping;
mod segment;
mod smooth;

pub use build::RoadError;
pub use course::{Bending, Gap, Projection, Road};
pub use lane_keeping::LaneKeeping;
pub use segment::Segment;
