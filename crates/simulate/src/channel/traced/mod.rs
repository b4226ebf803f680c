//! Channels that a ray tracer has found: a file of paths, and the propagation along them.

mod paths;
mod propagation;
mod read;

pub use paths::{Paths, PathsError};
pub use propagation::TracedPropagation;
