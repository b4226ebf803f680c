//! Errors of a search.

use crate::dsp::received_grid::MAX_ANTENNAS;

/// Reason why a search is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SearchError {
    /// No antenna, or more than [`MAX_ANTENNAS`].
    #[error("{0} antennas: 1 to {MAX_ANTENNAS} are possible")]
    Antennas(usize),
    /// Setting outside its range.
    #[error("{name} = {value}: {allowed}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Value of the setting.
        value: f64,
        /// Allowed values.
        allowed: &'static str,
    },
    /// The number of channels differs from the configuration.
    #[error("{given} channels given, {expected} expected")]
    AntennaCount {
        /// Number of channels passed.
        given: usize,
        /// Configured number of channels.
        expected: usize,
    },
    /// Channels of different lengths.
    #[error("channels hold different numbers of samples: {first} and {other}")]
    UnequalLengths {
        /// Length of channel 0.
        first: usize,
        /// Length that differs.
        other: usize,
    },
    /// Fewer samples than one SSB.
    #[error("{samples} samples are less than the {needed} of one SSB")]
    TooShort {
        /// Length of the recording at the base rate.
        samples: usize,
        /// Length of one SSB.
        needed: usize,
    },
}
