//! The first pose, and the pose after the vehicle was lost.

mod consistency;
mod gaussian_sum;
mod phase;
mod relocalization_test;
mod relocalizer;

pub use gaussian_sum::GaussianSum;
pub use relocalizer::Relocalizer;
