//! What a search is told.

use super::error::SearchError;
use crate::dsp::received_grid::MAX_ANTENNAS;
use crate::standard::numerology::{Lmax, SubcarrierSpacing};

/// What a search is told.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchConfig {
    /// Subcarrier spacing of the SSB.
    pub spacing: SubcarrierSpacing,
    /// Number of antennas, 1 to [`MAX_ANTENNAS`].
    pub antennas: usize,
    /// Absolute frequency of the SSB's centre, Hz. Without it the frequency offset comes from
    /// inside the symbols only (TS 38.211 §5.4 hides the rest) and is an order less precise. Zero
    /// for signals made without that phase.
    pub ssb_freq_hz: Option<f64>,
    /// SSBs per burst set, when known. Else the one that the bands at the frequency have is tried
    /// first.
    pub lmax: Option<Lmax>,
    /// Carrier frequency offset around which is searched, Hz: that of a receiver whose oscillator
    /// is known from a cell it has found.
    pub cfo_centre_hz: f64,
    /// Largest carrier frequency offset to either side of the centre, Hz.
    pub cfo_range_hz: f64,
    /// Probability that 20 ms of noise make a cell.
    pub false_alarm: f64,
}

impl SearchConfig {
    /// Offsets up to half a subcarrier, false alarm 1e-3.
    pub fn new(spacing: SubcarrierSpacing, antennas: usize) -> Self {
        Self {
            spacing,
            antennas,
            ssb_freq_hz: None,
            lmax: None,
            cfo_centre_hz: 0.0,
            cfo_range_hz: 0.5 * spacing.hz(),
            false_alarm: 1e-3,
        }
    }

    /// Whether a search with these settings is possible.
    pub(crate) fn check(&self) -> Result<(), SearchError> {
        if self.antennas == 0 || self.antennas > MAX_ANTENNAS {
            return Err(SearchError::Antennas(self.antennas));
        }
        let setting = |name, value, allowed| SearchError::Setting {
            name,
            value,
            allowed,
        };
        if !(0.0..=5.0 * self.spacing.hz()).contains(&self.cfo_range_hz) {
            let allowed = "from 0 to 5 subcarriers";
            return Err(setting("cfo_range_hz", self.cfo_range_hz, allowed));
        }
        if self.cfo_centre_hz.is_nan() || self.cfo_centre_hz.abs() > 32.0 * self.spacing.hz() {
            let allowed = "32 subcarriers to either side at most";
            return Err(setting("cfo_centre_hz", self.cfo_centre_hz, allowed));
        }
        if !(self.false_alarm > 0.0 && self.false_alarm < 1.0) {
            return Err(setting("false_alarm", self.false_alarm, "between 0 and 1"));
        }
        check_frequency(self.ssb_freq_hz)
    }
}

/// Whether an SSB can be at this frequency.
pub(super) fn check_frequency(ssb_freq_hz: Option<f64>) -> Result<(), SearchError> {
    match ssb_freq_hz {
        Some(value) if !value.is_finite() => Err(SearchError::Setting {
            name: "ssb_freq_hz",
            value,
            allowed: "a finite frequency",
        }),
        _ => Ok(()),
    }
}
