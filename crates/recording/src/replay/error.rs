//! Why a drive cannot be located.

use onboard::BoxError;
use onboard::receive::ReceiveError;
use onboard::settings::SettingsError;
use onboard::time_unit::TimeUnit;
use thiserror::Error;

use crate::error::RecordingError;

/// Why a drive cannot be located.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// Site, vehicle or platform cannot be used.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The receiver refuses the samples.
    #[error("{file}: {source}")]
    Receive {
        /// The recording.
        file: String,
        /// Why.
        source: ReceiveError,
    },
    /// The recording's rate or band does not suit the site.
    #[error("{file}: {source}")]
    FrontEnd {
        /// The recording.
        file: String,
        /// Why.
        source: nr_ssb::front_end::FrontEndError,
    },
    /// A start that is no time.
    #[error("the recording's start time is {start_time_s} s; it must be finite")]
    StartTime {
        /// What was given.
        start_time_s: f64,
    },
    /// Times that are not in seconds.
    #[error(
        "{of}: `{field}` is in {unit}, by steps of {step} between {samples}; it must be in seconds: divide it by \
         {:e}", unit.per_second()
    )]
    TimeUnit {
        /// "odometry" or "angles".
        of: &'static str,
        /// The field of the time.
        field: &'static str,
        /// The likely unit.
        unit: TimeUnit,
        /// "samples" or "angles".
        samples: &'static str,
        /// Median step between them, in that unit.
        step: f64,
    },
    /// Angles and odometry of different times.
    #[error(
        "no angle falls into the odometry's time: odometry is from {} to {} s, angles from {} to {} s, \
         {:.3} s apart; both must be told by one clock",
        odometry_s[0], odometry_s[1], angles_s[0], angles_s[1], apart_s(odometry_s, angles_s)
    )]
    Clocks {
        /// Times of the first and the last odometry sample (s).
        odometry_s: [f64; 2],
        /// Times of the first and the last angle (s).
        angles_s: [f64; 2],
    },
    /// No radio head of the site is heard.
    #[error(
        "not one of {angles} angles is of a radio head of the site; check pci and ssb_index in both"
    )]
    UnknownRadioHeads {
        /// Number of angles.
        angles: usize,
    },
    /// Less than two usable samples of odometry.
    #[error("the odometry holds fewer than two usable samples{}", because(why.as_ref()))]
    NoOdometry {
        /// What is wrong with the first that cannot be used.
        why: Option<String>,
    },
    /// No SSB in the recording.
    #[error(
        "{file}: no SSB of a radio head of the site is in it; check the carrier, the band, and \
         pci and ssb_index; `access-av scan` tells which cells there are"
    )]
    NoSsb {
        /// The recording.
        file: String,
    },
    /// No usable angle.
    #[error("the angle log holds no usable angle{}", because(why.as_ref()))]
    NoAngle {
        /// What is wrong with the first that cannot be used.
        why: Option<String>,
    },
    /// The user's own code failed.
    #[error("{0}")]
    Custom(BoxError),
}

fn because(why: Option<&String>) -> String {
    why.map(|why| format!("; {why}")).unwrap_or_default()
}

/// Length of the gap between two intervals.
fn apart_s(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (a[0] - b[1]).max(b[0] - a[1]).max(0.0)
}
