//! Array manifold, and the angle that an array measures.

use std::fmt::Debug;

use aoa::{ArbitraryArray, Complex64, Direction, DirectionFinder, Manifold, MeasuredManifold};

use crate::geometry::wrap_angle;
use crate::settings::ArrayShape;

/// Manifold of a non-linear array. Azimuths are relative to the array axis.
#[derive(Debug, Clone)]
pub enum ArrayManifold<const N: usize> {
    /// Given by the positions of the antennas.
    Places(ArbitraryArray<N>),
    /// Given by a table of responses.
    Measured(MeasuredManifold<N>),
}

impl<const N: usize> ArrayManifold<N> {
    /// Returns the manifold of an array shape (`spacing_wavelengths` applies to a circle); `None`
    /// for a uniform linear array, which has faster algorithms.
    ///
    /// # Errors
    /// [`aoa::Error`] if the positions or the table do not form an array.
    pub fn new(shape: &ArrayShape, spacing_wavelengths: f64) -> Result<Option<Self>, aoa::Error> {
        let place = |[forward, left]: [f64; 2]| [forward, left, 0.0];
        Ok(Some(match shape {
            ArrayShape::UniformLinear {} => return Ok(None),
            ArrayShape::Circular {} => {
                // The distance between neighbours is a chord of the circle.
                let half_turn = std::f64::consts::PI / N as f64;
                let radius = 0.5 * spacing_wavelengths / half_turn.sin();
                Self::Places(ArbitraryArray::circular(radius)?)
            }
            ArrayShape::Planar { places_wavelengths } => {
                let places = <[[f64; 2]; N]>::try_from(places_wavelengths.as_slice());
                let places = places.map_err(|_| aoa::Error::ElementPlace(N))?;
                Self::Places(ArbitraryArray::new(places.map(place))?)
            }
            ArrayShape::Measured(table) => {
                let complex = |[re, im]: [f64; 2]| Complex64::new(re, im);
                let responses = table.responses.iter().map(|response| {
                    let response = <[[f64; 2]; N]>::try_from(response.as_slice()).ok()?;
                    Some(response.map(complex))
                });
                let responses: Option<Vec<_>> = responses.collect();
                let wrong = aoa::Error::ManifoldTable("one value per antenna in each response");
                let responses = responses.ok_or(wrong)?;
                let azimuths = responses.len() / table.elevations_rad.len().max(1);
                let elevations_rad = &table.elevations_rad;
                Self::Measured(MeasuredManifold::new(azimuths, elevations_rad, responses)?)
            }
        }))
    }

    /// Returns the direction finder for elevations from the horizon upwards: a planar array cannot
    /// separate directions above and below its plane.
    ///
    /// # Errors
    /// No error for a valid manifold.
    pub fn finder(self) -> Result<DirectionFinder<Self, N>, aoa::Error> {
        DirectionFinder::new(self, [0.0, std::f64::consts::FRAC_PI_2])
    }

    /// Returns `|aᴴu|²/aᴴa` for the received vector `u` and the steering vector `a` that maximises
    /// it.
    pub fn strongest_beam(finder: &DirectionFinder<Self, N>, received: &[Complex64; N]) -> f64 {
        let found = finder.estimate_pilots(&[*received], Some(1.0));
        found.map_or(0.0, |found| {
            let response = finder.manifold().response(found.direction);
            let power: f64 = response.iter().map(Complex64::norm_sqr).sum();
            let sum: Complex64 = (response.iter().zip(received))
                .map(|(response, gain)| response.conj() * gain)
                .sum();
            sum.norm_sqr() / power
        })
    }
}

impl<const N: usize> Manifold<N> for ArrayManifold<N> {
    fn response(&self, direction: Direction) -> [Complex64; N] {
        match self {
            Self::Places(array) => array.response(direction),
            Self::Measured(table) => table.response(direction),
        }
    }

    fn resolution_rad(&self) -> f64 {
        match self {
            Self::Places(array) => array.resolution_rad(),
            Self::Measured(table) => table.resolution_rad(),
        }
    }
}

/// Manifold for a number of antennas that is known at run time only.
pub trait AnyManifold: Debug + Send + Sync {
    /// Adds the received wave from the direction `towards` to `gains`. `towards` is the horizontal
    /// part, along the array axis and to its left, of the unit vector to the source, which is not
    /// below the horizon.
    fn add(&self, wave: Complex64, towards: [f64; 2], gains: &mut [Complex64]);

