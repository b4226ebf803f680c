//! What makes a search impossible.

use crate::dsp::received_grid::MAX_ANTENNAS;

/// What makes a search impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SearchError {
    /// No antenna, or more than [`MAX_ANTENNAS`].
    #[error("{0} antennas: 1 to {MAX_ANTENNAS} are possible")]
    Antennas(usize),
    /// A setting outside its range.
    #[error("{name} = {value}: {allowed}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// The number of channels passed differs from that announced.
    #[error("{given} channels given, {expected} expected")]
    AntennaCount {
        /// Channels passed.
        given: usize,
        /// Channels announced.
        expected: usize,
    },
    /// Channels of different lengths.
    #[error("channels hold different numbers of samples: {first} and {other}")]
    UnequalLengths {
        /// Length of channel 0.
        first: usize,
        /// A length that differs.
        other: usize,
    },
    /// Less than one SSB.
    #[error("{samples} samples are less than the {needed} of one SSB")]
    TooShort {
        /// Length of the recording at the base rate.
        samples: usize,
        /// Length of one SSB.
        needed: usize,
    },
}
