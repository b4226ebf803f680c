//! Simulated drives: one run, and campaigns of many.

mod bootstrap;
mod campaign;
mod consistency;
mod histogram;
mod ideal;
mod integrity_summary;
mod iq_reception;
mod run;
mod synth;

use thiserror::Error;

pub use bootstrap::bootstrap_interval;
pub use campaign::{Campaign, CampaignOptions, RunSummary, StepStatistics};
pub use consistency::Consistency;
pub use histogram::ErrorHistogram;
pub use integrity_summary::IntegritySummary;
pub use run::{Found, RunRecord, Simulation, Step};
pub use synth::{SynthError, SynthSettings, Synthesized, synthesize};

use crate::BoxError;
use crate::receive::ReceiveError;
use crate::scenario::ScenarioError;

/// Why a simulation ended early.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// The scenario and the platform do not go together.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The user's own estimator or policy failed.
    #[error("{0}")]
    Custom(BoxError),
    /// An SSB of the scenario cannot be sent as samples.
    #[error("samples: {0}")]
    Samples(#[from] nr_ssb::Error),
    /// The receiver refuses its samples.
    #[error("receiver: {0}")]
    Receive(#[from] ReceiveError),
    /// The threads asked for cannot be had.
    #[error("no threads to run on: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped,
}
