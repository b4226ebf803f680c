//! Where poses go, all of it on one thread.

mod file;
mod json;
mod mcap;
mod mqtt;
mod queue;
mod record;
mod start;
mod tum;
mod vda5050;

pub use queue::Queue;
pub use record::{By, PoseRecord, Record, energy_json, head_json, status_json};
pub use start::{Sinks, start};
pub use vda5050::{Localized, position};
