//! Front end and search at one subcarrier spacing, tuned through the band of a recording.

use num_complex::Complex32;

use super::error::ScanError;
use super::find::RasterFind;
use super::point::RasterPoint;
use crate::input::front_end::{FrontEnd, FrontEndError};
use crate::search::{SearchConfig, Searcher};
use crate::standard::numerology::SubcarrierSpacing;

/// Number of offsets that the front end processes together.
pub(crate) const AT_ONCE: usize = 8;

/// Tunable search. It owns the searcher's plans and the samples at the base rate.
pub(crate) struct PointSearch {
    spacing: SubcarrierSpacing,
    front_end: FrontEnd,
    searcher: Searcher,
    /// Channels at the base rate for each tuned offset.
    bases: Vec<Vec<Vec<Complex32>>>,
}

impl PointSearch {
    /// Creates the search; `false_alarm` is the probability of a false cell at one point.
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

    /// Returns the SSBs at one point, around a carrier frequency offset. The frequency is absolute
    /// or, if that of the recording's centre is unknown, relative to it.
    pub(crate) fn search(
        &mut self,
        antennas: &[&[Complex32]],
        point: RasterPoint,
        centre_hz: Option<f64>,
        cfo_centre_hz: f64,
    ) -> Result<Option<RasterFind>, ScanError> {
        self.tune(antennas, &[point.ssb_freq_hz - centre_hz.unwrap_or(0.0)])?;
        self.searcher.centre(cfo_centre_hz)?;
        self.search_point(0, point, centre_hz.is_some())
    }

    /// Returns the SSBs at up to [`AT_ONCE`] points of known frequency.
    pub(crate) fn search_all(
        &mut self,
        antennas: &[&[Complex32]],
        points: &[RasterPoint],
        centre_hz: f64,
    ) -> Result<Vec<RasterFind>, ScanError> {
        let mut finds = Vec::new();
        let offsets_hz = points.iter().map(|point| point.ssb_freq_hz - centre_hz);
        self.tune(antennas, &offsets_hz.collect::<Vec<_>>())?;
        self.searcher.centre(0.0)?;
        for (index, point) in points.iter().enumerate() {
            finds.extend(self.search_point(index, *point, true)?);
        }
        Ok(finds)
    }

    /// Shifts each offset to 0 Hz, and resamples all channels to the base rate.
    fn tune(&mut self, antennas: &[&[Complex32]], offsets_hz: &[f64]) -> Result<(), FrontEndError> {
        let bases = &mut self.bases[..offsets_hz.len()];
        self.front_end.process_at(antennas, offsets_hz, bases)
    }

    /// Searches the tuned offset number `index`.
    fn search_point(
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
}
