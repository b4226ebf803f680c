//! Finding the SSB's frequency and subcarrier spacing: the synchronization raster of TS 38.104
//! §5.4.3, point by point through the recorded band, at 15 and 30 kHz. Test networks place SSBs
//! elsewhere; for them, and for recordings that do not state their centre, see [`scan_off_raster`].

use std::ops::RangeInclusive;

use num_complex::Complex32;

use super::placement::placed_at;
use super::point_search::{OFFSET_UNIT_HZ, PointSearch, nearest_offset};
use crate::input::front_end::FrontEndError;
use crate::search::{DetectedSsb, SearchError};
use crate::standard::grid::SUBCARRIERS;
use crate::standard::numerology::SubcarrierSpacing;

/// A frequency where a cell may place an SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RasterPoint {
    /// Global synchronization channel number; `None` off the raster.
    pub gscn: Option<u16>,
    /// Frequency of the SSB's centre (subcarrier 120), Hz; relative to the recording's centre where
    /// that is unknown.
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

/// Share of the probability of a false cell, 1e-3 for 20 ms, that each of two scans at each of two
/// spacings may use up.
const FALSE_ALARM: f64 = 0.25e-3;
const SPACINGS: [SubcarrierSpacing; 2] = [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30];

/// All SSBs of a recording, `antennas` channels at `rate_hz` around `centre_hz` (`None`: unknown),
/// at whatever frequency and subcarrier spacing; the frequency with the strongest SSB first. First
/// [`scan_raster`]; where it finds nothing, [`scan_off_raster`].
///
/// # Errors
/// Those of [`scan_raster`].
pub fn scan(
    antennas: &[&[Complex32]],
    rate_hz: f64,
    centre_hz: Option<f64>,
) -> Result<Vec<RasterFind>, ScanError> {
    if let Some(centre_hz) = centre_hz {
        let finds = scan_raster(antennas, rate_hz, centre_hz)?;
        if !finds.is_empty() {
            return Ok(finds);
        }
    }
    scan_off_raster(antennas, rate_hz, centre_hz)
}

/// The SSBs on the points of the synchronization raster, the point with the strongest first.
///
/// A point also shows what lies up to half a subcarrier beside it, on the global frequency raster;
/// such an SSB is placed there, without a GSCN, if the phase between its symbols clearly says so.
/// In doubt it is taken to be on the point, and the rest for its carrier frequency offset: a cell
/// that is to be searched for must be on this raster.
///
/// The probability of a false cell, half of 1e-3 for 20 ms, is shared among the points.
///
/// # Errors
/// [`ScanError::FrontEnd`] for a rate that is no multiple of 3.84 MHz, [`ScanError::Search`] for
/// channels of unequal lengths or less than one SSB.
pub fn scan_raster(
    antennas: &[&[Complex32]],
    rate_hz: f64,
    centre_hz: f64,
) -> Result<Vec<RasterFind>, ScanError> {
    let mut finds = Vec::new();
    for spacing in SPACINGS {
        let reach = reach_hz(rate_hz, spacing);
        let points: Vec<_> = synchronization_raster(centre_hz - reach, centre_hz + reach).collect();
        if points.is_empty() {
            continue;
        }
        let mut at_point = PointSearch::new(
            spacing,
            rate_hz,
            antennas.len(),
            FALSE_ALARM / points.len() as f64,
        )?;
        for find in at_point.search_all(antennas, &points, centre_hz)? {
            // What the point's neighbours on the global frequency raster hold shows here too.
            let at = find.point;
            let band_hz = band(centre_hz, reach);
            let placed_hz = find.strongest().map_or(at.ssb_freq_hz, |ssb| {
                placed_at(at.ssb_freq_hz, true, ssb, spacing, band_hz)
            });
            finds.push(if placed_hz == at.ssb_freq_hz {
                find
            } else {
                at_point
                    .search(antennas, RasterPoint::off(placed_hz), Some(centre_hz))?
                    .unwrap_or(find)
            });
        }
    }
    sort(&mut finds);
    Ok(finds)
}

