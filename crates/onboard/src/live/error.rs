//! What a live pipeline refuses. Its state is kept.

use super::time_check::{MAX_ANGLE_LEAD_S, TimeDefect};
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
    /// A time stamp that is not plausible.
    #[error("{what}: {defect}")]
    Time {
        /// Kind of the input.
        what: &'static str,
        /// Cause.
        defect: TimeDefect,
    },
    /// An angle whose time is ahead of the odometry.
    #[error(
        "angle: time_s is {by_s:.3} s ahead of the odometry; at most {MAX_ANGLE_LEAD_S} s are allowed; the clocks of angles or samples and of odometry must agree"
    )]
    AngleAhead {
        /// Time by which it is ahead, in seconds.
        by_s: f64,
    },
    /// An angle that was received before.
    #[error("angle: a copy of the last one of PCI {pci}; each angle counts once")]
    AngleRepeated {
        /// Physical cell identity.
        pci: u16,
    },
    /// Odometry that cannot be used.
    #[error("odometry: {0}")]
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

impl LiveError {
    /// Short name of the cause, for counters and to group events.
    pub const fn cause(&self) -> &'static str {
        match self {
            Self::Time { defect, .. } => defect.name(),
            Self::AngleAhead { .. } => "angle ahead of the odometry",
            Self::AngleRepeated { .. } => "angle repeated",
            Self::Odometry(_) => "odometry value",
            Self::Value { .. } => "value",
            Self::Receive(_) | Self::NoStream => "samples",
            Self::Settings(_) => "settings",
            Self::UnknownCell { .. } => "unknown cell",
            Self::OwnLocalizer => "own localizer",
            Self::Custom(_) => "own code",
        }
    }
}
