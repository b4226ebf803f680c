//! How far the estimate can be trusted.

mod angle_noise;
mod bank;
mod config;
mod guard;
mod separation;
mod sequence_test;
mod slip;

pub use config::IntegrityConfig;
pub use guard::Guard;
pub use separation::SeparatedRadius;
pub use sequence_test::SequenceTest;