    /// Returns the positions of the antennas, if they determine the manifold.
    fn places_wavelengths(&self) -> Option<Vec<[f64; 2]>>;
}

impl<const N: usize> AnyManifold for ArrayManifold<N> {
    fn add(&self, wave: Complex64, [along, left]: [f64; 2], gains: &mut [Complex64]) {
        let elevation_rad = along.hypot(left).min(1.0).acos();
        let direction = Direction::new(left.atan2(along), elevation_rad);
        for (gain, response) in gains.iter_mut().zip(self.response(direction)) {
            *gain += wave * response;
        }
    }

    fn places_wavelengths(&self) -> Option<Vec<[f64; 2]>> {
        let Self::Places(array) = self else {
            return None;
        };
        let places = array.places_wavelengths().iter();
        Some(places.map(|[x, y, _]| [*x, *y]).collect())
    }
}

/// Angle that an array measures, and its sensitivity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measurand {
    /// Electrical angle ω = 2π(d/λ) cos θ between neighbouring antennas of a uniform linear array.
    ElectricalAngle {
        /// Number of antennas N.
        elements: u8,
        /// Distance between neighbouring antennas in wavelengths, `d/λ`.
        spacing_wavelengths: f64,
    },
    /// Azimuth, counter-clockwise from the array axis, with an unknown elevation.
    Azimuth {
        /// Number of antennas N.
        elements: u8,
        /// `S = Σ (2π)² (p − p̄)(p − p̄)ᵀ` of the antenna positions `p` in wavelengths, along the
        /// array axis and to its left.
        moments: [[f64; 2]; 2],
    },
}

impl Measurand {
    /// Returns the azimuth measured by a non-linear array. Its sensitivity at the horizon is
    /// represented by the mean over all azimuths and the second harmonic, which is exact for a
    /// manifold given by positions.
    pub fn azimuth<const N: usize>(manifold: &ArrayManifold<N>) -> Self {
        Self::Azimuth {
            elements: N as u8,
            moments: moments(manifold),
        }
    }

    /// Returns the number of antennas.
    pub const fn elements(&self) -> u8 {
        match self {
            Self::ElectricalAngle { elements, .. } | Self::Azimuth { elements, .. } => *elements,
        }
    }

    /// Returns the measured value for an azimuth and a cosine of the elevation (`level`).
    pub fn value_rad(&self, azimuth_rad: f64, level: f64) -> f64 {
        match self {
            Self::ElectricalAngle {
                spacing_wavelengths,
                ..
            } => std::f64::consts::TAU * spacing_wavelengths * level * azimuth_rad.cos(),
            Self::Azimuth { .. } => wrap_angle(azimuth_rad),
        }
    }

    /// Returns the angle from the array axis: in 0..=π for a uniform linear array, which is
    /// ambiguous between left and right; in −π..=π, counter-clockwise, otherwise.
    pub fn angle_rad(&self, value_rad: f64) -> f64 {
        match self {
            Self::ElectricalAngle {
                spacing_wavelengths,
                ..
            } => {
                let cosine = value_rad / (std::f64::consts::TAU * spacing_wavelengths);
                cosine.clamp(-1.0, 1.0).acos()
            }
            Self::Azimuth { .. } => wrap_angle(value_rad),
        }
    }

    /// Returns the aperture factor `A` of the Cramér–Rao bound `1/(2ρA)` of the measured value, for
    /// one snapshot of SNR ρ.
    ///
    /// For a uniform linear array it is `N(N² − 1)/12`. For a planar array, let `u` point to the
    /// source and `t` be perpendicular to it. The derivatives by azimuth and elevation are
    /// `cos ε (p·t)` and `−sin ε (p·u)`. The information about the azimuth with an unknown
    /// elevation is `cos² ε (tᵀSt − (tᵀSu)²/uᵀSu) = cos² ε det S / uᵀSu`.
    pub fn aperture(&self, azimuth_rad: f64, level: f64) -> f64 {
        match self {
            Self::ElectricalAngle { elements, .. } => row_aperture(*elements),
            Self::Azimuth { moments, .. } => {
                let [[a, b], [_, c]] = moments;
                let (y, x) = azimuth_rad.sin_cos();
                level * level * (a * c - b * b) / (a * x * x + 2.0 * b * x * y + c * y * y)
            }
        }
    }

    /// Returns the mean aperture factor over all azimuths at the horizon; for a planar array the
    /// harmonic mean. The mean of `uᵀSu` is half the trace.
    pub fn mean_aperture(&self) -> f64 {
        match self {
            Self::ElectricalAngle { elements, .. } => row_aperture(*elements),
            Self::Azimuth { moments, .. } => {
                let [[a, b], [_, c]] = moments;
                2.0 * (a * c - b * b) / (a + c)
            }
        }
    }

