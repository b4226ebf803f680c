//! Detection of the PSS anywhere in a band.

use num_complex::Complex32;

use super::error::ScanError;
use super::parallel::in_parallel;
use crate::dsp::base_rate::SYMBOL_SAMPLES;
use crate::dsp::pss_segments::{HOP, SegmentFilter, TRIALS, tiles};
use crate::dsp::tones::ToneCanceller;
use crate::input::front_end::FrontEnd;
use crate::numeric::false_alarm::exponential_sum_threshold;
use crate::standard::grid::SUBCARRIERS;
use crate::standard::numerology::SubcarrierSpacing;

/// Grid of PSS frequencies relative to the recording's centre.
pub(super) const OFFSET_UNIT_HZ: f64 = 15e3;
/// Expected number of maxima due to noise. Each requires a search over the duration of three SSBs.
/// Four times as many would recover half of the loss due to the addition of powers.
const NOISE_CANDIDATES: f64 = 16.0;
/// Maximum number of offsets that are searched.
const MAX_OFFSETS: usize = 24;
/// Number of lags per thread and chunk, at the base rate.
const CHUNK: usize = 4 * HOP;
/// Number of additional samples before a chunk, for the front end's filter.
const BEFORE: usize = 256;
/// Number of additional samples after a chunk, for the front end's filter and the PSS.
const AFTER: usize = 512;

/// Detected PSS.
pub(super) struct PssDetection {
    statistic: f32,
    /// First sample of the PSS in the recording.
    pub(super) sample: f64,
    /// Offset from the recording's centre in Hz, in steps of half a subcarrier.
    pub(super) received_hz: f64,
    /// Multiple of 15 kHz nearest to `received_hz`.
    offset_hz: f64,
}

/// Returns the offsets up to `reach_hz` from the recording's centre at which the PSS is detected,
/// the most probable first, one for each multiple of 15 kHz.
pub(super) fn likely_offsets(
    spacing: SubcarrierSpacing,
    rate_hz: f64,
    antennas: &[&[Complex32]],
    reach_hz: f64,
) -> Result<Vec<PssDetection>, ScanError> {
    let scs_hz = spacing.hz();
    let reach = (reach_hz / scs_hz).floor() as usize;
    let tiles = tiles(reach);
    let tuned_hz: Vec<f64> = tiles.iter().map(|it| it.centre as f64 * scs_hz).collect();
    let length = antennas.iter().map(|it| it.len()).min().unwrap_or(0);
    let ratio = rate_hz / spacing.base_rate_hz();
    let trials = length as f64 / ratio * (2 * reach + 1) as f64 * TRIALS;
    let probability = NOISE_CANDIDATES / trials.max(NOISE_CANDIDATES);
    let threshold = exponential_sum_threshold(3 * antennas.len(), probability) as f32;
    let in_input = |base: usize| (base as f64 * ratio) as usize;
    let starts: Vec<usize> = (0..length).step_by(in_input(CHUNK).max(1)).collect();
    let worker = || {
        let front_end = FrontEnd::new(rate_hz, 0.0, scs_hz, antennas.len())?;
        let filter = SegmentFilter::new(antennas.len());
        let bases = vec![vec![Vec::new(); antennas.len()]; tiles.len()];
        let canceller = ToneCanceller::new(antennas.len());
        Ok((front_end, filter, canceller, bases))
    };
    let seen = in_parallel(
        &starts,
        worker,
        |(front_end, filter, canceller, bases), &start| {
            let from = start.saturating_sub(in_input(BEFORE));
            let to = length.min(start + in_input(CHUNK + AFTER));
            let part: Vec<&[Complex32]> = antennas.iter().map(|it| &it[from..to]).collect();
            front_end.process_at(&part, &tuned_hz, bases)?;
            for base in &mut *bases {
                canceller.forget();
                canceller.detect(base, 0);
                canceller.subtract(base, 0);
            }
            let samples = bases.iter().flatten().map(Vec::len).min().unwrap_or(0);
            let first = ((start - from) as f64 / ratio) as usize;
            let end = (first + CHUNK).min(samples);
            let mut maxima = Vec::new();
            filter.run(&tiles, bases, (first, end), threshold, &mut maxima);
            let seen = maxima.iter().map(|maximum| {
                let received_hz = maximum.subcarriers * scs_hz;
                PssDetection {
                    statistic: maximum.statistic,
                    sample: from as f64 + maximum.sample * ratio,
                    received_hz: received_hz.clamp(-reach_hz, reach_hz),
                    offset_hz: nearest_offset(received_hz, reach_hz),
                }
            });
            Ok::<_, ScanError>(seen.collect::<Vec<_>>())
        },
    )?;
    let near = SYMBOL_SAMPLES as f64 * ratio;
    Ok(strongest(
        seen.into_iter().flatten().collect(),
        near,
        scs_hz,
    ))
}

/// Returns the strongest maxima, one for each offset, without frequency-shifted sidelobes of a
/// stronger PSS. `near` is the number of samples of a symbol.
fn strongest(mut seen: Vec<PssDetection>, near: f64, scs_hz: f64) -> Vec<PssDetection> {
    seen.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
    let width_hz = SUBCARRIERS as f64 * scs_hz;
    let mut kept: Vec<PssDetection> = Vec::new();
    let mut likeliest: Vec<usize> = Vec::new();
    for one in seen {
        if likeliest.len() == MAX_OFFSETS {
            break;
        }
        let shadow = kept.iter().any(|it| {
            (it.sample - one.sample).abs() < near && (it.offset_hz - one.offset_hz).abs() < width_hz
        });
        if shadow {
            continue;
        }
        if !likeliest
            .iter()
            .any(|it| kept[*it].offset_hz == one.offset_hz)
        {
            likeliest.push(kept.len());
        }
        kept.push(one);
    }
    let mut number = 0;
    kept.retain(|_| {
        number += 1;
        likeliest.contains(&(number - 1))
    });
    kept
}

/// Returns the multiple of 15 kHz nearest to `hz` within the range.
pub(super) fn nearest_offset(hz: f64, reach_hz: f64) -> f64 {
    let last = (reach_hz / OFFSET_UNIT_HZ).floor();
    (hz / OFFSET_UNIT_HZ).round().clamp(-last, last) * OFFSET_UNIT_HZ
}
