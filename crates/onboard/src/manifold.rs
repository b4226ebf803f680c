//! What the array receives from every direction, and what is measured with it.

use std::fmt::Debug;

use aoa::{ArbitraryArray, Complex64, Direction, DirectionFinder, Manifold, MeasuredManifold};

use crate::geometry::wrap_angle;
use crate::settings::ArrayShape;

/// An array of antennas that are not in a row. The azimuth of its directions is from the array's
/// axis.
#[derive(Debug, Clone)]
pub enum ArrayManifold<const N: usize> {
    /// By the places of the antennas.
    Places(ArbitraryArray<N>),
    /// By a table of responses.
    Measured(MeasuredManifold<N>),
}

impl<const N: usize> ArrayManifold<N> {
    /// The manifold of antennas that stand so, on a circle with this spacing; `None` of a row, which
    /// has a faster way.
    ///
    /// # Errors
    /// [`aoa::Error`] for places or a table that make no array.
    pub fn new(shape: &ArrayShape, spacing_wavelengths: f64) -> Result<Option<Self>, aoa::Error> {
        let place = |[forward, left]: [f64; 2]| [forward, left, 0.0];
        Ok(Some(match shape {
            ArrayShape::UniformLinear {} => return Ok(None),
            ArrayShape::Circular {} => {
                // Neighbours are a chord apart.
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

    /// Looks from the horizon upwards: antennas in a plane do not tell above from below.
    ///
    /// # Errors
    /// None for a valid manifold.
    pub fn finder(self) -> Result<DirectionFinder<Self, N>, aoa::Error> {
        DirectionFinder::new(self, [0.0, std::f64::consts::FRAC_PI_2])
    }

    /// `|aᴴu|²/aᴴa` of what the antennas receive, `u`, in the strongest direction `a`.
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

/// A manifold of a number of antennas that is not known before a file is read.
pub trait AnyManifold: Debug + Send + Sync {
    /// Adds what the antennas receive of a wave from `towards`: the horizontal part, along the
    /// array's axis and to its left, of the unit vector to its source, which is not below the horizon.
    fn add(&self, wave: Complex64, towards: [f64; 2], gains: &mut [Complex64]);

    /// Where the antennas are, as far as that is all there is to it.
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

/// What is measured of a wave's direction, and how sharply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measurand {
    /// The electrical angle ω = 2π(d/λ) cos θ between neighbours in a row.
    ElectricalAngle {
        /// Number of antennas N.
        elements: u8,
        /// Distance between neighbours in wavelengths, `d/λ`.
        spacing_wavelengths: f64,
    },
    /// The azimuth from the array's axis, counter-clockwise, the elevation being estimated along.
    Azimuth {
        /// Number of antennas N.
        elements: u8,
        /// `S = Σ (2π)² (p − p̄)(p − p̄)ᵀ` of the antennas' places `p` in wavelengths, along the axis
        /// and to its left.
        moments: [[f64; 2]; 2],
    },
}

impl Measurand {
    /// That of antennas that are not in a row, by their sharpness at the horizon: its mean over all
    /// azimuths and its second harmonic, which of places are all there is.
    pub fn azimuth<const N: usize>(manifold: &ArrayManifold<N>) -> Self {
        Self::Azimuth {
            elements: N as u8,
            moments: moments(manifold),
        }
    }

    /// Number of antennas.
    pub const fn elements(&self) -> u8 {
        match self {
            Self::ElectricalAngle { elements, .. } | Self::Azimuth { elements, .. } => *elements,
        }
    }

    /// The value from this azimuth, at an elevation of this cosine.
    pub fn value_rad(&self, azimuth_rad: f64, level: f64) -> f64 {
        match self {
            Self::ElectricalAngle {
                spacing_wavelengths,
                ..
            } => std::f64::consts::TAU * spacing_wavelengths * level * azimuth_rad.cos(),
            Self::Azimuth { .. } => wrap_angle(azimuth_rad),
        }
    }

    /// Its angle from the array's axis: 0..=π in a row, which does not tell left from right;
    /// counter-clockwise in −π..=π else.
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

    /// What a look of SNR ρ tells, over 2ρ: `A` of the Cramér–Rao bound `1/(2ρA)` of the value.
    ///
    /// In a row it is `N(N² − 1)/12`. In a plane, with `u` towards the source and `t` across, the
    /// derivatives by azimuth and elevation are `cos ε (p·t)` and `−sin ε (p·u)`, and what is left
    /// for the azimuth beside an unknown elevation is
    /// `cos² ε (tᵀSt − (tᵀSu)²/uᵀSu) = cos² ε det S / uᵀSu`.
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

    /// Its mean over all azimuths at the horizon, harmonic in a plane: of `uᵀSu` the mean is half the trace.
    pub fn mean_aperture(&self) -> f64 {
        match self {
            Self::ElectricalAngle { elements, .. } => row_aperture(*elements),
            Self::Azimuth { moments, .. } => {
                let [[a, b], [_, c]] = moments;
                2.0 * (a * c - b * b) / (a + c)
            }
        }
    }

    /// Variance (rad²) that the best estimate has for scatter of the given Rician K (power ratio) and
    /// an aperture `A`, to the second order in 1/K.
    ///
    /// The maximum of `|Σ (1 + ε_n) e^{−jωm}|²` over ω, for scatter `ε_n` of variance 1/K and the
    /// antennas' places `m` from their middle, expanded to the third order in ε, has the variance
    /// `(1 + (1 + κ) / (2 N K))` times the bound, with `κ = N Σm⁴/(Σm²)²`, which is
    /// `(9 N² − 21) / (5 (N² − 1))` in a row: 1.64 for four antennas. Around a circle it is 3/2, and
    /// the bend of the responses over the azimuth adds another half to it (by simulation: of
    /// `1 + κ`, 400,000 estimates with five antennas at K = 20 find 2.87 ± 0.12).
    pub fn scatter_variance(&self, rician_k: f64, aperture: f64) -> f64 {
        let n = f64::from(self.elements());
        let kurtosis = match self {
            Self::ElectricalAngle { .. } => (9.0 * n * n - 21.0) / (5.0 * (n * n - 1.0)),
            Self::Azimuth { .. } => 2.0,
        };
        scatter_bound(rician_k, aperture) * (1.0 + (1.0 + kurtosis) / (2.0 * n * rician_k))
    }

    /// Probability that scatter of the given Rician K (power ratio) makes another lobe the highest, so
    /// that the angle is any: of N beams at right angles one has the signal, `N K` above the scatter
    /// in each (noncoherent orthogonal signalling, Proakis and Salehi, Digital Communications, 4.5):
    /// `Σ (−1)^{n+1} C(N−1, n) e^{−n N K/(n+1)} / (n+1)` over n from 1 to N − 1. Lobes lie between
    /// these beams too: right to a factor of two.
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

/// Least variance (rad²) of the angle that scatter of the given Rician K (power ratio) leaves in one
/// look, however strong the signal: the Cramér–Rao bound of one snapshot at an SNR of K, `1/(2 K A)`,
/// which is `1/(10 K)` for four antennas in a row.
pub fn scatter_bound(rician_k: f64, aperture: f64) -> f64 {
    0.5 / (rician_k * aperture)
}

fn row_aperture(elements: u8) -> f64 {
    let n = f64::from(elements);
    n * (n * n - 1.0) / 12.0
}

/// `S` of a manifold: `tᵀSt` is its sharpness `Re(dᴴPd)` in azimuth, scaled to antennas of unit gain.
fn moments<const N: usize>(manifold: &ArrayManifold<N>) -> [[f64; 2]; 2] {
    const AZIMUTHS: u32 = 360;
    /// Of the one snapshot whose bound is taken: so large that noise does not weigh in.
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
