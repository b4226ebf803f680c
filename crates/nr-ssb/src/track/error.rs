//! Errors of tracking.

use crate::search::SearchError;

/// Reason why tracking is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The window does not contain the SSB.
    #[error(
        "the SSB expected at sample {expected} is outside the window of {samples} samples that \
         begins at sample {window_start}"
    )]
    Window {
        /// First sample of the SSB.
        expected: f64,
        /// First sample of the window.
        window_start: f64,
        /// Samples in the window.
        samples: usize,
    },
    /// The search configuration is invalid.
    #[error(transparent)]
    Search(#[from] SearchError),
}
