//! Protection level and integrity state.

mod monitor;
mod protection_level;

pub use monitor::IntegrityMonitor;
pub use protection_level::{Hypothesis, LevelEquation, Levels};
