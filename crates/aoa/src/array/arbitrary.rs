//! Arrays with arbitrary element positions: circular, planar or three-dimensional.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::calibration::Calibration;
use super::manifold::{Direction, Manifold};
use crate::error::Error;

/// Maximum distance of an element from the origin on each axis, in wavelengths.
const FARTHEST_WAVELENGTHS: f64 = 100.0;
/// Minimum distance of two elements in wavelengths; closer elements are rejected as coincident.
const NEAREST_WAVELENGTHS: f64 = 1e-3;

/// Array of ideal elements at arbitrary positions with complex channel gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArbitraryArray<const N: usize> {
    places_wavelengths: [[f64; 3]; N],
    calibration: Calibration<N>,
}

impl<const N: usize> ArbitraryArray<N> {
    /// Creates an array from the element positions (x, y, z) in wavelengths.
    ///
    /// # Errors
    /// [`Error::ElementPlace`] if a coordinate is not finite or exceeds 100 wavelengths;
    /// [`Error::CoincidentElements`]; [`Error::ElementsInARow`] for collinear elements, which
    /// measure only the angle from their line: use [`Array`](crate::Array).
    pub fn new(places_wavelengths: [[f64; 3]; N]) -> Result<Self, Error> {
        const { assert!(N >= 2 && N <= 16, "an array has two to sixteen antennas") };
        for (n, place) in places_wavelengths.iter().enumerate() {
            let near = place.iter().all(|it| it.abs() <= FARTHEST_WAVELENGTHS);
            if !near {
                return Err(Error::ElementPlace(n));
            }
        }
        let apart = |i: usize, j: usize| {
            let (a, b) = (&places_wavelengths[i], &places_wavelengths[j]);
            std::array::from_fn(|axis| b[axis] - a[axis])
        };
        for i in 0..N {
            for j in 0..i {
                if length(apart(i, j)) < NEAREST_WAVELENGTHS {
                    return Err(Error::CoincidentElements(j, i));
                }
            }
        }
        let off_the_line = |n| length(cross(apart(0, 1), apart(0, n))) / length(apart(0, 1));
        if !(2..N).any(|n| off_the_line(n) > NEAREST_WAVELENGTHS) {
            return Err(Error::ElementsInARow);
        }
        Ok(Self {
            places_wavelengths,
            calibration: Calibration::IDENTITY,
        })
    }

    /// Creates a horizontal circular array with element `n` at the azimuth `2 pi n / N`.
    ///
    /// # Errors
    /// See [`ArbitraryArray::new`].
    pub fn circular(radius_wavelengths: f64) -> Result<Self, Error> {
        Self::new(std::array::from_fn(|n| {
            let (sin, cos) = (TAU * n as f64 / N as f64).sin_cos();
            [radius_wavelengths * cos, radius_wavelengths * sin, 0.0]
        }))
    }

    /// Replaces the channel gains by measured ones.
    #[must_use]
    pub const fn with_calibration(mut self, calibration: Calibration<N>) -> Self {
        self.calibration = calibration;
        self
    }

    /// Returns the element positions in wavelengths.
    pub const fn places_wavelengths(&self) -> &[[f64; 3]; N] {
        &self.places_wavelengths
    }
}

impl<const N: usize> Manifold<N> for ArbitraryArray<N> {
    /// Returns `g_n exp(j 2 pi p_n . s)`, where `s` is the unit vector towards the source.
    fn response(&self, direction: Direction) -> [Complex64; N] {
        let [x, y, z] = direction.unit_vector();
        let gains = self.calibration.gains();
        std::array::from_fn(|n| {
            let place = &self.places_wavelengths[n];
            gains[n] * Complex64::cis(TAU * (place[0] * x + place[1] * y + place[2] * z))
        })
    }

    /// Returns the inverse of 2 pi times the largest distance from the centre.
    fn resolution_rad(&self) -> f64 {
        let centre: [f64; 3] = std::array::from_fn(|axis| {
            self.places_wavelengths
                .iter()
                .map(|it| it[axis])
                .sum::<f64>()
                / N as f64
        });
        let distances = self
            .places_wavelengths
            .iter()
            .map(|place| length(std::array::from_fn(|axis| place[axis] - centre[axis])));
        1.0 / (2.0 * PI * distances.fold(0.0, f64::max))
    }
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    x.hypot(y).hypot(z)
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
