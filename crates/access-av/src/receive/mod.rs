//! From IQ samples to SSBs and the angles they arrive at.
//!
//! [`scan`] looks through a recording for whatever cells are in it; a [`Receiver`] keeps to the cells
//! of a site while the vehicle drives, and makes an observation of each of their SSBs.

mod array_view;
mod despread;
mod diagnosis;
mod iq_source;
mod receiver;
mod scan;
mod ssb_search;
mod stream;
mod wideband;

pub use array_view::ArraySetup;
pub use diagnosis::ChannelFault;
pub use iq_source::{IqSource, SampleBlock};
pub use receiver::{ReceiveError, Receiver, ReceiverConfig, Window};
pub use scan::{Scan, ScanError, ScanSettings, scan};
pub use ssb_search::{FoundSsb, SsbSearch, SsbSearchConfig};

/// Samples of an SSB at the base rate: four symbols of 256 with a cyclic prefix of 18.
pub(crate) const SSB_SAMPLES: usize = 4 * 274;
