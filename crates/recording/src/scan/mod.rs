//! Whatever cells are in a recording that nobody has described, with angles where there are several
//! antennas.

mod array_view;
mod diagnosis;
mod error;
mod iq_source;
mod looked;
mod scanner;
mod ssb_search;

pub use array_view::{ArraySetup, FoundAngle};
pub use diagnosis::ChannelFault;
pub use error::ScanError;
pub use iq_source::{IqSource, SampleBlock};
pub use looked::{Looked, Places};
pub use scanner::{Scan, ScanSettings, scan};
pub use ssb_search::{FoundSsb, SsbSearch, SsbSearchConfig};
