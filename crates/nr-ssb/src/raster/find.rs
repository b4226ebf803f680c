//! What a scan finds.

use super::point::RasterPoint;
use crate::search::DetectedSsb;
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
    /// The SSB of highest SNR.
    pub(super) fn strongest(&self) -> Option<&DetectedSsb> {
        self.ssbs
            .iter()
            .max_by(|a, b| a.snr_db.total_cmp(&b.snr_db))
    }
}
