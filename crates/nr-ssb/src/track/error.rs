//! What makes tracking impossible.

use crate::search::SearchError;

/// What makes tracking impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The window does not hold the SSB.
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
    /// As in a search.
    #[error(transparent)]
    Search(#[from] SearchError),
}
