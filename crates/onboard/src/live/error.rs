//! Errors of a live pipeline, which leave its state unchanged.

use super::time_check::{MAX_ANGLE_LEAD_S, TimeDefect};
use crate::BoxError;
use crate::pipeline::OdometryDefect;
use crate::receive::ReceiveError;
use crate::settings::SettingsError;

/// Rejection of an input by a live pipeline; the state is unchanged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// Site, vehicle and platform are incompatible.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The rate or frequency of the samples does not match the SSB, their lengths differ, or the
    /// number of antennas is wrong.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// Samples were passed without a configured stream.
    #[error("samples, but no stream of samples was configured")]
    NoStream,
    /// Invalid value.
    #[error("{what} is {value}; {allowed}")]
    Value {
        /// Name of the quantity.
        what: &'static str,
        /// Invalid value.
        value: f64,
        /// Allowed values.
        allowed: &'static str,
    },
    /// Implausible time stamp.
    #[error("{what}: {defect}")]
    Time {
        /// Kind of the input.
        what: &'static str,
        /// Cause of the rejection.
        defect: TimeDefect,
    },
    /// An angle whose time is ahead of the odometry.
    #[error(
        "angle: time_s is {by_s:.3} s ahead of the odometry; at most {MAX_ANGLE_LEAD_S} s are allowed; the clocks of angles or samples and of odometry must agree"
    )]
    AngleAhead {
        /// Time from the odometry to the angle, in seconds.
        by_s: f64,
    },
    /// An angle that was received before.
    #[error("angle: a copy of the last angle of PCI {pci}; give each angle once")]
    AngleRepeated {
        /// Physical cell identity.
        pci: u16,
    },
    /// Odometry that cannot be used.
    #[error("odometry: {0}")]
    Odometry(#[from] OdometryDefect),
    /// Cell that the vehicle does not receive.
    #[error(
        "no radio head with PCI {pci}: the site does not contain it, or \
         receiver.pci_allow_list excludes it"
    )]
    UnknownCell {
        /// Physical cell identity.
        pci: u16,
    },
    /// Custom localizer, which this operation does not support.
    #[error("the localizer is custom code: set or reset its pose there")]
    OwnLocalizer,
    /// Error of a custom estimator, policy or localizer.
    #[error("{0}")]
    Custom(BoxError),
}

impl LiveError {
    /// Returns a short name of the cause, for counters and to group events.
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
