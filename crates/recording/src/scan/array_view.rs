//! The angle of one SSB, for arrays of any number of antennas that the crates know.

use aoa::{
    AngleEstimate, Array, Calibration, DirectionEstimate, DirectionFinder,
    maximum_likelihood_pilots,
};
use nr_ssb::search::ReceivedSsb;
use num_complex::Complex64;

use onboard::for_elements;
use onboard::manifold::ArrayManifold;
use onboard::observation::MAX_ELEMENTS;
use onboard::receive::despread::Despread;
use onboard::receive::wideband::line_of_sight;
use onboard::settings::{ArrayShape, Pilots};

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
pub(super) struct View {
    pub angle: FoundAngle,
    /// One snapshot per OFDM symbol, noise power one.
    pub blocks: Vec<Vec<Complex64>>,
}

/// Angles of SSBs that a search has found.
pub(super) trait ArrayView: Send + Sync {
    /// Looks at an SSB, all of whose known elements are pilots.
    fn view(&self, ssb: &ReceivedSsb<'_>) -> Option<View>;
}

/// The view of an array of so many antennas; `None` for a single one.
///
/// # Errors
/// [`aoa::Error`] for an impossible spacing or gain; [`aoa::Error::CalibrationGain`] of the first
/// missing channel where the calibration is too short.
pub(super) fn array_view(
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
}

impl<const A: usize> ArrayView for Looker<A> {
    fn view(&self, ssb: &ReceivedSsb<'_>) -> Option<View> {
        let elements = ssb.elements.first_chunk::<A>()?.each_ref();
        let noise = ssb.noise_variance.iter().sum::<f64>() / A as f64;
        let scale = noise.max(f64::MIN_POSITIVE).sqrt().recip();
        let gains = self.calibration.gains().map(|gain| scale / gain);
        let despread = Despread::new(elements, ssb.known, Pilots::Ssb, 0.0).scaled(&gains);
        let blocks: Vec<[Complex64; A]> = despread.blocks().collect();
        let finder = self.finder.as_ref();
        let told = line_of_sight(&despread, finder).map(|told| [told.block]);
        let looked_at = told.as_ref().map_or(&blocks[..], |block| block);
        let angle = if let Some(finder) = finder {
            FoundAngle::Direction(finder.estimate_pilots(looked_at, Some(1.0)).ok()?)
        } else {
            let found = maximum_likelihood_pilots(looked_at, Some(1.0), &self.array);
            FoundAngle::FromRow(found.ok()?)
        };
        let blocks = blocks.iter().map(|block| block.to_vec()).collect();
        Some(View { angle, blocks })
    }
}
