//! Errors of the localization of a recorded drive.

use onboard::BoxError;
use onboard::receive::ReceiveError;
use onboard::settings::SettingsError;
use onboard::time_unit::TimeUnit;
use thiserror::Error;

use crate::error::RecordingError;

/// Error of the localization of a recorded drive.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// Site, vehicle or platform are invalid.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The receiver rejects the samples.
    #[error("{file}: {source}")]
    Receive {
        /// Path of the recording.
        file: String,
        /// Cause.
        source: ReceiveError,
    },
    /// The sample rate or band of the recording is incompatible with the site.
    #[error("{file}: {source}")]
    FrontEnd {
        /// Path of the recording.
        file: String,
        /// Cause.
        source: nr_ssb::front_end::FrontEndError,
    },
    /// The start time is not finite.
    #[error("the recording's start time is {start_time_s} s; it must be finite")]
    StartTime {
        /// Given start time (s).
        start_time_s: f64,
    },
    /// Times are not in seconds.
    #[error(
        "{of}: `{field}` is in {unit}, by steps of {step} between {samples}; it must be in seconds: divide it by \
         {:e}", unit.per_second()
    )]
    TimeUnit {
        /// Kind of the data: "odometry" or "angles".
        of: &'static str,
        /// Field of the time.
        field: &'static str,
        /// Probable unit.
        unit: TimeUnit,
        /// Name of the items: "samples" or "angles".
        samples: &'static str,
        /// Median step of the times in this unit.
        step: f64,
    },
    /// Angles and odometry have no common time.
    #[error(
        "no angle falls into the odometry's time: odometry is from {} to {} s, angles from {} to {} s, \
         {:.3} s apart; both must use one clock",
        odometry_s[0], odometry_s[1], angles_s[0], angles_s[1], apart_s(odometry_s, angles_s)
    )]
    Clocks {
        /// Times of the first and the last odometry sample (s).
        odometry_s: [f64; 2],
        /// Times of the first and the last angle (s).
        angles_s: [f64; 2],
    },
    /// The log contains no usable range.
    #[error("the log contains no usable range{}", because(why.as_ref()))]
    NoRange {
        /// Defect of the first unusable line.
        why: Option<String>,
    },
    /// Ranges and odometry have no common time.
    #[error(
        "no range falls into the odometry's time: odometry is from {} to {} s, ranges from {} to {} s; \
         both must use one clock, in seconds",
        odometry_s[0], odometry_s[1], ranges_s[0], ranges_s[1]
    )]
    RangeClocks {
        /// Times of the first and the last odometry sample (s).
        odometry_s: [f64; 2],
        /// Times of the first and the last range (s).
        ranges_s: [f64; 2],
    },
    /// No angle is from a radio head of the site.
    #[error(
        "none of {angles} angles is from a radio head of the site; check pci and ssb_index in both"
    )]
    UnknownRadioHeads {
        /// Number of angles.
        angles: usize,
    },
    /// The odometry has fewer than two usable samples.
    #[error("the odometry contains fewer than two usable samples{}", because(why.as_ref()))]
    NoOdometry {
        /// Error of the first unusable sample.
        why: Option<String>,
    },
    /// The recording contains no SSB of the site.
    #[error(
        "{file}: the recording contains no SSB of a radio head of the site; check the carrier, the band, and \
         pci and ssb_index; `access-av record scan` lists the cells"
    )]
    NoSsb {
        /// Path of the recording.
        file: String,
    },
    /// The log has no usable angle.
    #[error("the angle log contains no usable angle{}", because(why.as_ref()))]
    NoAngle {
        /// Error of the first unusable angle.
        why: Option<String>,
    },
    /// The user's own code failed.
    #[error("{0}")]
    Custom(BoxError),
}

fn because(why: Option<&String>) -> String {
    why.map(|why| format!("; {why}")).unwrap_or_default()
}

/// Returns the length of the gap between two intervals.
fn apart_s(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (a[0] - b[1]).max(b[0] - a[1]).max(0.0)
}
