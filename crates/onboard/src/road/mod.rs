//! Road geometry and lane keeping.

mod build;
mod course;
mod lane_keeping;
mod smooth;

pub use build::{RoadError, Segment};
pub use course::{Bending, Gap, Projection, Road};
pub use lane_keeping::LaneKeeping;
