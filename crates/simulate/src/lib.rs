//! Simulation of vehicles: true motion, channels and faults, and campaigns of runs.
//!
//! A [`Scenario`](scenario::Scenario) contains the nominal models of site and vehicle and the
//! deviations of the truth. Only [`truth`] derives the truth from the nominal models.

mod angle_drive;
pub mod bound;
mod campaign;
pub mod channel;
mod cholesky;
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
pub use campaign::{Campaign, CampaignOptions, RunSummary, StepStatistics};
pub use error::SimulationError;
pub use histogram::ErrorHistogram;
pub use integrity_summary::IntegritySummary;
pub use measurement_trace::MeasurementTraces;
pub use record::{Found, RunRecord, Step};
pub use run::{MakeCustom, Simulation};
pub use synth::{SynthError, SynthSettings, Synthesized, synthesize};
