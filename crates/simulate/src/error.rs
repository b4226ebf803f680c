//! Why a simulation ended early.

use onboard::BoxError;
use onboard::receive::ReceiveError;
use onboard::settings::SettingsError;
use thiserror::Error;

/// Why a simulation ended early.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// The scenario and the platform do not go together.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The user's own estimator, policy or localizer failed.
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
    /// A run or method that was not recorded.
    #[error("no trace of this run")]
    NotTraced,
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped,
}

impl SimulationError {
    /// What ended a drive: the user's own code, or the simulation's end of it.
    pub(crate) fn of_drive(error: BoxError) -> Self {
        match error.downcast::<Self>() {
            Ok(own) => *own,
            Err(custom) => Self::Custom(custom),
        }
    }
}
