//! Array response and angle of one SSB, for any supported number of antennas.
//!
//! This module is part of the crate because the estimators of every number of antennas are compiled
//! here anyway.

use aoa::{
    AngleEstimate, Array, Calibration, DirectionEstimate, DirectionFinder,
    maximum_likelihood_pilots,
};
use nr_ssb::SsbGrid;
use nr_ssb::grid::SUBCARRIERS;
use nr_ssb::search::ReceivedElements;
use nr_ssb::track::ReceivedGrid;
use num_complex::Complex64;

use super::despread::Despread;
use super::wideband::line_of_sight;
use crate::elements::for_elements;
use crate::manifold::ArrayManifold;
use crate::observation::MAX_ELEMENTS;
use crate::settings::{ArrayShape, Pilots};

/// Receiving array.
#[derive(Debug, Clone, PartialEq)]
pub struct ArraySetup {
    /// Array geometry.
    pub shape: ArrayShape,
    /// Distance between neighbouring antennas in wavelengths, along the row or the circle.
    pub spacing_wavelengths: f64,
    /// Complex gain of each channel. Samples are divided by it. Default: ideal channels.
    pub calibration: Option<Vec<Complex64>>,
}

impl Default for ArraySetup {
    fn default() -> Self {
        Self {
            shape: ArrayShape::default(),
            spacing_wavelengths: 0.5,
            calibration: None,
        }
    }
}

/// Direction of an SSB, as far as the array measures it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FoundAngle {
    /// Uniform linear array: the angle from its axis.
    FromRow(AngleEstimate),
    /// Other arrays: azimuth from the array axis, and elevation.
    Direction(DirectionEstimate),
}

impl FoundAngle {
    /// Returns the angle of a uniform linear array.
    pub const fn from_row(self) -> Option<AngleEstimate> {
        match self {
            Self::FromRow(estimate) => Some(estimate),
            Self::Direction(_) => None,
        }
    }
}

/// Angle of an SSB, and the received array response with the calibration applied.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Direction of the SSB.
    pub angle: FoundAngle,
    /// One snapshot per OFDM symbol, with unit noise power.
    pub blocks: Vec<Vec<Complex64>>,
}

/// Received resource elements of one SSB.
#[derive(Debug, Clone, Copy)]
pub struct SsbElements<'a> {
    /// Elements of every antenna.
    pub received: &'a [ReceivedGrid],
    /// Known elements, zero elsewhere.
    pub known: &'a SsbGrid,
    /// Noise variance of an element, for each antenna.
    pub noise_variance: &'a [f64],
    /// Delay that is not yet compensated, in samples.
    pub delay: f64,
}

/// Symbol of the SSB that contains the PBCH only.
const PBCH_SYMBOL: usize = 1;

