//! Search for cells in a recording without prior knowledge, with angles for arrays of several
//! antennas.

mod diagnosis;
mod error;
mod iq_source;
mod scanner;
mod search_scope;
mod segments;
mod ssb_search;

pub use diagnosis::ChannelFault;
pub use error::ScanError;
pub use iq_source::{IqSource, SampleBlock};
pub use onboard::receive::array_view::{ArraySetup, ArrayView, FoundAngle, View, array_view};
pub use scanner::{Scan, ScanSettings, scan};
pub use search_scope::{Places, SearchScope};
pub use segments::scan_recording;
pub use ssb_search::{ScannedSsb, SsbSearch, SsbSearchConfig};
