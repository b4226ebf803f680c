//! What makes a scan impossible.

use crate::input::front_end::FrontEndError;
use crate::search::SearchError;

/// What makes a scan impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScanError {
    /// The recording's rate or channels do not suit.
    #[error(transparent)]
    FrontEnd(#[from] FrontEndError),
    /// The search refused its input.
    #[error(transparent)]
    Search(#[from] SearchError),
}
