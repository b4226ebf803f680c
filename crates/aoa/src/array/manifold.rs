//! Array manifold: the response of an array as a function of direction.

use std::f64::consts::PI;

use num_complex::Complex64;

/// Direction in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Azimuth in rad from the x axis, counter-clockwise seen from above.
    pub azimuth_rad: f64,
    /// Elevation in rad from the horizontal plane, positive upwards; -pi/2 to pi/2.
    pub elevation_rad: f64,
}

impl Direction {
    /// Creates a direction from azimuth and elevation in rad.
    pub const fn new(azimuth_rad: f64, elevation_rad: f64) -> Self {
        Self {
            azimuth_rad,
            elevation_rad,
        }
    }

    /// Returns the unit vector towards the direction.
    pub fn unit_vector(&self) -> [f64; 3] {
        let (sin, cos) = self.elevation_rad.sin_cos();
        [
            cos * self.azimuth_rad.cos(),
            cos * self.azimuth_rad.sin(),
            sin,
        ]
    }

    /// Returns the unit vectors of increasing azimuth and increasing elevation.
    fn tangents(&self) -> [[f64; 3]; 2] {
        let (sin_az, cos_az) = self.azimuth_rad.sin_cos();
        let (sin_el, cos_el) = self.elevation_rad.sin_cos();
        [
            [-sin_az, cos_az, 0.0],
            [-cos_az * sin_el, -sin_az * sin_el, cos_el],
        ]
    }

    /// Returns the direction displaced by `step[0]` rad along increasing azimuth (on the great
    /// circle) and `step[1]` rad along increasing elevation. The displacement is also defined at
    /// the zenith, unlike a change of azimuth and elevation.
    pub(crate) fn moved(&self, step: [f64; 2]) -> Self {
        let (forward, tangents) = (self.unit_vector(), self.tangents());
        let [x, y, z]: [f64; 3] = std::array::from_fn(|i| {
            forward[i] + step[0] * tangents[0][i] + step[1] * tangents[1][i]
        });
        Self::new(y.atan2(x), z.atan2(x.hypot(y)))
    }

    /// Inverts [`Direction::moved`] for nearby directions: returns the displacements along azimuth
    /// and elevation, whose norm is the angle between the directions.
    pub(crate) fn step_to(&self, other: &Self) -> [f64; 2] {
        let (forward, tangents, there) = (self.unit_vector(), self.tangents(), other.unit_vector());
        let dot = |a: [f64; 3]| a.iter().zip(there).map(|(a, b)| a * b).sum::<f64>();
        let [x, y] = tangents.map(dot);
        let sine = x.hypot(y);
        let angle = sine.atan2(dot(forward));
        if sine > 0.0 {
            [x * angle / sine, y * angle / sine]
        } else {
            // The other direction is equal or opposite.
            [angle, 0.0]
        }
    }
}

/// Response of an array of `N` antennas as a function of direction.
///
/// A [`DirectionFinder`](crate::DirectionFinder) accepts any manifold: a geometry
/// ([`ArbitraryArray`](crate::ArbitraryArray)), a measured table
/// ([`MeasuredManifold`](crate::MeasuredManifold)) or a custom model. For uniform linear arrays,
/// [`Array`](crate::Array) is much faster.
pub trait Manifold<const N: usize> {
    /// Returns the response to a plane wave of unit amplitude: one complex value per antenna,
    /// continuous in the direction. A common factor of all antennas is arbitrary.
    fn response(&self, direction: Direction) -> [Complex64; N];

    /// Returns the angle in rad over which the response of no antenna changes by more than about 1
    /// rad.
    fn resolution_rad(&self) -> f64;
}

/// Response of a manifold and its derivatives at a direction.
pub(crate) struct Neighbourhood<const N: usize> {
    pub(crate) response: [Complex64; N],
    /// Power of the response, `a^H a`.
    pub(crate) power: f64,
    /// Derivatives of the response with respect to azimuth (on the great circle) and elevation.
    pub(crate) tangents: [[Complex64; N]; 2],
    /// `Re(D^H P D)`, where `P` projects onto the complement of the response. This part of the
    /// derivatives is not a change of amplitude and phase, and contains the information on the
    /// direction.
    pub(crate) metric: [[f64; 2]; 2],
}

impl<const N: usize> Neighbourhood<N> {
    pub(crate) fn of<M: Manifold<N> + ?Sized>(manifold: &M, direction: Direction) -> Self {
        // Step of the central differences. Truncation error (third derivative times STEP^2 / 6) and
        // rounding error (eps / STEP) are about equal for arrays of a few wavelengths.
        const STEP: f64 = 1e-5;
        let response = manifold.response(direction);
        let tangents = [[STEP, 0.0], [0.0, STEP]].map(|step| {
            let ahead = manifold.response(direction.moved(step));
            let behind = manifold.response(direction.moved(step.map(|it| -it)));
            std::array::from_fn(|n| (ahead[n] - behind[n]) / (2.0 * STEP))
        });
        let power = dot(&response, &response).re;
        let along = [0, 1].map(|i: usize| dot(&response, &tangents[i]));
        let metric = [0, 1].map(|i: usize| {
            [0, 1].map(|j: usize| {
                (dot(&tangents[i], &tangents[j]) - along[i].conj() * along[j] / power).re
            })
        });
        Self {
            response,
            power,
            tangents,
            metric,
        }
    }
}

/// Returns `a^H b`.
pub(crate) fn dot<const N: usize>(a: &[Complex64; N], b: &[Complex64; N]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

/// Returns directions about `spacing_rad` apart between two elevations. No direction is at the
/// limits, where the response of a symmetric array may be stationary in elevation.
pub(crate) fn evenly_spread([lowest, highest]: [f64; 2], spacing_rad: f64) -> Vec<Direction> {
    let rings = ((highest - lowest) / spacing_rad).ceil().max(1.0) as usize;
    let mut directions = Vec::new();
    for ring in 0..rings {
        let elevation_rad = lowest + (highest - lowest) * (ring as f64 + 0.5) / rings as f64;
        let around = 2.0 * PI * elevation_rad.cos() / spacing_rad;
        let count = (around.ceil() as usize).max(1);
        directions.extend((0..count).map(|i| {
            let azimuth_rad = 2.0 * PI * i as f64 / count as f64 - PI;
            Direction::new(azimuth_rad, elevation_rad)
        }));
    }
    directions
}
