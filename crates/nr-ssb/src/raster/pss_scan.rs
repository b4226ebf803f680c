//! Where in a band the PSS stands out, at whatever frequency.

use num_complex::Complex32;

use super::error::ScanError;
use super::parallel::in_parallel;
use super::point_search::AT_ONCE;
use crate::dsp::base_rate::SYMBOL_SAMPLES;
use crate::dsp::hypotheses::cfo_hypotheses;
use crate::dsp::matched_filter::{MatchedFilter, PssCandidate};
use crate::input::front_end::FrontEnd;
use crate::numeric::false_alarm::exponential_sum_threshold;
use crate::standard::grid::SUBCARRIERS;
use crate::standard::numerology::SubcarrierSpacing;

/// The PSS is placed at multiples of this off the recording's centre.
pub(super) const OFFSET_UNIT_HZ: f64 = 15e3;
/// Half of what one tuning of the front end shows of the band: the PSS's 127 subcarriers may lie
/// anywhere among 240.
const TILE_SUBCARRIERS: f64 = 55.0;
/// Hypotheses per subcarrier: half way between two of them the PSS loses 0.9 dB.
const PER_SUBCARRIER: f64 = 2.0;
/// Maxima that noise may offer.
const NOISE_CANDIDATES: f64 = 4.0;
/// Offsets that are worth a search at most.
const MOST_OFFSETS: usize = 24;

/// One maximum.
struct Seen {
    statistic: f32,
    sample: usize,
    offset_hz: f64,
}

/// Offsets from the recording's centre, multiples of 15 kHz up to `reach_hz`, where the PSS
/// stands out, the likeliest first.
///
/// The band is cut into tiles as wide as the PSS can wander inside the front end's pass band.
pub(super) fn likely_offsets(
    spacing: SubcarrierSpacing,
    rate_hz: f64,
    antennas: &[&[Complex32]],
    reach_hz: f64,
) -> Result<Vec<f64>, ScanError> {
    let scs_hz = spacing.hz();
    let tiles = (reach_hz / (TILE_SUBCARRIERS * scs_hz)).ceil().max(1.0);
    let half_tile_hz = reach_hz / tiles;
    let hypotheses = cfo_hypotheses(half_tile_hz + 0.5 * scs_hz, scs_hz / PER_SUBCARRIER);
    let centres: Vec<f64> = (0..tiles as usize)
        .map(|tile| (2.0 * tile as f64 + 1.0) * half_tile_hz - reach_hz)
        .collect();
    let batches: Vec<&[f64]> = centres.chunks(AT_ONCE).collect();
    let trials_per_sample = 3.0 * hypotheses.len() as f64 * tiles;
    let worker = || {
        let front_end = FrontEnd::new(rate_hz, 0.0, scs_hz, antennas.len())?;
        let filter = MatchedFilter::new(scs_hz, &hypotheses, antennas.len());
        Ok((
            front_end,
            filter,
            vec![vec![Vec::new(); antennas.len()]; AT_ONCE],
        ))
    };
    let seen = in_parallel(
        &batches,
        worker,
        |(front_end, filter, bases), centres_hz| {
            let bases = &mut bases[..centres_hz.len()];
            front_end.process_at(antennas, centres_hz, bases)?;
            let mut seen = Vec::new();
            let mut candidates = Vec::new();
            for (tile_hz, base) in centres_hz.iter().zip(bases) {
                let samples = base.first().map_or(0, Vec::len);
                let trials = samples as f64 * trials_per_sample;
                let probability = NOISE_CANDIDATES / trials.max(NOISE_CANDIDATES);
                let threshold = exponential_sum_threshold(antennas.len(), probability);
                candidates.clear();
                filter.run(base, 0, samples, threshold as f32, &mut candidates);
                seen.extend(candidates.iter().map(|candidate: &PssCandidate| Seen {
                    statistic: candidate.statistic,
                    sample: candidate.sample,
                    offset_hz: nearest_offset(tile_hz + candidate.cfo_hz, reach_hz),
                }));
            }
            Ok::<_, ScanError>(seen)
        },
    )?;
    Ok(strongest(seen.into_iter().flatten().collect(), scs_hz))
}

/// Where the strongest maxima are, those left out that are but a stronger one's PSS, overlapping
/// with itself shifted in frequency.
fn strongest(mut seen: Vec<Seen>, scs_hz: f64) -> Vec<f64> {
    seen.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
    let width_hz = SUBCARRIERS as f64 * scs_hz;
    let mut kept: Vec<&Seen> = Vec::new();
    let mut offsets = Vec::new();
    for one in &seen {
        if offsets.len() == MOST_OFFSETS {
            break;
        }
        let shadow = kept.iter().any(|it| {
            it.sample.abs_diff(one.sample) < SYMBOL_SAMPLES
                && (it.offset_hz - one.offset_hz).abs() < width_hz
        });
        if shadow {
            continue;
        }
        kept.push(one);
        if !offsets.contains(&one.offset_hz) {
            offsets.push(one.offset_hz);
        }
    }
    offsets
}

/// The multiple of 15 kHz nearest to `hz` inside the reach.
pub(super) fn nearest_offset(hz: f64, reach_hz: f64) -> f64 {
    let last = (reach_hz / OFFSET_UNIT_HZ).floor();
    (hz / OFFSET_UNIT_HZ).round().clamp(-last, last) * OFFSET_UNIT_HZ
}
