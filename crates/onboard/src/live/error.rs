//! What a live pipeline refuses. Its state is kept.

use crate::BoxError;
use crate::pipeline::OdometryDefect;
use crate::receive::ReceiveError;
use crate::settings::SettingsError;

/// What a live pipeline refuses; its state is then as before.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// Site, vehicle and platform do not go together.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Rate or frequency of the samples do not suit the SSB, their lengths differ, or they are of another
    /// number of antennas.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// Samples, where none were announced.
    #[error("samples, but no stream of samples was configured")]
    NoStream,
    /// A value that is not possible.
    #[error("{what} is {value}; {allowed}")]
    Value {
        /// What it is of.
        what: &'static str,
        /// The value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Odometry that cannot be used.
    #[error("odometry left out: {0}")]
    Odometry(#[from] OdometryDefect),
    /// A cell that the vehicle does not listen to.
    #[error("no radio head with PCI {pci} at this site that the vehicle listens to")]
    UnknownCell {
        /// Physical cell identity.
        pci: u16,
    },
    /// A localizer of the user's own, which is to be told by its maker.
    #[error("the localizer is not the built-in one: a pose or a reset is for its maker to give it")]
    OwnLocalizer,
    /// Whatever a user's own estimator, policy or localizer failed with.
    #[error("{0}")]
    Custom(BoxError),
}
