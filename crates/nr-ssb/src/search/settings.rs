//! Search configuration.

use super::error::SearchError;
use crate::dsp::received_grid::MAX_ANTENNAS;
use crate::standard::numerology::{Lmax, SubcarrierSpacing};

/// Search configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchConfig {
    /// Subcarrier spacing of the SSB.
    pub spacing: SubcarrierSpacing,
    /// Number of antennas, 1 to [`MAX_ANTENNAS`].
    pub antennas: usize,
    /// Absolute frequency of the SSB's centre, in Hz. Without it, the frequency offset is estimated
    /// within symbols only (because of TS 38.211 §5.4), with a tenfold error. Zero for signals
    /// without the phase of that clause.
    pub ssb_freq_hz: Option<f64>,
    /// Burst set size, if known. Otherwise the size of the bands at the frequency is tried first.
    pub lmax: Option<Lmax>,
    /// Central carrier frequency offset of the search, in Hz: that of a receiver whose oscillator
    /// offset is known from a detected cell.
    pub cfo_centre_hz: f64,
    /// Maximum carrier frequency offset on either side of the centre, in Hz.
    pub cfo_range_hz: f64,
    /// Probability of a false cell in 20 ms of noise.
    pub false_alarm: f64,
}

impl SearchConfig {
    /// Offsets up to half a subcarrier, and a false-alarm probability of 1e-3.
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

    /// Returns an error if a search with these settings is impossible.
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
            let allowed = "at most 32 subcarriers to either side";
            return Err(setting("cfo_centre_hz", self.cfo_centre_hz, allowed));
        }
        if !(self.false_alarm > 0.0 && self.false_alarm < 1.0) {
            return Err(setting("false_alarm", self.false_alarm, "between 0 and 1"));
        }
        check_frequency(self.ssb_freq_hz)
    }
}

/// Returns an error if an SSB cannot have this frequency.
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
