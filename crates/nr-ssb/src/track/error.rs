//! Errors of tracking.

use crate::search::SearchError;

/// Reason why tracking is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The window does not contain the SSB.
    #[error(
        "an SSB expected from sample {expected} on does not lie in a window of {samples} from {window_start} on"
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
