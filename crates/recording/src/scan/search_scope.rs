//! Where a scan has looked, which is what there is to say where it found nothing.

use std::fmt;

use nr_ssb::SubcarrierSpacing;

/// One kind of search through a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchScope {
    /// Subcarrier spacing looked for.
    pub spacing: SubcarrierSpacing,
    /// At which frequencies of the SSB's centre.
    pub places: Places,
    /// In how much of the recording, from its beginning, in seconds.
    pub duration_s: f64,
    /// On how many channels.
    pub channels: usize,
}

/// Frequencies of the SSB's centre.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// One that was told.
    Given {
        /// The frequency, Hz.
        ssb_freq_hz: f64,
        /// Largest carrier frequency offset to either side, Hz.
        cfo_hz: f64,
    },
    /// So many points of the synchronization raster.
    Raster(usize),
    /// Any frequency.
    Anywhere {
        /// The lowest, Hz.
        low_hz: f64,
        /// The highest, Hz.
        high_hz: f64,
    },
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
