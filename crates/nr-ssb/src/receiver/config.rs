//! Receiver configuration.

use crate::search::{SearchConfig, SearchError};
use crate::standard::numerology::SubcarrierSpacing;

/// Maximum frequency offset in subcarriers. At larger offsets, the filter attenuates PSS and SSS.
const MAX_SUBCARRIERS: f64 = 15.0;

/// Receiver configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverConfig {
    /// Spacing, antennas, absolute frequency of the SSB's centre, and range of a search around one
    /// frequency offset.
    pub search: SearchConfig,
    /// Period of the burst sets: 5, 10, 20, 40, 80 or 160 ms; the shortest one of several cells.
    pub period_s: f64,
    /// Maximum error of the receiver's and cells' oscillators together, in ppm. Without a known
    /// offset, this range is searched.
    pub oscillator_ppm: f64,
    /// Interval at which all samples of a period are searched for new cells and beams.
    pub search_every_s: f64,
    /// Minimum duration without reception before a beam is removed, in seconds; at least eight SSBs
    /// must be missed.
    pub lost_after_s: f64,
    /// Cells that are received; `None` for all.
    pub cells: Option<Vec<u16>>,
    /// Cell and index of every transmitted beam, if known. While all of them are received, no
    /// search takes place. Empty if unknown.
    pub beams: Vec<(u16, u8)>,
    /// Whether the PBCH of tracked SSBs is decoded, for its message and as additional pilots.
    pub decode_pbch: bool,
}

impl ReceiverConfig {
    /// Returns the configuration for SSBs around `ssb_freq_hz` every 20 ms, with oscillators of 20
    /// ppm, PBCH decoding, a search every second, and removal of beams after two seconds.
    pub fn new(ssb_freq_hz: f64, spacing: SubcarrierSpacing, antennas: usize) -> Self {
        Self {
            search: SearchConfig {
                ssb_freq_hz: Some(ssb_freq_hz),
                ..SearchConfig::new(spacing, antennas)
            },
            period_s: 0.02,
            oscillator_ppm: Self::widest_ppm(ssb_freq_hz, spacing).min(20.0),
            search_every_s: 1.0,
            lost_after_s: 2.0,
            cells: None,
            beams: Vec::new(),
            decode_pbch: true,
        }
    }

    /// Returns the maximum `oscillator_ppm` at a frequency: 15 subcarriers.
    pub fn widest_ppm(ssb_freq_hz: f64, spacing: SubcarrierSpacing) -> f64 {
        1e6 * MAX_SUBCARRIERS * spacing.hz() / ssb_freq_hz.abs().max(1.0)
    }

    /// Returns the number of frequency offsets of the search, one subcarrier apart.
    pub(super) fn offsets(&self) -> u32 {
        let ssb_freq_hz = self.search.ssb_freq_hz.unwrap_or(0.0);
        let largest_hz = 1e-6 * self.oscillator_ppm * ssb_freq_hz;
        let beyond_hz = largest_hz - self.search.cfo_range_hz;
        let steps = (beyond_hz / self.search.spacing.hz()).ceil();
        2 * steps.clamp(0.0, MAX_SUBCARRIERS) as u32 + 1
    }

    /// Returns the period in samples at the base rate.
    pub(super) fn period(&self) -> f64 {
        self.period_s * self.search.spacing.base_rate_hz()
    }

    /// Returns an error if the configuration is invalid.
    pub(super) fn check(&self) -> Result<(), SearchError> {
        let ssb_freq_hz = self.search.ssb_freq_hz.unwrap_or(0.0);
        let widest_ppm = Self::widest_ppm(ssb_freq_hz, self.search.spacing);
        let not_negative = "not negative";
        for (name, value, least, allowed, most) in [
            ("period_s", self.period_s, 0.005, "from 0.005 to 0.16", 0.16),
            (
                "oscillator_ppm",
                self.oscillator_ppm,
                0.0,
                "it must be from 0 to 15 subcarrier spacings, in ppm of the SSB frequency; larger \
                 offsets are not searched",
                widest_ppm * (1.0 + 1e-9),
            ),
            (
                "search_every_s",
                self.search_every_s,
                0.0,
                not_negative,
                f64::INFINITY,
            ),
            (
                "lost_after_s",
                self.lost_after_s,
                0.0,
                not_negative,
                f64::INFINITY,
            ),
        ] {
            if !(least..=most).contains(&value) {
                return Err(SearchError::Setting {
                    name,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }
}
