//! How far the estimate can be trusted.

mod guard;
mod quantile;
mod sequence_test;

pub use guard::{Guard, Integrity, IntegrityConfig, IntegrityState};
pub use quantile::{RadialQuantile, normal_quantile};
pub use sequence_test::SequenceTest;
