//! Uniform linear array: geometry and channel gains.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::calibration::Calibration;
use super::steering::steering_vector;
use crate::error::Error;

/// Uniform linear array of `N` antennas.
///
/// Directions are angles `theta` from the array's axis, from 0 (end-fire, towards the last antenna)
/// to pi. The antennas measure the electrical angle, which is the phase difference between adjacent
/// antennas: `omega = 2 pi (d / lambda) cos(theta)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Array<const N: usize> {
    spacing_wavelengths: f64,
    calibration: Calibration<N>,
}

impl<const N: usize> Array<N> {
    /// Creates an ideal array with elements `spacing_wavelengths` apart.
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

    /// Creates the common array: ideal elements half a wavelength apart.
    pub const fn half_wavelength() -> Self {
        const { assert!(N >= 2 && N <= 16, "an array has two to sixteen antennas") };
        Self {
            spacing_wavelengths: 0.5,
            calibration: Calibration::IDENTITY,
        }
    }

    /// Replaces the channel gains by measured ones.
    #[must_use]
    pub const fn with_calibration(mut self, calibration: Calibration<N>) -> Self {
        self.calibration = calibration;
        self
    }

    /// Returns the distance between adjacent elements in wavelengths.
    pub const fn spacing_wavelengths(&self) -> f64 {
        self.spacing_wavelengths
    }

    /// Returns the channel gains, by which every estimator divides the samples.
    pub const fn calibration(&self) -> &Calibration<N> {
        &self.calibration
    }

    /// Whether all channel gains are one.
    pub(crate) fn is_ideal(&self) -> bool {
        self.calibration == Calibration::IDENTITY
    }

    /// Returns `2 pi d / lambda`, the electrical angle at end-fire, in rad.
    pub fn phase_at_end_fire_rad(&self) -> f64 {
        TAU * self.spacing_wavelengths
    }

    /// Returns the electrical angle `omega = 2 pi (d / lambda) cos(theta)` of a direction. The
    /// value is not wrapped: for a spacing above half a wavelength it may exceed pi.
    pub fn phase_from_angle(&self, angle_rad: f64) -> f64 {
        self.phase_at_end_fire_rad() * angle_rad.cos()
    }

    /// Returns the direction (0 to pi) of an electrical angle. Electrical angles without a
    /// direction (spacing below half a wavelength) give the nearer end-fire direction.
    pub fn angle_from_phase(&self, phase_rad: f64) -> f64 {
        (phase_rad / self.phase_at_end_fire_rad())
            .clamp(-1.0, 1.0)
            .acos()
    }

    /// Returns the response of ideal antennas to a unit source at the electrical angle `phase_rad`:
    /// `a_n = exp(j n omega)`. See [`Array::response`] for calibrated antennas.
    pub fn steering_vector(&self, phase_rad: f64) -> [Complex64; N] {
        steering_vector(phase_rad)
    }

    /// Returns the response of the array: the steering vector times the channel gains.
    pub fn response(&self, phase_rad: f64) -> [Complex64; N] {
        let mut response = steering_vector(phase_rad);
        for (sample, gain) in response.iter_mut().zip(self.calibration.gains()) {
            *sample *= gain;
        }
        response
    }

    /// Returns the first `M` antennas as an ideal array, for a covariance that was calibrated and
    /// [spatially smoothed](crate::Covariance::spatially_smoothed).
    ///
    /// # Errors
    /// No error for a valid array; the signature matches [`Array::new`].
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
