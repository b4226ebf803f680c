//! What is really so: motion, channel and faults around a vehicle, and campaigns of its drives.
//!
//! A [`Scenario`](scenario::Scenario) holds what is believed of site and vehicle, and how the world
//! departs from it; [`truth`] makes the one from the other, and nothing else does.

mod angle_drive;
mod bootstrap;
pub mod bound;
mod campaign;
pub mod channel;
mod cholesky;
mod consistency;
mod error;
mod histogram;
mod ideal_campaign;
pub mod ideal_filter;
mod integrity_summary;
mod iq_reception;
mod measurement_trace;
mod phasor;
pub mod random;
mod record;
mod run;
pub mod scenario;
mod snapshot_reception;
mod synth;
pub mod truth;
pub mod world;

pub use angle_drive::log_angles;
pub use bootstrap::bootstrap_interval;
pub use campaign::{Campaign, CampaignOptions, RunSummary, StepStatistics};
pub use consistency::Consistency;
pub use error::SimulationError;
pub use histogram::ErrorHistogram;
pub use integrity_summary::IntegritySummary;
pub use measurement_trace::MeasurementTraces;
pub use record::{Found, RunRecord, Step};
pub use run::{MakeCustom, Simulation};
pub use synth::{SynthError, SynthSettings, Synthesized, synthesize};
