//! Front end and search at one subcarrier spacing, moved through a recording's band.

use num_complex::Complex32;

use super::error::ScanError;
use super::find::RasterFind;
use super::point::RasterPoint;
use crate::dsp::hypotheses::cfo_hypotheses;
use crate::dsp::matched_filter::MatchedFilter;
use crate::input::front_end::{FrontEnd, FrontEndError};
use crate::numeric::false_alarm::exponential_sum_threshold;
use crate::search::{SearchConfig, Searcher};
use crate::standard::numerology::SubcarrierSpacing;

/// Off the raster, the PSS is looked for at multiples of this off the recording's centre.
pub(crate) const OFFSET_UNIT_HZ: f64 = 15e3;
/// Half of what one tuning of the front end shows of the band: the PSS's 127 subcarriers may lie
/// anywhere among 240.
const TILE_SUBCARRIERS: f64 = 55.0;
/// Maxima that noise may offer in a scan off the raster.
const NOISE_CANDIDATES: f64 = 4.0;
/// Points off the raster that are searched at most.
const MOST_POINTS: usize = 16;
/// Offsets that the front end is tuned to at once.
const AT_ONCE: usize = 8;

/// See the module; owns the searcher's plans and the samples at the base rate.
pub(crate) struct PointSearch {
    spacing: SubcarrierSpacing,
    front_end: FrontEnd,
    searcher: Searcher,
    /// Per offset tuned to, the channels at the base rate.
    bases: Vec<Vec<Vec<Complex32>>>,
}

impl PointSearch {
    /// `false_alarm` is the probability of a false cell at one point.
    pub(crate) fn new(
        spacing: SubcarrierSpacing,
        rate_hz: f64,
        antennas: usize,
        false_alarm: f64,
    ) -> Result<Self, ScanError> {
        Ok(Self {
            spacing,
            front_end: FrontEnd::new(rate_hz, 0.0, spacing.hz(), antennas)?,
            searcher: Searcher::new(SearchConfig {
                false_alarm,
                ..SearchConfig::new(spacing, antennas)
            })?,
            bases: vec![vec![Vec::new(); antennas]; AT_ONCE],
        })
    }

    /// The SSBs at one point, its frequency absolute or, where that of the recording's centre is not
    /// known, relative to it.
    pub(crate) fn search(
        &mut self,
        antennas: &[&[Complex32]],
        point: RasterPoint,
        centre_hz: Option<f64>,
    ) -> Result<Option<RasterFind>, ScanError> {
        self.tune(antennas, &[point.ssb_freq_hz - centre_hz.unwrap_or(0.0)])?;
        self.look(0, point, centre_hz.is_some())
    }

    /// The SSBs at many points of known frequency.
    pub(crate) fn search_all(
        &mut self,
        antennas: &[&[Complex32]],
        points: &[RasterPoint],
        centre_hz: f64,
    ) -> Result<Vec<RasterFind>, ScanError> {
        let mut finds = Vec::new();
        for points in points.chunks(AT_ONCE) {
            let offsets_hz = points.iter().map(|point| point.ssb_freq_hz - centre_hz);
            self.tune(antennas, &offsets_hz.collect::<Vec<_>>())?;
            for (index, point) in points.iter().enumerate() {
                finds.extend(self.look(index, *point, true)?);
            }
        }
        Ok(finds)
    }

    /// Brings each offset to 0 Hz and all channels to the base rate.
    fn tune(&mut self, antennas: &[&[Complex32]], offsets_hz: &[f64]) -> Result<(), FrontEndError> {
        let bases = &mut self.bases[..offsets_hz.len()];
        self.front_end.process_at(antennas, offsets_hz, bases)
    }

    /// Searches what was tuned to as number `index`.
    fn look(
        &mut self,
        index: usize,
        point: RasterPoint,
        absolute: bool,
    ) -> Result<Option<RasterFind>, ScanError> {
        self.searcher.tune(absolute.then_some(point.ssb_freq_hz))?;
        let slices: Vec<_> = self.bases[index].iter().map(Vec::as_slice).collect();
        let ssbs = self.searcher.search(&slices)?;
        Ok((!ssbs.is_empty()).then(|| RasterFind {
            point,
            spacing: self.spacing,
            input_per_output: self.front_end.input_per_output(),
            ssbs: ssbs.to_vec(),
        }))
    }

    /// Offsets from the recording's centre, multiples of 15 kHz up to `reach_hz`, where the PSS
    /// stands out, the likeliest first.
    ///
    /// The band is cut into tiles as wide as the PSS can wander inside the front end's pass band.
    pub(crate) fn likely_offsets(
        &mut self,
        antennas: &[&[Complex32]],
        reach_hz: f64,
    ) -> Result<Vec<f64>, ScanError> {
        let scs_hz = self.spacing.hz();
        let tiles = (reach_hz / (TILE_SUBCARRIERS * scs_hz)).ceil().max(1.0);
        let half_tile_hz = reach_hz / tiles;
        let hypotheses = cfo_hypotheses(half_tile_hz + 0.5 * scs_hz, scs_hz);
        let mut filter = MatchedFilter::new(scs_hz, &hypotheses, antennas.len());
        let mut seen: Vec<(f32, f64)> = Vec::new();
        let mut candidates = Vec::new();
        let centres: Vec<f64> = (0..tiles as usize)
            .map(|tile| (2.0 * tile as f64 + 1.0) * half_tile_hz - reach_hz)
            .collect();
        for centres_hz in centres.chunks(AT_ONCE) {
            self.tune(antennas, centres_hz)?;
            for (tile_hz, base) in centres_hz.iter().zip(&self.bases) {
                let samples = base.first().map_or(0, Vec::len);
                let trials = samples as f64 * 3.0 * hypotheses.len() as f64 * tiles;
                let probability = NOISE_CANDIDATES / trials.max(NOISE_CANDIDATES);
                let threshold = exponential_sum_threshold(antennas.len(), probability);
                candidates.clear();
                filter.run(base, 0, samples, threshold as f32, &mut candidates);
                seen.extend(candidates.iter().map(|candidate| {
                    let offset_hz = nearest_offset(tile_hz + candidate.cfo_hz, reach_hz);
                    (candidate.statistic, offset_hz)
                }));
            }
        }
        seen.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut offsets = Vec::new();
        for (_, offset_hz) in seen {
            if offsets.len() < MOST_POINTS && !offsets.contains(&offset_hz) {
                offsets.push(offset_hz);
            }
        }
        Ok(offsets)
    }
}

/// The multiple of 15 kHz nearest to `hz` inside the reach.
pub(crate) fn nearest_offset(hz: f64, reach_hz: f64) -> f64 {
    let last = (reach_hz / OFFSET_UNIT_HZ).floor();
    (hz / OFFSET_UNIT_HZ).round().clamp(-last, last) * OFFSET_UNIT_HZ
}
