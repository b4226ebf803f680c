//! Outputs. Each runs on a thread of its own, with a bounded queue, a health state and retries.

mod distributor;
mod file;
mod json;
mod mcap;
mod message;
mod mqtt;
mod output;
mod queue;
mod record;
mod runner;
mod tum;
mod vda5050;

pub use distributor::{Distributor, Lane};
pub use message::{EnergyMessage, HeadMessage, Message, PoseFields, reference, schema};
pub use output::Sink;
pub use record::{PoseCause, PoseRecord, Record};
pub use runner::{Running, sinks, start};
pub use vda5050::{Localized, VdaPosition, position};
