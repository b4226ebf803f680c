//! Scans of a recording, on and off the synchronization raster.

use std::ops::RangeInclusive;

use num_complex::Complex32;

use super::error::ScanError;
use super::find::RasterFind;
use super::parallel::in_parallel;
use super::placement::placed_at;
use super::point::{RasterPoint, synchronization_raster};
use super::point_search::{AT_ONCE, PointSearch};
use super::pss_scan::{OFFSET_UNIT_HZ, likely_offsets, nearest_offset};
use crate::dsp::base_rate::SSB_SAMPLES;
use crate::standard::grid::SUBCARRIERS;
use crate::standard::numerology::SubcarrierSpacing;

/// False-alarm probability of each of two scans at each of two spacings, for a total of 1e-3 per 20
/// ms.
const FALSE_ALARM: f64 = 0.25e-3;

/// Returns all SSBs of a recording with `antennas` at `rate_hz` around `centre_hz` (`None`:
/// unknown), at any frequency and every subcarrier spacing of the frequency range (range 1 if
/// unknown), the frequency with the strongest SSB first. It is [`scan_raster`], followed by
/// [`scan_off_raster`] for the other frequencies.
///
/// # Errors
/// Those of [`scan_raster`].
pub fn scan(
    antennas: &[&[Complex32]],
    rate_hz: f64,
    centre_hz: Option<f64>,
) -> Result<Vec<RasterFind>, ScanError> {
    let mut finds = match centre_hz {
        Some(centre_hz) => scan_raster(antennas, rate_hz, centre_hz)?,
        None => Vec::new(),
    };
    let off_raster = scan_off_raster(antennas, rate_hz, centre_hz, &finds)?;
    finds.extend(off_raster);
    Ok(without_shadows(finds))
}

/// Returns the SSBs at the points of the synchronization raster, the point with the strongest
/// first.
///
/// An SSB within half a subcarrier of a point, on the global frequency raster, is also detected at
/// the point. It is assigned to its own frequency, without a GSCN, if the phase between its symbols
/// is unambiguous. Otherwise it is assigned to the point, and the difference is part of its carrier
/// frequency offset, because cells that UEs search for are on this raster.
///
/// The false-alarm probability, half of 1e-3 for 20 ms, is divided among the points.
///
/// # Errors
/// [`ScanError::FrontEnd`] for a rate that cannot be converted, [`ScanError::Search`] for
/// channels of unequal lengths or less than one SSB.
pub fn scan_raster(
    antennas: &[&[Complex32]],
    rate_hz: f64,
    centre_hz: f64,
) -> Result<Vec<RasterFind>, ScanError> {
    let mut finds = Vec::new();
    for spacing in SubcarrierSpacing::of_range(centre_hz) {
        let reach = reach_hz(rate_hz, spacing);
        let points: Vec<_> = synchronization_raster(centre_hz - reach, centre_hz + reach).collect();
        if points.is_empty() {
            continue;
        }
        let false_alarm = FALSE_ALARM / points.len() as f64;
        let worker = || PointSearch::new(spacing, rate_hz, antennas.len(), false_alarm);
        let batches: Vec<&[RasterPoint]> = points.chunks(AT_ONCE).collect();
        let found = in_parallel(&batches, worker, |at_point, points| {
            let placed = |find: RasterFind, at_point: &mut PointSearch| {
                // SSBs at neighbouring points of the global frequency raster are also detected
                // here.
                let at = find.point;
                let band_hz = band(centre_hz, reach);
                let Some(ssb) = find.strongest() else {
                    return Ok(find);
                };
                let placed_hz = placed_at(at.ssb_freq_hz, true, ssb, spacing, band_hz);
                if placed_hz == at.ssb_freq_hz {
                    return Ok(find);
                }
                let cfo_hz = at.ssb_freq_hz + ssb.coarse_cfo_hz - placed_hz;
                let point = RasterPoint::off(placed_hz);
                let there = at_point.search(antennas, point, Some(centre_hz), cfo_hz)?;
                Ok(there.unwrap_or(find))
            };
            let finds = at_point.search_all(antennas, points, centre_hz)?;
            finds
                .into_iter()
                .map(|find| placed(find, at_point))
                .collect::<Result<Vec<_>, _>>()
        })?;
        finds.extend(found.into_iter().flatten());
    }
    Ok(without_shadows(finds))
}

