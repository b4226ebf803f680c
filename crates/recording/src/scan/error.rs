//! Errors of a scan.

use nr_ssb::front_end::FrontEndError;
use nr_ssb::search::SearchError;
use thiserror::Error;

use crate::error::RecordingError;

/// Error of a scan.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ScanError {
    /// The samples cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The sample rate or band of the recording is unsupported.
    #[error("{file}: {source}")]
    FrontEnd {
        /// Path of the recording.
        file: String,
        /// Cause.
        source: FrontEndError,
    },
    /// The search rejects its input.
    #[error("{file}: {source}{}", rate_of_count(source))]
    Search {
        /// Path of the recording.
        file: String,
        /// Cause.
        source: SearchError,
    },
    /// Neither the recording nor the settings contain a centre frequency.
    #[error(
        "{file}: no centre frequency; write `captures[0].core:frequency` (Hz) into the metadata, or pass it with --centre-hz"
    )]
    NoCentreFrequency {
        /// Path of the recording.
        file: String,
    },
    /// The array is invalid.
    #[error("array: {0}")]
    Array(#[from] aoa::Error),
}

/// Returns an explanation of the sample rate in which samples are counted.
fn rate_of_count(error: &SearchError) -> &'static str {
    if matches!(error, SearchError::TooShort { .. }) {
        " (counted at the base rate of the search, which may differ from the rate of the recording)"
    } else {
        ""
    }
}
