//! The uniform linear array: geometry and the gains of its channels.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::calibration::Calibration;
use super::steering::steering_vector;
use crate::error::Error;

/// A uniform linear array of `N` antennas.
///
/// Directions are angles `theta` from the array's axis, 0 (end-fire, towards the last antenna) to pi.
/// What the antennas see is the electrical angle, the phase step from one antenna to the next:
/// `omega = 2 pi (d / lambda) cos(theta)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Array<const N: usize> {
    spacing_wavelengths: f64,
    calibration: Calibration<N>,
}

impl<const N: usize> Array<N> {
    /// An ideal array with its elements `spacing_wavelengths` apart.
    ///
    /// # Errors
    /// [`Error::Spacing`] unless the spacing is 0.01 to 100 wavelengths.
    pub fn new(spacing_wavelengths: f64) -> Result<Self, Error> {
        const { assert!(N >= 2 && N <= 16, "an array has two to sixteen antennas") };
        if !(0.01..=100.0).contains(&spacing_wavelengths) {
            return Err(Error::Spacing(spacing_wavelengths));
        }
        Ok(Self {
            spacing_wavelengths,
            calibration: Calibration::IDENTITY,
        })
    }

    /// The customary array: ideal elements half a wavelength apart.
    pub const fn half_wavelength() -> Self {
        const { assert!(N >= 2 && N <= 16, "an array has two to sixteen antennas") };
        Self {
            spacing_wavelengths: 0.5,
            calibration: Calibration::IDENTITY,
        }
    }

    /// The same geometry with measured channel gains.
    #[must_use]
    pub const fn with_calibration(mut self, calibration: Calibration<N>) -> Self {
        self.calibration = calibration;
        self
    }

    /// Distance between neighbouring elements, in wavelengths.
    pub const fn spacing_wavelengths(&self) -> f64 {
        self.spacing_wavelengths
    }

    /// The channels' gains, by which every estimator divides first.
    pub const fn calibration(&self) -> &Calibration<N> {
        &self.calibration
    }

    /// Whether no channel needs correction.
    pub(crate) fn is_ideal(&self) -> bool {
        self.calibration == Calibration::IDENTITY
    }

    /// `2 pi d / lambda`: the electrical angle at end-fire, in rad.
    pub fn phase_at_end_fire_rad(&self) -> f64 {
        TAU * self.spacing_wavelengths
    }

    /// Electrical angle `omega = 2 pi (d / lambda) cos(theta)` of a direction. Not wrapped: beyond
    /// half a wavelength of spacing it exceeds pi.
    pub fn phase_from_angle(&self, angle_rad: f64) -> f64 {
        self.phase_at_end_fire_rad() * angle_rad.cos()
    }

    /// The direction (0 to pi) that has this electrical angle; electrical angles that no direction
    /// has (spacing below half a wavelength) give the nearer end-fire.
    pub fn angle_from_phase(&self, phase_rad: f64) -> f64 {
        (phase_rad / self.phase_at_end_fire_rad())
            .clamp(-1.0, 1.0)
            .acos()
    }

    /// What ideal antennas receive from a unit source with electrical angle `phase_rad`:
    /// `a_n = exp(j n omega)`. See [`Array::response`] for the real ones.
    pub fn steering_vector(&self, phase_rad: f64) -> [Complex64; N] {
        steering_vector(phase_rad)
    }

    /// What these antennas receive: the steering vector times the channels' gains.
    pub fn response(&self, phase_rad: f64) -> [Complex64; N] {
        let mut response = steering_vector(phase_rad);
        for (sample, gain) in response.iter_mut().zip(self.calibration.gains()) {
            *sample *= gain;
        }
        response
    }

    /// The first `M` antennas as an ideal array, for use with a covariance that has been calibrated
    /// and [spatially smoothed](crate::Covariance::spatially_smoothed).
    ///
    /// # Errors
    /// None for a valid array; the signature follows [`Array::new`].
    pub fn subarray<const M: usize>(&self) -> Result<Array<M>, Error> {
        const {
            assert!(
                M <= N,
                "a subarray has at most as many antennas as the array"
            );
        };
        Array::new(self.spacing_wavelengths)
    }
}

impl<const N: usize> Default for Array<N> {
    fn default() -> Self {
        Self::half_wavelength()
    }
}