/// Returns the SSBs anywhere in the band, except at the `known` ones.
///
/// The PSS is searched for in steps of half a subcarrier over the whole band. An SSB is searched
/// for around the strongest maxima, and if it is detected, in the whole recording. An SSB is
/// assigned to a point of the global frequency raster (TS 38.104 §5.4.2.1, multiples of 15 kHz from
/// 3 GHz on), whose spacing may be below the carrier frequency offset. The phase between symbols
/// distinguishes the points (TS 38.211 §5.4); if it is ambiguous, the smaller offset is preferred.
///
/// Without an absolute centre frequency there is no raster: an SSB is assigned to the nearest
/// multiple of 15 kHz (the unit of k_SSB, TS 38.211 §7.4.3.1) from the recording's centre. The
/// remainder is its frequency offset, which is estimated within symbols only and is less precise,
/// see [`ssb_freq_hz`](crate::search::SearchConfig::ssb_freq_hz). The false-alarm probability, half
/// of 1e-3 for 20 ms, is divided among all points of the band.
///
/// The duration is proportional to bandwidth squared, recording length and number of antennas, on
/// all processors: about half a second for 20 ms of one antenna at 46 Msps on two processors.
///
/// # Errors
/// Those of [`scan_raster`].
pub fn scan_off_raster(
    antennas: &[&[Complex32]],
    rate_hz: f64,
    centre_hz: Option<f64>,
    known: &[RasterFind],
) -> Result<Vec<RasterFind>, ScanError> {
    let mut finds: Vec<RasterFind> = Vec::new();
    for spacing in SubcarrierSpacing::of_range(centre_hz.unwrap_or(0.0)) {
        let reach = reach_hz(rate_hz, spacing);
        if reach.is_nan() || reach < 0.0 {
            continue;
        }
        let all = 2 * (reach / OFFSET_UNIT_HZ) as usize + 1;
        let mut at_point =
            PointSearch::new(spacing, rate_hz, antennas.len(), FALSE_ALARM / all as f64)?;
        let same = known.iter().filter(|find| find.spacing == spacing);
        let received_hz = |find: &RasterFind| {
            let cfo_hz = find.strongest().map_or(0.0, |ssb| ssb.cfo_hz);
            find.point.ssb_freq_hz - centre_hz.unwrap_or(0.0) + cfo_hz
        };
        let mut found_hz: Vec<f64> = same.map(received_hz).collect();
        for seen in likely_offsets(spacing, rate_hz, antennas, reach)? {
            let offset_hz = seen.received_hz;
            // An SSB is also visible one subcarrier away.
            let same_place = |hz: &f64| (hz - offset_hz).abs() < 1.5 * spacing.hz();
            if found_hz.iter().any(same_place) {
                continue;
            }
            let around = around(antennas, seen.sample, rate_hz / spacing.base_rate_hz());
            let first = at_point.search(&around, RasterPoint::off(offset_hz), None, 0.0)?;
            let Some(strongest) = first.as_ref().and_then(RasterFind::strongest) else {
                continue;
            };
            let received_hz = offset_hz + strongest.coarse_cfo_hz;
            // A wrong SSB frequency would bias the offset (TS 38.211 §5.4).
            let offset_hz = match centre_hz {
                Some(centre_hz) => {
                    let tuned_hz = centre_hz + offset_hz;
                    let band_hz = band(centre_hz, reach);
                    placed_at(tuned_hz, false, strongest, spacing, band_hz) - centre_hz
                }
                None => nearest_offset(offset_hz + strongest.cfo_hz, reach),
            };
            found_hz.push(received_hz);
            let point = RasterPoint::off(centre_hz.unwrap_or(0.0) + offset_hz);
            let find = at_point.search(antennas, point, centre_hz, received_hz - offset_hz)?;
            finds.extend(find.filter(|find| !known.iter().any(|it| it.casts(find))));
        }
    }
    Ok(without_shadows(finds))
}

/// Returns the samples around an SSB whose PSS starts at `sample`; `ratio` is the number of samples
/// per sample at the base rate.
fn around<'a>(antennas: &[&'a [Complex32]], sample: f64, ratio: f64) -> Vec<&'a [Complex32]> {
    let from = (sample - SSB_SAMPLES as f64 * ratio).max(0.0) as usize;
    let to = (sample + 2.0 * SSB_SAMPLES as f64 * ratio) as usize;
    let part = |samples: &&'a [Complex32]| {
        let to = to.min(samples.len());
        &samples[from.min(to)..to]
    };
    antennas.iter().map(part).collect()
}

/// Returns the maximum distance of an SSB's centre from that of the recording; negative if no SSB
/// fits.
pub fn reach_hz(rate_hz: f64, spacing: SubcarrierSpacing) -> f64 {
    0.5 * rate_hz - 0.5 * SUBCARRIERS as f64 * spacing.hz()
}

fn band(centre_hz: f64, reach_hz: f64) -> RangeInclusive<f64> {
    centre_hz - reach_hz..=centre_hz + reach_hz
}

/// Returns the results that are not ghosts of others, the strongest first.
fn without_shadows(mut finds: Vec<RasterFind>) -> Vec<RasterFind> {
    let snr_db = |find: &RasterFind| find.strongest().map_or(f64::NEG_INFINITY, |it| it.snr_db);
    finds.sort_by(|a, b| snr_db(b).total_cmp(&snr_db(a)));
    let mut kept: Vec<RasterFind> = Vec::new();
    for find in finds {
        if !kept.iter().any(|it| it.casts(&find)) {
            kept.push(find);
        }
    }
    kept
}