/// Estimator of the array response and angle of SSBs from a search or a receiver.
pub trait ArrayView: Send + Sync {
    /// Passes calibrated array responses of an SSB with unit noise power to `take`: the line of sight
    /// if the channel varies over the band, otherwise one response per symbol with pilots.
    fn responses(&self, ssb: &SsbElements<'_>, pilots: Pilots, take: &mut dyn FnMut(&[Complex64]));

    /// Passes `count` calibrated resource elements of the PBCH to `take`, as snapshots of an unknown
    /// signal.
    fn snapshots(&self, ssb: &SsbElements<'_>, count: usize, take: &mut dyn FnMut(&[Complex64]));

    /// Returns the angle of an SSB, using all its known resource elements as pilots.
    fn view(&self, ssb: &ReceivedElements<'_>) -> Option<View>;

    /// Returns the angle from the despread pilots of each symbol. `noise_variance` contains that of
    /// each antenna.
    fn of_blocks(&self, blocks: &[Vec<Complex64>], noise_variance: &[f64]) -> Option<View>;
}

/// Returns the estimator for a number of antennas; `None` for one antenna.
///
/// # Errors
/// [`aoa::Error`] for an invalid spacing or gain. [`aoa::Error::CalibrationGain`] with the first
/// missing channel if the calibration is too short.
pub fn array_view(
    antennas: usize,
    setup: &ArraySetup,
) -> Result<Option<Box<dyn ArrayView>>, aoa::Error> {
    if !(2..=MAX_ELEMENTS).contains(&antennas) {
        return Ok(None);
    }
    for_elements!(antennas, A => Ok(Some(Box::new(Viewer::<A>::new(setup)?))))
}

struct Viewer<const A: usize> {
    array: Array<A>,
    /// Direction finder of a non-linear array.
    finder: Option<DirectionFinder<ArrayManifold<A>, A>>,
    calibration: Calibration<A>,
}

impl<const A: usize> Viewer<A> {
    fn new(setup: &ArraySetup) -> Result<Self, aoa::Error> {
        let mut calibration = Calibration::IDENTITY;
        if let Some(gains) = &setup.calibration {
            let gains = <[Complex64; A]>::try_from(gains.as_slice())
                .map_err(|_| aoa::Error::CalibrationGain(gains.len().min(A)))?;
            calibration = Calibration::new(gains)?;
        }
        let manifold = ArrayManifold::new(&setup.shape, setup.spacing_wavelengths)?;
        Ok(Self {
            finder: manifold.map(ArrayManifold::finder).transpose()?,
            array: Array::new(setup.spacing_wavelengths)?,
            calibration,
        })
    }

    /// Returns the gain of each antenna that calibrates the channels and normalises the mean noise
    /// variance to one.
    fn gains(&self, noise_variance: &[f64]) -> [Complex64; A] {
        let noise = noise_variance.iter().sum::<f64>() / A as f64;
        let scale = noise.max(f64::MIN_POSITIVE).sqrt().recip();
        self.calibration.gains().map(|gain| scale / gain)
    }

    /// Returns the calibrated sums over the known elements, with unit noise variance.
    fn despread(&self, ssb: &SsbElements<'_>, pilots: Pilots) -> Option<Despread<A>> {
        let received = ssb.received.first_chunk::<A>()?.each_ref();
        let gains = self.gains(ssb.noise_variance);
        Some(Despread::new(received, ssb.known, pilots, ssb.delay).scaled(&gains))
    }

    /// Returns the angle from the blocks `used`, together with all blocks.
    fn seen(&self, used: &[[Complex64; A]], blocks: &[[Complex64; A]]) -> Option<View> {
        let angle = if let Some(finder) = &self.finder {
            FoundAngle::Direction(finder.estimate_pilots(used, Some(1.0)).ok()?)
        } else {
            let found = maximum_likelihood_pilots(used, Some(1.0), &self.array);
            FoundAngle::FromRow(found.ok()?)
        };
        let blocks = blocks.iter().map(|block| block.to_vec()).collect();
        Some(View { angle, blocks })
    }
}

impl<const A: usize> ArrayView for Viewer<A> {
    fn responses(&self, ssb: &SsbElements<'_>, pilots: Pilots, take: &mut dyn FnMut(&[Complex64])) {
        let Some(despread) = self.despread(ssb, pilots) else {
            return;
        };
        match line_of_sight(&despread, self.finder.as_ref()) {
            Some(direct) => take(&direct.block),
            None => despread.blocks().for_each(|block| take(&block)),
        }
    }

    fn snapshots(&self, ssb: &SsbElements<'_>, count: usize, take: &mut dyn FnMut(&[Complex64])) {
        let gains = self.gains(ssb.noise_variance);
        for number in 0..count {
            let subcarrier = number * SUBCARRIERS / count;
            let mut snapshot = gains;
            for (value, grid) in snapshot.iter_mut().zip(ssb.received) {
                let element = grid[PBCH_SYMBOL][subcarrier];
                *value *= Complex64::new(element.re.into(), element.im.into());
            }
            take(&snapshot);
        }
    }

    fn view(&self, ssb: &ReceivedElements<'_>) -> Option<View> {
        let elements = SsbElements {
            received: ssb.elements,
            known: ssb.known,
            noise_variance: ssb.noise_variance,
            delay: 0.0,
        };
        let despread = self.despread(&elements, Pilots::Ssb)?;
        let blocks: Vec<[Complex64; A]> = despread.blocks().collect();
        let direct = line_of_sight(&despread, self.finder.as_ref()).map(|direct| [direct.block]);
        self.seen(direct.as_ref().map_or(&blocks[..], |block| block), &blocks)
    }

    fn of_blocks(&self, blocks: &[Vec<Complex64>], noise_variance: &[f64]) -> Option<View> {
        let gains = self.gains(noise_variance);
        let calibrated = blocks.iter().map(|block| {
            let block = block.first_chunk::<A>()?;
            Some(std::array::from_fn(|n| block[n] * gains[n]))
        });
        let blocks = calibrated.collect::<Option<Vec<[Complex64; A]>>>()?;
        self.seen(&blocks, &blocks)
    }
}
