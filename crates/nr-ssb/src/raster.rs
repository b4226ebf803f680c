//! Finding the SSB's frequency and subcarrier spacing: the synchronization raster of TS 38.104
//! §5.4.3, point by point through the recorded band, at 15 and 30 kHz.

use num_complex::Complex32;

use crate::front_end::{FrontEnd, FrontEndError};
use crate::numerology::SubcarrierSpacing;
use crate::search::{DetectedSsb, SearchConfig, SearchError, Searcher};

/// A frequency where a cell may place an SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RasterPoint {
    /// Global synchronization channel number; `None` off the raster.
    pub gscn: Option<u16>,
    /// Frequency of the SSB's centre (subcarrier 120), Hz.
    pub ssb_freq_hz: f64,
}

/// The points of the synchronization raster from `low_hz` to `high_hz` (TS 38.104 Table 5.4.3.1-1):
/// `N · 1.2 MHz + M · 50 kHz`, M = 1, 3, 5, below 3 GHz, `3 GHz + N · 1.44 MHz` up to 24.25 GHz.
pub fn synchronization_raster(low_hz: f64, high_hz: f64) -> impl Iterator<Item = RasterPoint> {
    let below = (1..2500_u16).flat_map(|n| {
        [1, 3, 5].map(move |m| RasterPoint {
            gscn: Some(3 * n + (m - 1) / 2 - 1),
            ssb_freq_hz: f64::from(n) * 1.2e6 + f64::from(m) * 50e3,
        })
    });
    let above = (0..14757_u16).map(|n| RasterPoint {
        gscn: Some(7499 + n),
        ssb_freq_hz: 3e9 + f64::from(n) * 1.44e6,
    });
    below
        .chain(above)
        .filter(move |point| (low_hz..=high_hz).contains(&point.ssb_freq_hz))
}

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

/// What makes a scan impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ScanError {
    /// The recording's rate or channels do not suit.
    #[error(transparent)]
    FrontEnd(#[from] FrontEndError),
    /// The search refused its input.
    #[error(transparent)]
    Search(#[from] SearchError),
}

/// All SSBs of a recording, `antennas` channels at `rate_hz` around `centre_hz`, on whatever raster
/// point and at whatever subcarrier spacing; the point with the strongest SSB first.
///
/// The probability of a false cell, 1e-3 for 20 ms, is shared among the points.
///
/// # Errors
/// [`ScanError::FrontEnd`] for a rate that is no multiple of 3.84 MHz, [`ScanError::Search`] for
/// channels of unequal lengths or less than one SSB.
pub fn scan(
    antennas: &[&[Complex32]],
    rate_hz: f64,
    centre_hz: f64,
) -> Result<Vec<RasterFind>, ScanError> {
    let mut finds = Vec::new();
    let half_band = 0.5 * rate_hz;
    for spacing in [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30] {
        let reach = half_band - 120.0 * spacing.hz();
        let points: Vec<_> = synchronization_raster(centre_hz - reach, centre_hz + reach).collect();
        if points.is_empty() {
            continue;
        }
        let mut front_end = FrontEnd::new(rate_hz, 0.0, spacing.hz(), antennas.len())?;
        let mut searcher = Searcher::new(SearchConfig {
            false_alarm: 1e-3 / points.len() as f64,
            ..SearchConfig::new(spacing, antennas.len())
        })?;
        let mut base = vec![Vec::new(); antennas.len()];
        for point in points {
            front_end.tune(point.ssb_freq_hz - centre_hz)?;
            base.iter_mut().for_each(Vec::clear);
            front_end.push(antennas, &mut base)?;
            front_end.finish(&mut base);
            searcher.tune(Some(point.ssb_freq_hz))?;
            let slices: Vec<_> = base.iter().map(Vec::as_slice).collect();
            let ssbs = searcher.search(&slices)?;
            if !ssbs.is_empty() {
                finds.push(RasterFind {
                    point,
                    spacing,
                    input_per_output: front_end.input_per_output(),
                    ssbs: ssbs.to_vec(),
                });
            }
        }
    }
    finds.sort_by(|a, b| b.strongest().total_cmp(&a.strongest()));
    Ok(finds)
}

impl RasterFind {
    /// SNR of the strongest SSB, dB.
    fn strongest(&self) -> f64 {
        self.ssbs
            .iter()
            .map(|ssb| ssb.snr_db)
            .fold(f64::NEG_INFINITY, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raster_points_have_the_numbers_of_the_standard() {
        let at = |hz: f64| {
            synchronization_raster(hz - 1.0, hz + 1.0)
                .next()
                .unwrap()
                .gscn
        };
        // TS 38.104 Table 5.4.3.1-1: GSCN = 3N + (M − 3)/2 and 7499 + N.
        assert_eq!(at(1.25e6), Some(2));
        assert_eq!(at(2_134.85e6), Some(3 * 1779 - 1));
        assert_eq!(at(1_862.65e6), Some(3 * 1552 + 1));
        assert_eq!(at(3_000e6), Some(7499));
        assert_eq!(at(3_512.64e6), Some(7499 + 356));
        assert_eq!(synchronization_raster(3_001e6, 3_001.4e6).count(), 0);
    }
}
