//! How far the estimate can be trusted.

mod alternative;
mod angle_noise;
mod bank;
mod config;
mod evidence;
mod former;
mod guard;
mod level;
mod otherwise;
mod sequence_test;
mod slip;
#[cfg(test)]
mod trip;

pub use config::IntegrityConfig;
pub use guard::Guard;
pub use level::{Hypothesis, LevelEquation, Levels};
pub use sequence_test::SequenceTest;
