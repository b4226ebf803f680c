//! What the antennas make of a plane wave.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use onboard::manifold::AnyManifold;
use onboard::observation::MAX_ELEMENTS;
use onboard::settings::ArraySettings;

use crate::phasor::phasor;

/// The array's response to plane waves, whatever the number of its antennas.
#[derive(Debug, Clone)]
pub struct Antennas {
    elements: usize,
    shape: Shape,
}

#[derive(Debug, Clone)]
enum Shape {
    /// Phase in radians from antenna to antenna of a wave that comes along the axis.
    Row {
        element_rad: f64,
    },
    Other(Arc<dyn AnyManifold>),
}

impl Antennas {
    /// The antennas of a vehicle whose settings are checked.
    pub fn new(array: &ArraySettings) -> Self {
        let element_rad = TAU * array.spacing_wavelengths;
        Self {
            elements: array.elements.into(),
            shape: (array.any_manifold()).map_or(Shape::Row { element_rad }, Shape::Other),
        }
    }

    /// Number of antennas.
    pub const fn elements(&self) -> usize {
        self.elements
    }

    /// Adds a wave that comes from `towards`: the horizontal part, along the array's axis and to its
    /// left, of the unit vector to its source, which is not below the horizon.
    pub fn add(&self, mut wave: Complex64, towards: [f64; 2], gains: &mut [Complex64]) {
        match &self.shape {
            Shape::Row { element_rad } => {
                let step = phasor(element_rad * towards[0]);
                for gain in gains {
                    *gain += wave;
                    wave *= step;
                }
            }
            Shape::Other(manifold) => manifold.add(wave, towards, gains),
        }
    }

    /// Moves the source of what the antennas received.
    pub fn redirect(&self, from: [f64; 2], to: [f64; 2], gains: &mut [Complex64]) {
        let response = |towards| {
            let mut response = [Complex64::ZERO; MAX_ELEMENTS];
            let response_here = response.get_mut(..self.elements).unwrap_or_default();
            self.add(Complex64::ONE, towards, response_here);
            response
        };
        for (gain, (from, to)) in gains
            .iter_mut()
            .zip(response(from).iter().zip(response(to)))
        {
            // An antenna that is deaf to the one direction has nothing to be turned to the other.
            *gain *= to * from.conj() / from.norm_sqr().max(f64::MIN_POSITIVE);
        }
    }

    /// Lets what the antennas received of a source seem to come from `bias_rad` beside it: in the
    /// electrical angle of a row, in azimuth else.
    pub fn displace(&self, towards: [f64; 2], bias_rad: f64, gains: &mut [Complex64]) {
        if matches!(self.shape, Shape::Row { .. }) {
            return steer(gains, bias_rad);
        }
        let [along, left] = towards;
        let (sin, cos) = bias_rad.sin_cos();
        let beside = [along * cos - left * sin, along * sin + left * cos];
        self.redirect(towards, beside, gains);
    }
}

/// Turns a wave by `phase_rad` from antenna to antenna.
pub fn steer(gains: &mut [Complex64], phase_rad: f64) {
    if phase_rad == 0.0 {
        return;
    }
    let step = Complex64::cis(phase_rad);
    let mut turn = Complex64::ONE;
    for gain in gains {
        *gain *= turn;
        turn *= step;
    }
}
