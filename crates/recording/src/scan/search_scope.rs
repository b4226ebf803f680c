//! Scope of a scan, which is the result if no SSB is found.

use std::fmt;

use nr_ssb::SubcarrierSpacing;

/// Scope of one kind of search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchScope {
    /// Subcarrier spacing.
    pub spacing: SubcarrierSpacing,
    /// Centre frequencies of the SSB.
    pub places: Places,
    /// Searched duration from the start of the recording in seconds.
    pub duration_s: f64,
    /// Number of searched channels.
    pub channels: usize,
}

/// Centre frequencies of the SSB.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// Given frequency.
    Given {
        /// Frequency in Hz.
        ssb_freq_hz: f64,
        /// Maximum carrier frequency offset in either direction in Hz.
        cfo_hz: f64,
    },
    /// Number of points of the synchronization raster.
    Raster(usize),
    /// Any frequency.
    Anywhere {
        /// Lowest frequency in Hz.
        low_hz: f64,
        /// Highest frequency in Hz.
        high_hz: f64,
    },
}

impl SearchScope {
    /// Whether another search was made at the same frequencies, for the same spacing, on as many channels.
    pub(super) fn is_where(&self, other: &Self) -> bool {
        let has_frequencies = !matches!(self.places, Places::Raster(_));
        has_frequencies
            && (self.spacing, self.channels) == (other.spacing, other.channels)
            && self.places == other.places
    }
}

impl fmt::Display for SearchScope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} kHz spacing, ", self.spacing.khz())?;
        match self.places {
            Places::Given {
                ssb_freq_hz,
                cfo_hz,
            } => write!(
                f,
                "SSB at {:.3} MHz ± {:.1} kHz",
                1e-6 * ssb_freq_hz,
                1e-3 * cfo_hz
            )?,
            Places::Raster(points) => write!(
                f,
                "{points} {} of the synchronization raster",
                if points == 1 { "point" } else { "points" }
            )?,
            Places::Anywhere { low_hz, high_hz } => write!(
                f,
                "any frequency from {:.3} to {:.3} MHz",
                1e-6 * low_hz,
                1e-6 * high_hz
            )?,
        }
        let plural = if self.channels == 1 { "" } else { "s" };
        write!(
            f,
            ", the first {:.0} ms of {} channel{plural}",
            1e3 * self.duration_s,
            self.channels
        )
    }
}
