//! How far the estimate can be trusted.

mod monitor;
mod protection_level;

pub use monitor::IntegrityMonitor;
pub use protection_level::{Hypothesis, LevelEquation, Levels};
