//! How far the estimate can be trusted.

mod bank;
mod guard;
mod quantile;
mod separation;
mod sequence_test;

pub use guard::{Guard, Integrity, IntegrityConfig, IntegrityState};
pub use quantile::{RadialQuantile, normal_quantile};
pub use separation::SeparatedRadius;
pub use sequence_test::SequenceTest;
