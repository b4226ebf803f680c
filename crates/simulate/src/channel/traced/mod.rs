//! Ray-traced channels: file of paths, and propagation along the paths.

mod npy;
mod paths;
mod propagation;
mod read;

pub use paths::{Paths, PathsError};
pub use propagation::TracedPropagation;
