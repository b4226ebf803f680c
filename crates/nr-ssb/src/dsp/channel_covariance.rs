//! Covariance of a channel estimate's noise over the subcarriers.

use num_complex::{Complex32, Complex64};

use super::timing;
use crate::numeric::hermitian::Matrix;
use crate::standard::grid::SUBCARRIERS;

/// Taps of the channel model, one per sample at the base rate.
pub(crate) const TAPS: usize = 16;

/// Delay of the first tap, in samples.
pub(crate) const FIRST_TAP: i32 = -4;

/// Covariance of a channel estimate's noise between subcarriers, for a noise variance of one on a
/// resource element. It is equal for all antennas, which have the same smoothing; the noise of
/// different antennas is independent.
///
/// The estimate is linear in the received elements for given tap powers. With `G` the Gram matrix
/// of the taps on the known elements and `D` the ratio of noise to tap power, the covariance of the
/// taps' noise is `(G + D)^-1 G (G + D)^-1`, of rank 16 at most over the 240 subcarriers. The
/// estimation of the tap powers from the same elements is neglected.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelCovariance {
    pub(super) taps: Matrix<TAPS>,
    /// Delay that was removed from the estimate, in samples.
    delay: f64,
}

impl ChannelCovariance {
    pub(super) const fn new(taps: &Matrix<TAPS>) -> Self {
        Self {
            taps: *taps,
            delay: 0.0,
        }
    }

    /// Returns the covariance of the estimate after the removal of a delay, in samples.
    #[must_use]
    pub(crate) fn delayed(mut self, delay: f64) -> Self {
        self.delay += delay;
        self
    }

    /// Returns the rows of the covariance, one per subcarrier.
    pub fn rows(&self) -> Vec<[Complex32; SUBCARRIERS]> {
        // Response of each tap on the subcarriers.
        let responses: [[Complex32; SUBCARRIERS]; TAPS] = std::array::from_fn(|tap| {
            let delay = f64::from(tap as i32 + FIRST_TAP);
            timing::ramp(self.delay - delay)
        });
        let row = |k: usize| {
            let mut row = [Complex32::ZERO; SUBCARRIERS];
            for (b, response) in responses.iter().enumerate() {
                let weight: Complex64 = (self.taps.iter().zip(&responses))
                    .map(|(taps, response)| taps[b] * widened(response[k]))
                    .sum();
                let weight = Complex32::new(weight.re as f32, weight.im as f32);
                for (slot, value) in row.iter_mut().zip(response) {
                    *slot += weight * value.conj();
                }
            }
            row
        };
        (0..SUBCARRIERS).map(row).collect()
    }
}

fn widened(value: Complex32) -> Complex64 {
    Complex64::new(f64::from(value.re), f64::from(value.im))
}
