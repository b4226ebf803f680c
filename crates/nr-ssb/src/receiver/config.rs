//! What a receiver is told.

use super::error::ReceiverError;
use crate::search::{SearchConfig, SearchError};
use crate::standard::numerology::SubcarrierSpacing;

/// What a receiver is told.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverConfig {
    /// Samples per second and antenna.
    pub sample_rate_hz: f64,
    /// Frequency that stands at 0 Hz in the samples, Hz.
    pub centre_frequency_hz: f64,
    /// Spacing, antennas, the absolute frequency of the SSB's centre, offsets searched.
    pub search: SearchConfig,
    /// From one burst set to the next: 5, 10, 20, 40, 80 or 160 ms, or the shortest of several cells.
    pub period_s: f64,
    /// How often all samples of a period are searched for cells and beams that are not yet tracked.
    pub search_every_s: f64,
    /// How long a beam may be missed before it is given up.
    pub lost_after_s: f64,
}

impl ReceiverConfig {
    /// For SSBs around `ssb_freq_hz` every 20 ms; a search every second, beams given up after one.
    pub fn new(
        sample_rate_hz: f64,
        centre_frequency_hz: f64,
        ssb_freq_hz: f64,
        spacing: SubcarrierSpacing,
        antennas: usize,
    ) -> Self {
        Self {
            sample_rate_hz,
            centre_frequency_hz,
            search: SearchConfig {
                ssb_freq_hz: Some(ssb_freq_hz),
                ..SearchConfig::new(spacing, antennas)
            },
            period_s: 0.02,
            search_every_s: 1.0,
            lost_after_s: 1.0,
        }
    }

    /// Whether receiving with these settings is possible.
    pub(super) fn check(&self) -> Result<(), ReceiverError> {
        let in_seconds = [
            ("period_s", self.period_s, 0.005, "from 0.005 to 0.16", 0.16),
            (
                "search_every_s",
                self.search_every_s,
                0.0,
                "not negative",
                f64::INFINITY,
            ),
            (
                "lost_after_s",
                self.lost_after_s,
                0.0,
                "not negative",
                f64::INFINITY,
            ),
        ];
        for (name, value, least, allowed, most) in in_seconds {
            if !(least..=most).contains(&value) {
                return Err(SearchError::Setting {
                    name,
                    value,
                    allowed,
                }
                .into());
            }
        }
        Ok(())
    }
}
