//! Response of the antennas to plane waves.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::Complex64;
use onboard::manifold::AnyManifold;
use onboard::observation::MAX_ELEMENTS;
use onboard::settings::ArraySettings;

use crate::phasor::phasor;

/// Response of an array with any number of antennas.
#[derive(Debug, Clone)]
pub struct Antennas {
    elements: usize,
    shape: Shape,
}

#[derive(Debug, Clone)]
enum Shape {
    /// Linear array: phase difference in radians of adjacent antennas for a wave along the axis.
    Row {
        element_rad: f64,
    },
    Other(Arc<dyn AnyManifold>),
}

impl Antennas {
    /// Creates the antennas of a vehicle with valid settings.
    pub fn new(array: &ArraySettings) -> Self {
        let element_rad = TAU * array.spacing_wavelengths;
        Self {
            elements: array.elements.into(),
            shape: (array.any_manifold()).map_or(Shape::Row { element_rad }, Shape::Other),
        }
    }

    /// Returns the number of antennas.
    pub const fn elements(&self) -> usize {
        self.elements
    }

    /// Adds the response to a wave from the direction `towards`: the components along the array's
    /// axis and to its left of the unit vector to the source. The source is at or above the
    /// horizon.
    pub fn add(&self, mut wave: Complex64, towards: [f64; 2], gains: &mut [Complex64]) {
        match &self.shape {
            Shape::Row { element_rad } => {
                let step = phasor(element_rad * towards[0]);
                for gain in gains {
                    // Assignment operators of complex numbers are not inlined.
                    let (sum, next) = (*gain + wave, wave * step);
                    (*gain, wave) = (sum, next);
                }
            }
            Shape::Other(manifold) => manifold.add(wave, towards, gains),
        }
    }

    /// Changes the direction of the source of the received signals.
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
            // An antenna without a response in the old direction remains without a signal.
            *gain *= to * from.conj() / from.norm_sqr().max(f64::MIN_POSITIVE);
        }
    }

    /// Adds the error `bias_rad` to the apparent direction of a source: to the electrical angle of
    /// a linear array, otherwise to the azimuth.
    pub fn displace(&self, towards: [f64; 2], bias_rad: f64, gains: &mut [Complex64]) {
        if matches!(self.shape, Shape::Row { .. }) {
            return steer(gains, bias_rad);
        }
        let [along, left] = towards;
        let (sin, cos) = bias_rad.sin_cos();
        let displaced = [along * cos - left * sin, along * sin + left * cos];
        self.redirect(towards, displaced, gains);
    }
}

/// Rotates the phase of each antenna by `phase_rad` relative to the previous antenna.
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