/// The SSBs anywhere in the band.
///
/// The PSS is looked for at steps of a third of a subcarrier through the whole band; the places
/// of the strongest maxima are then searched. An SSB belongs to a point of the global frequency
/// raster (TS 38.104 §5.4.2.1: multiples of 5 kHz below 3 GHz, of 15 kHz above), which may be nearer
/// than its carrier frequency offset. It is the phase between symbols that tells them apart (TS
/// 38.211 §5.4), and where that leaves a doubt the smaller offset is preferred.
///
/// Without the absolute centre frequency there is no raster to count from: an SSB is placed at
/// the nearest multiple of 15 kHz (the unit of k_SSB, TS 38.211 §7.4.3.1) from the recording's
/// centre, the rest is frequency offset, and that comes from inside the symbols only and is less
/// precise, see [`ssb_freq_hz`](crate::search::SearchConfig::ssb_freq_hz). The probability of a false
/// cell, half of 1e-3 for 20 ms, is shared among all points of the band.
///
/// Takes time in proportion to bandwidth squared, duration and antennas: for one antenna and 1 ms
/// at 23.04 Msps under a second.
///
/// # Errors
/// Those of [`scan_raster`].
pub fn scan_off_raster(
    antennas: &[&[Complex32]],
    rate_hz: f64,
    centre_hz: Option<f64>,
) -> Result<Vec<RasterFind>, ScanError> {
    let mut finds: Vec<RasterFind> = Vec::new();
    for spacing in SPACINGS {
        let reach = reach_hz(rate_hz, spacing);
        if reach.is_nan() || reach < 0.0 {
            continue;
        }
        let all = 2 * (reach / OFFSET_UNIT_HZ) as usize + 1;
        let mut at_point =
            PointSearch::new(spacing, rate_hz, antennas.len(), FALSE_ALARM / all as f64)?;
        let mut found_hz: Vec<f64> = Vec::new();
        for offset_hz in at_point.likely_offsets(antennas, reach)? {
            // An SSB also shows, weaker, where its PSS overlaps with a shifted one.
            let width_hz = SUBCARRIERS as f64 * spacing.hz();
            if found_hz.iter().any(|hz| (hz - offset_hz).abs() < width_hz) {
                continue;
            }
            let first = at_point.search(antennas, RasterPoint::off(offset_hz), None)?;
            let Some(strongest) = first.as_ref().and_then(RasterFind::strongest) else {
                continue;
            };
            // A wrong frequency would be taken for an offset (TS 38.211 §5.4).
            let offset_hz = match centre_hz {
                Some(centre_hz) => {
                    let tuned_hz = centre_hz + offset_hz;
                    let band_hz = band(centre_hz, reach);
                    placed_at(tuned_hz, false, strongest, spacing, band_hz) - centre_hz
                }
                None => nearest_offset(offset_hz + strongest.cfo_hz, reach),
            };
            found_hz.push(offset_hz);
            let point = RasterPoint::off(centre_hz.unwrap_or(0.0) + offset_hz);
            finds.extend(at_point.search(antennas, point, centre_hz)?);
        }
    }
    sort(&mut finds);
    Ok(finds)
}

/// How far from the recording's centre that of an SSB can lie.
fn reach_hz(rate_hz: f64, spacing: SubcarrierSpacing) -> f64 {
    0.5 * rate_hz - 0.5 * SUBCARRIERS as f64 * spacing.hz()
}

fn band(centre_hz: f64, reach_hz: f64) -> RangeInclusive<f64> {
    centre_hz - reach_hz..=centre_hz + reach_hz
}

fn sort(finds: &mut [RasterFind]) {
    let snr_db = |find: &RasterFind| find.strongest().map_or(f64::NEG_INFINITY, |it| it.snr_db);
    finds.sort_by(|a, b| snr_db(b).total_cmp(&snr_db(a)));
}

impl RasterPoint {
    const fn off(ssb_freq_hz: f64) -> Self {
        Self {
            gscn: None,
            ssb_freq_hz,
        }
    }
}

impl RasterFind {
    /// The SSB of highest SNR.
    fn strongest(&self) -> Option<&DetectedSsb> {
        self.ssbs
            .iter()
            .max_by(|a, b| a.snr_db.total_cmp(&b.snr_db))
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
