//! Cell search: every SSB of every cell on one raster point, from any number of antennas.
//!
//! The matched filter proposes, strongest first; SSS, DM-RS and the PBCH's checksum dispose. A
//! found SSB is taken out of the samples, and what it hid is looked for again.

mod detected;
mod error;
mod examine;
mod searcher;
mod settings;

pub use crate::dsp::received_grid::MAX_ANTENNAS;
pub use detected::{DetectedSsb, ReceivedSsb, SearchCounts};
pub use error::SearchError;
pub use searcher::Searcher;
pub use settings::SearchConfig;
