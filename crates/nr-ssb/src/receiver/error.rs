//! Errors of a receiver.

use crate::input::front_end::FrontEndError;
use crate::search::SearchError;
use crate::track::TrackError;

/// Reason why reception is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReceiverError {
    /// The rate, the position of the SSB in the band, or the samples are invalid.
    #[error(transparent)]
    FrontEnd(#[from] FrontEndError),
    /// Invalid setting of the search.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// Invalid setting of the tracker.
    #[error(transparent)]
    Track(#[from] TrackError),
}
