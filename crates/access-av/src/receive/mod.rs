//! From IQ samples to SSBs and the angles they arrive at.
//!
//! [`scan`] looks through a recording for whatever cells are in it.

mod array_view;
mod diagnosis;
mod iq_source;
mod scan;

pub use array_view::ArraySetup;
pub use diagnosis::{ChannelFault, diagnose_channels};
pub use iq_source::{IqSource, SampleBlock};
pub use scan::{FoundSsb, Scan, ScanError, ScanSettings, scan};
