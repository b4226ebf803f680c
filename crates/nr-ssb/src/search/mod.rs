//! Cell search: every SSB of every cell on one raster point, from any number of antennas.
//!
//! The matched filter proposes candidates in descending order of strength. SSS, DM-RS and the CRC
//! of the PBCH verify them. A detected SSB is subtracted from the samples, and weaker ones are
//! searched for again.

mod detected;
mod error;
mod examine;
mod searcher;
mod settings;

pub use crate::dsp::received_grid::MAX_ANTENNAS;
pub use detected::{DetectedSsb, ReceivedElements, SearchCounts};
pub use error::SearchError;
pub use searcher::Searcher;
pub use settings::SearchConfig;
