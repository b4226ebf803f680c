//! Errors of a scan.

use crate::input::front_end::FrontEndError;
use crate::search::SearchError;

/// Reason why a scan is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScanError {
    /// The rate or the channels of the recording are invalid.
    #[error(transparent)]
    FrontEnd(#[from] FrontEndError),
    /// The search rejected its input.
    #[error(transparent)]
    Search(#[from] SearchError),
}
