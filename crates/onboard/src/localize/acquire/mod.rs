//! Search for the initial pose, and relocalization of a lost vehicle.

mod consistency;
mod gaussian_sum;
mod heading_search;
mod phase;
mod relocalization_test;
mod relocalizer;

pub use gaussian_sum::GaussianSum;
pub use relocalizer::Relocalizer;
