//! How far the estimate can be trusted.

mod bank;
mod config;
mod guard;
mod separation;
mod sequence_test;

pub use config::IntegrityConfig;
pub use guard::Guard;
pub use separation::SeparatedRadius;
pub use sequence_test::SequenceTest;
