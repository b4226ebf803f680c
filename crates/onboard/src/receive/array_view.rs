//! The angle of one SSB, for arrays of any number of antennas that the crates know.
//!
//! Here and not where it is used, as the estimators of each number of antennas are compiled here anyway.

use aoa::{
    AngleEstimate, Array, Calibration, DirectionEstimate, DirectionFinder,
    maximum_likelihood_pilots,
};
use nr_ssb::search::ReceivedSsb;
use num_complex::Complex64;

use super::despread::Despread;
use super::wideband::line_of_sight;
use crate::elements::for_elements;
use crate::manifold::ArrayManifold;
use crate::observation::MAX_ELEMENTS;
use crate::settings::{ArrayShape, Pilots};

/// The receiving array.
#[derive(Debug, Clone, PartialEq)]
pub struct ArraySetup {
    /// How the antennas stand.
    pub shape: ArrayShape,
    /// Distance between neighbouring antennas in wavelengths, in a row or around a circle.
    pub spacing_wavelengths: f64,
    /// Complex gain of each channel, by which it is divided; ideal channels without.
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

/// What an array tells of where an SSB comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FoundAngle {
    /// Antennas in a row: the angle from it.
    FromRow(AngleEstimate),
    /// Any others: azimuth from the array's axis, and elevation.
    Direction(DirectionEstimate),
}

impl FoundAngle {
    /// What antennas in a row tell.
    pub const fn from_row(self) -> Option<AngleEstimate> {
        match self {
            Self::FromRow(estimate) => Some(estimate),
            Self::Direction(_) => None,
        }
    }
}

/// Angle, and the array's response as it was received, calibration taken out.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Where it comes from.
    pub angle: FoundAngle,
    /// One snapshot per OFDM symbol, noise power one.
    pub blocks: Vec<Vec<Complex64>>,
}

/// Angles of SSBs that a search has found, or a receiver has heard.
pub trait ArrayView: Send + Sync {
    /// Looks at an SSB, all of whose known elements are pilots.
    fn view(&self, ssb: &ReceivedSsb<'_>) -> Option<View>;

    /// Looks at what the pilots of each symbol say together, in noise of so much variance on each antenna.
    fn of_blocks(&self, blocks: &[Vec<Complex64>], noise_variance: &[f64]) -> Option<View>;
}

/// The view of an array of so many antennas; `None` for a single one.
///
/// # Errors
/// [`aoa::Error`] for an impossible spacing or gain; [`aoa::Error::CalibrationGain`] of the first
/// missing channel where the calibration is too short.
pub fn array_view(
    antennas: usize,
    setup: &ArraySetup,
) -> Result<Option<Box<dyn ArrayView>>, aoa::Error> {
    if !(2..=MAX_ELEMENTS).contains(&antennas) {
        return Ok(None);
    }
    for_elements!(antennas, A => Ok(Some(Box::new(Looker::<A>::new(setup)?))))
}

struct Looker<const A: usize> {
    array: Array<A>,
    /// Of antennas that are not in a row.
    finder: Option<DirectionFinder<ArrayManifold<A>, A>>,
    calibration: Calibration<A>,
}

impl<const A: usize> Looker<A> {
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

    /// What brings noise of the mean of these variances to power one, and equals the channels.
    fn gains(&self, noise_variance: &[f64]) -> [Complex64; A] {
        let noise = noise_variance.iter().sum::<f64>() / A as f64;
        let scale = noise.max(f64::MIN_POSITIVE).sqrt().recip();
        self.calibration.gains().map(|gain| scale / gain)
    }

    /// The angle of the blocks that are looked at, beside all.
    fn seen(&self, looked_at: &[[Complex64; A]], blocks: &[[Complex64; A]]) -> Option<View> {
        let angle = if let Some(finder) = &self.finder {
            FoundAngle::Direction(finder.estimate_pilots(looked_at, Some(1.0)).ok()?)
        } else {
            let found = maximum_likelihood_pilots(looked_at, Some(1.0), &self.array);
            FoundAngle::FromRow(found.ok()?)
        };
        let blocks = blocks.iter().map(|block| block.to_vec()).collect();
        Some(View { angle, blocks })
    }
}

impl<const A: usize> ArrayView for Looker<A> {
    fn view(&self, ssb: &ReceivedSsb<'_>) -> Option<View> {
        let elements = ssb.elements.first_chunk::<A>()?.each_ref();
        let gains = self.gains(ssb.noise_variance);
        let despread = Despread::new(elements, ssb.known, Pilots::Ssb, 0.0).scaled(&gains);
        let blocks: Vec<[Complex64; A]> = despread.blocks().collect();
        let told = line_of_sight(&despread, self.finder.as_ref()).map(|told| [told.block]);
        self.seen(told.as_ref().map_or(&blocks[..], |block| block), &blocks)
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
