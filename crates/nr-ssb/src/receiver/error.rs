//! What makes receiving impossible.

use crate::input::front_end::FrontEndError;
use crate::search::SearchError;
use crate::track::TrackError;

/// What makes receiving impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReceiverError {
    /// The rate, the place of the SSB in the band, or the samples do not suit.
    #[error(transparent)]
    FrontEnd(#[from] FrontEndError),
    /// A setting of the search.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// A setting of the tracker.
    #[error(transparent)]
    Track(#[from] TrackError),
}
