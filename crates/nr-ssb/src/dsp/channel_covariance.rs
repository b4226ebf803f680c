//! How the noise of a channel estimate hangs together from subcarrier to subcarrier.

use num_complex::{Complex32, Complex64};

use super::timing;
use crate::numeric::hermitian::Matrix;
use crate::standard::grid::SUBCARRIERS;

/// Taps of the channel model, one per sample at the base rate.
pub(crate) const TAPS: usize = 16;

/// Delay of the first tap, samples.
pub(crate) const FIRST_TAP: i32 = -4;

/// Covariance of the noise of a channel estimate between its subcarriers, where the noise on a resource element has
/// the variance one. It is the same on every antenna, as all are smoothed alike, and between antennas there is none.
///
/// The estimate is linear in what was received once the powers of the taps are chosen: with `G` the taps' Gram matrix on
/// the known elements and `D` noise over power, the noise of the taps is `(G + D)^-1 G (G + D)^-1`, of rank 16 at most
/// over the 240 subcarriers. That the powers are learned from the same elements is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelCovariance {
    pub(super) taps: Matrix<TAPS>,
    /// What was taken out of the estimate since, samples.
    delay: f64,
}

impl ChannelCovariance {
    pub(super) const fn new(taps: &Matrix<TAPS>) -> Self {
        Self {
            taps: *taps,
            delay: 0.0,
        }
    }

    /// That of the estimate with a delay taken out of it, in samples.
    #[must_use]
    pub(crate) fn delayed(mut self, delay: f64) -> Self {
        self.delay += delay;
        self
    }

    /// Its rows, one per subcarrier.
    pub fn rows(&self) -> Vec<[Complex32; SUBCARRIERS]> {
        // What each tap is on the subcarriers.
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
