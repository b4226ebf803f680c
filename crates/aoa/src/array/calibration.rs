//! Gain and phase of the receive channels.

use num_complex::Complex64;

use crate::error::Error;

/// Calibration: one complex gain per channel. Estimators divide the signal of channel `n` by gain
/// `n`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration<const N: usize> {
    gains: [Complex64; N],
}

impl<const N: usize> Calibration<N> {
    /// Ideal channels.
    pub const IDENTITY: Self = Self {
        gains: [Complex64::ONE; N],
    };

    /// Creates a calibration from the channel gains.
    ///
    /// # Errors
    /// [`Error::CalibrationGain`] if a gain is zero or not finite.
    pub fn new(gains: [Complex64; N]) -> Result<Self, Error> {
        match gains.iter().position(|gain| !gain.norm_sqr().is_normal()) {
            Some(channel) => Err(Error::CalibrationGain(channel)),
            None => Ok(Self { gains }),
        }
    }

    /// Returns the gains, one per channel.
    pub const fn gains(&self) -> &[Complex64; N] {
        &self.gains
    }

    /// Returns the factor of each channel that removes its gain.
    pub(crate) fn inverse_gains(&self) -> [Complex64; N] {
        self.gains.map(|gain| gain.inv())
    }

    /// Returns the snapshot that ideal channels would have received.
    pub fn apply(&self, snapshot: &[Complex64; N]) -> [Complex64; N] {
        std::array::from_fn(|n| snapshot[n] / self.gains[n])
    }
}

impl<const N: usize> Default for Calibration<N> {
    fn default() -> Self {
        Self::IDENTITY
    }
}
