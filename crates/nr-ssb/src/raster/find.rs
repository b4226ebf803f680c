//! Results of a scan.

use super::point::RasterPoint;
use crate::dsp::base_rate::SYMBOL_SAMPLES;
use crate::search::DetectedSsb;
use crate::standard::grid::SUBCARRIERS;
use crate::standard::numerology::SubcarrierSpacing;

/// Cell search result at one raster point.
#[derive(Debug, Clone, PartialEq)]
pub struct RasterFind {
    /// Raster point.
    pub point: RasterPoint,
    /// Subcarrier spacing of the SSBs.
    pub spacing: SubcarrierSpacing,
    /// Samples of the recording per sample at the base rate, the unit of
    /// [`DetectedSsb::sample_start`].
    pub input_per_output: f64,
    /// Detected SSBs, in order of time.
    pub ssbs: Vec<DetectedSsb>,
}

impl RasterFind {
    /// Whether another result is a ghost of this one: PSS and SSS are m-sequences, and a
    /// frequency-shifted m-sequence resembles that of another cell. The SSBs of a ghost are
    /// simultaneous and weaker.
    pub(super) fn casts(&self, other: &Self) -> bool {
        let away_hz = (self.point.ssb_freq_hz - other.point.ssb_freq_hz).abs();
        let same_time = |a: &DetectedSsb, b: &DetectedSsb| {
            let away =
                a.sample_start * self.input_per_output - b.sample_start * other.input_per_output;
            away.abs() < SYMBOL_SAMPLES as f64 * self.input_per_output
        };
        self.spacing == other.spacing
            && away_hz < SUBCARRIERS as f64 * self.spacing.hz()
            && other.ssbs.iter().all(|shadow| {
                let mut ssbs = self.ssbs.iter();
                ssbs.any(|ssb| same_time(ssb, shadow) && ssb.snr_db > shadow.snr_db)
            })
    }

    /// Returns the SSB with the highest SNR.
    pub(super) fn strongest(&self) -> Option<&DetectedSsb> {
        self.ssbs
            .iter()
            .max_by(|a, b| a.snr_db.total_cmp(&b.snr_db))
    }
}
