//! What a receiver is told.

use crate::search::{SearchConfig, SearchError};
use crate::standard::numerology::SubcarrierSpacing;

/// Largest frequency offset looked at, in subcarriers: beyond it the filter cuts into PSS and SSS.
const MOST_SUBCARRIERS: f64 = 15.0;

/// What a receiver is told.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverConfig {
    /// Spacing, antennas, the absolute frequency of the SSB's centre, and how far about one frequency
    /// offset a search reaches.
    pub search: SearchConfig,
    /// From one burst set to the next: 5, 10, 20, 40, 80 or 160 ms, or the shortest of several cells.
    pub period_s: f64,
    /// Largest error of receiver's and cells' oscillators together, in parts per million. Every offset
    /// within it is searched where none is known yet.
    pub oscillator_ppm: f64,
    /// How often all samples of a period are searched for cells and beams that are not yet tracked.
    pub search_every_s: f64,
    /// How long a beam must be missed, eight SSBs at least, before it is given up.
    pub lost_after_s: f64,
    /// Cells to listen to; all without.
    pub cells: Option<Vec<u16>>,
    /// Cell and index of each beam that there is, where that is known: while all of them come, none is searched
    /// for. Empty otherwise.
    pub beams: Vec<(u16, u8)>,
    /// Whether the PBCH of tracked SSBs is decoded: for what it says, and for its elements as pilots.
    pub decode_pbch: bool,
}

impl ReceiverConfig {
    /// For SSBs around `ssb_freq_hz` every 20 ms by oscillators of 20 ppm, with their PBCH; a search every
    /// second, beams given up after two.
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

    /// The largest `oscillator_ppm` that can be searched at a frequency: 15 subcarriers.
    pub fn widest_ppm(ssb_freq_hz: f64, spacing: SubcarrierSpacing) -> f64 {
        1e6 * MOST_SUBCARRIERS * spacing.hz() / ssb_freq_hz.abs().max(1.0)
    }

    /// Frequency offsets, a subcarrier apart, that the oscillators may have.
    pub(super) fn offsets(&self) -> u32 {
        let ssb_freq_hz = self.search.ssb_freq_hz.unwrap_or(0.0);
        let largest_hz = 1e-6 * self.oscillator_ppm * ssb_freq_hz;
        let beyond_hz = largest_hz - self.search.cfo_range_hz;
        let steps = (beyond_hz / self.search.spacing.hz()).ceil();
        2 * steps.clamp(0.0, MOST_SUBCARRIERS) as u32 + 1
    }

    /// Samples of a period at the base rate.
    pub(super) fn period(&self) -> f64 {
        self.period_s * self.search.spacing.base_rate_hz()
    }

    /// Whether receiving with these settings is possible.
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
                "from 0 to what 15 subcarriers are of the SSB's frequency; no offset beyond is searched",
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
