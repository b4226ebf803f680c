//! What makes a scan impossible.

use nr_ssb::front_end::FrontEndError;
use nr_ssb::search::SearchError;
use thiserror::Error;

use crate::error::RecordingError;

/// What makes a scan impossible.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ScanError {
    /// The samples cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording's rate or band does not suit.
    #[error("{file}: {source}")]
    FrontEnd {
        /// The recording.
        file: String,
        /// What does not suit.
        source: FrontEndError,
    },
    /// The search refused its input.
    #[error("{file}: {source}{}", rate_of_count(source))]
    Search {
        /// The recording.
        file: String,
        /// What does not suit.
        source: SearchError,
    },
    /// No centre frequency, in the recording or in the settings.
    #[error("{file}: no centre frequency; the recording must state it, or it must be given")]
    NoCentreFrequency {
        /// The recording.
        file: String,
    },
    /// An impossible array.
    #[error("array: {0}")]
    Array(#[from] aoa::Error),
}

/// The rate at which samples are counted, which need not be that of the file.
fn rate_of_count(error: &SearchError) -> &'static str {
    if matches!(error, SearchError::TooShort { .. }) {
        ", counted at the base rate of the search and not at that of the recording"
    } else {
        ""
    }
}
