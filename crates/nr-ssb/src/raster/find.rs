//! What a scan finds.

use super::point::RasterPoint;
use crate::dsp::base_rate::SYMBOL_SAMPLES;
use crate::search::DetectedSsb;
use crate::standard::grid::SUBCARRIERS;
use crate::standard::numerology::SubcarrierSpacing;

/// What was found at one raster point.
#[derive(Debug, Clone, PartialEq)]
pub struct RasterFind {
    /// Where.
    pub point: RasterPoint,
    /// Subcarrier spacing of its SSBs.
    pub spacing: SubcarrierSpacing,
    /// Samples of the recording per sample at the base rate, the unit of
    /// [`DetectedSsb::sample_start`].
    pub input_per_output: f64,
    /// The SSBs, in order of time.
    pub ssbs: Vec<DetectedSsb>,
}

impl RasterFind {
    /// Whether the other is but this one's shadow: PSS and SSS are made of m-sequences, and one that
    /// is shifted in frequency looks like another cell's. Its SSBs come at the same times, weaker.
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

    /// The SSB of highest SNR.
    pub(super) fn strongest(&self) -> Option<&DetectedSsb> {
        self.ssbs
            .iter()
            .max_by(|a, b| a.snr_db.total_cmp(&b.snr_db))
    }
}