    /// Returns the variance (rad²) of the maximum-likelihood estimate under scatter of a Rician K
    /// (power ratio) with aperture factor `A`, to second order in 1/K.
    ///
    /// The maximum of `|Σ (1 + ε_n) e^{−jωm}|²` over ω, for scatter `ε_n` of variance 1/K and
    /// antenna positions `m` relative to their centre, expanded to third order in ε, has the
    /// variance `(1 + (1 + κ) / (2 N K))` times the bound, with `κ = N Σm⁴/(Σm²)²`. For a uniform
    /// linear array `κ = (9 N² − 21) / (5 (N² − 1))`, which is 1.64 for four antennas. For a circle
    /// it is 3/2, and the curvature of the responses over the azimuth adds another half (simulation
    /// of `1 + κ` with 400,000 estimates, five antennas, K = 20: 2.87 ± 0.12).
    pub fn scatter_variance(&self, rician_k: f64, aperture: f64) -> f64 {
        let n = f64::from(self.elements());
        let kurtosis = match self {
            Self::ElectricalAngle { .. } => (9.0 * n * n - 21.0) / (5.0 * (n * n - 1.0)),
            Self::Azimuth { .. } => 2.0,
        };
        scatter_bound(rician_k, aperture) * (1.0 + (1.0 + kurtosis) / (2.0 * n * rician_k))
    }

    /// Returns the probability that scatter of a Rician K (power ratio) makes a wrong lobe the
    /// maximum, so that the angle is arbitrary. One of N orthogonal beams contains the signal, with
    /// a power `N K` relative to the scatter in each beam (noncoherent orthogonal signalling,
    /// Proakis and Salehi, Digital Communications, 4.5):
    /// `Σ (−1)^{n+1} C(N−1, n) e^{−n N K/(n+1)} / (n+1)` for n from 1 to N − 1. Lobes also exist
    /// between these beams, so that the result is accurate to a factor of two.
    pub fn wrong_lobe_probability(&self, rician_k: f64) -> f64 {
        let beams = f64::from(self.elements());
        let (mut sum, mut choices) = (0.0, -1.0);
        for n in 1..self.elements() {
            let n = f64::from(n);
            choices *= (n - beams) / n;
            sum += choices * (-n / (n + 1.0) * beams * rician_k).exp() / (n + 1.0);
        }
        sum
    }
}

/// Returns the minimum variance (rad²) of an angle from one snapshot under scatter of a Rician K
/// (power ratio), for any signal power: the Cramér–Rao bound at an SNR of K, `1/(2 K A)`. It is
/// `1/(10 K)` for a uniform linear array of four antennas.
pub fn scatter_bound(rician_k: f64, aperture: f64) -> f64 {
    0.5 / (rician_k * aperture)
}

fn row_aperture(elements: u8) -> f64 {
    let n = f64::from(elements);
    n * (n * n - 1.0) / 12.0
}

/// Returns `S` of a manifold. `tᵀSt` is the sensitivity `Re(dᴴPd)` in azimuth, scaled to unit
/// antenna gain.
fn moments<const N: usize>(manifold: &ArrayManifold<N>) -> [[f64; 2]; 2] {
    const AZIMUTHS: u32 = 360;
    /// SNR of the snapshot whose bound is computed: large enough to make noise negligible.
    const SNR: f64 = 1e9;
    let [mut mean, mut even, mut odd] = [0.0; 3];
    for number in 0..AZIMUTHS {
        let azimuth_rad = std::f64::consts::TAU * f64::from(number) / f64::from(AZIMUTHS);
        let direction = Direction::new(azimuth_rad, 0.0);
        let [[variance, _], _] = aoa::bound::azimuth_elevation(manifold, direction, SNR, 1);
        let sharpness = 0.5 / (SNR * variance);
        let (sin, cos) = (2.0 * azimuth_rad).sin_cos();
        mean += sharpness / f64::from(AZIMUTHS);
        even += 2.0 * sharpness * cos / f64::from(AZIMUTHS);
        odd += 2.0 * sharpness * sin / f64::from(AZIMUTHS);
    }
    // tᵀSt with t = (−sin, cos) is (a + c)/2 − (a − c)/2 cos 2α − b sin 2α.
    [[mean - even, -odd], [-odd, mean + even]]
}
