//! Errors of a simulation.

use onboard::BoxError;
use onboard::receive::ReceiveError;
use onboard::settings::SettingsError;
use thiserror::Error;

/// Error that ends a simulation.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// The scenario and the platform are incompatible.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The user's own estimator, policy or localizer failed.
    #[error("{0}")]
    Custom(BoxError),
    /// An SSB of the scenario cannot be synthesised as samples.
    #[error("samples: {0}")]
    Samples(#[from] nr_ssb::Error),
    /// The receiver rejects the samples.
    #[error("receiver: {0}")]
    Receive(#[from] ReceiveError),
    /// The thread pool cannot be created.
    #[error("no threads to run on: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// The run or method is not part of the traces.
    #[error("no trace of this run")]
    NotTraced,
    /// The caller stopped the simulation.
    #[error("stopped")]
    Stopped,
}

impl SimulationError {
    /// Converts the error of a drive to a simulation error; other errors are from the user's own
    /// code.
    pub(crate) fn of_drive(error: BoxError) -> Self {
        match error.downcast::<Self>() {
            Ok(own) => *own,
            Err(custom) => Self::Custom(custom),
        }
    }
}
