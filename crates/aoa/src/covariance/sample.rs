//! Sample covariance.

use num_complex::{Complex, Complex64};

use crate::error::Error;
use crate::kernel::real::Real;
use crate::linalg::eigen::hermitian_eigen;
use crate::linalg::matrix::{Matrix, zeros};

/// Sample covariance `R = sum_t w_t x_t x_t^H / sum_t w_t` of the antennas, with its number of
/// snapshots.
///
/// The mean is *not* removed: despread pilots give an equal vector in every snapshot, and this
/// vector is the signal.
///
/// Streaming use: [`Covariance::new`], [`accumulate`](Covariance::accumulate) per snapshot,
/// [`reset`](Covariance::reset).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Covariance<const N: usize> {
    pub(super) sum: Matrix<N>,
    pub(super) weight: f64,
    pub(super) snapshots: usize,
}

impl<const N: usize> Covariance<N> {
    /// Creates an empty covariance for accumulation.
    pub const fn new() -> Self {
        Self {
            sum: zeros(),
            weight: 0.0,
            snapshots: 0,
        }
    }

    /// Computes the sample covariance of snapshots with one value per antenna.
    ///
    /// # Errors
    /// [`Error::NoSnapshots`], [`Error::NotFinite`], [`Error::Zero`].
    pub fn from_snapshots(snapshots: &[[Complex64; N]]) -> Result<Self, Error> {
        let mut sum = zeros::<N>();
        for snapshot in snapshots {
            for i in 0..N {
                for j in 0..=i {
                    let product = snapshot[i] * snapshot[j].conj();
                    sum[i][j].re += product.re;
                    sum[i][j].im += product.im;
                }
            }
        }
        for i in 0..N {
            for j in 0..i {
                sum[j][i] = sum[i][j].conj();
            }
        }
        Self {
            sum,
            weight: snapshots.len() as f64,
            snapshots: snapshots.len(),
        }
        .validated()
    }

    /// Computes the sample covariance of channels: `channels[n]` contains the samples of antenna
    /// `n`. The shortest channel determines the number of snapshots.
    ///
    /// # Errors
    /// [`Error::NoSnapshots`], [`Error::NotFinite`], [`Error::Zero`].
    pub fn from_channels<T: Real>(channels: [&[Complex<T>]; N]) -> Result<Self, Error> {
        let snapshots = channels
            .iter()
            .map(|channel| channel.len())
            .min()
            .unwrap_or(0);
        let sum = T::products(&channels.map(|channel| &channel[..snapshots]));
        Self {
            sum,
            weight: snapshots as f64,
            snapshots,
        }
        .validated()
    }

    /// Creates a covariance from a matrix. The number of `snapshots` determines the standard
    /// deviations of the estimates.
    ///
    /// # Errors
    /// [`Error::NoSnapshots`], [`Error::NotFinite`], [`Error::Zero`], [`Error::NotHermitian`],
    /// [`Error::Indefinite`].
    pub fn from_matrix(matrix: Matrix<N>, snapshots: usize) -> Result<Self, Error> {
        if !matrix.iter().flatten().all(|entry| entry.is_finite()) {
            return Err(Error::NotFinite);
        }
        let covariance = Self {
            sum: matrix,
            weight: 1.0,
            snapshots,
        }
        .validated()?;
        let tolerance = 1e-9 * covariance.power();
        let hermitian = (0..N).all(|i| {
            matrix[i][i].re >= 0.0
                && (0..=i).all(|j| (matrix[i][j] - matrix[j][i].conj()).norm() <= tolerance)
        });
        if !hermitian {
            return Err(Error::NotHermitian);
        }
        let smallest = hermitian_eigen(matrix, N).values[N - 1];
        if smallest < -tolerance {
            return Err(Error::Indefinite);
        }
        Ok(covariance)
    }

    /// Adds one snapshot. Invalid values are reported at estimation.
    pub fn accumulate(&mut self, snapshot: &[Complex64; N], weight: f64) {
        for i in 0..N {
            for j in 0..=i {
                let product = snapshot[i] * snapshot[j].conj() * weight;
                self.sum[i][j] += product;
                if i != j {
                    self.sum[j][i] += product.conj();
                }
            }
        }
        self.weight += weight;
        self.snapshots += 1;
    }

    /// Clears the covariance.
    pub const fn reset(&mut self) {
        *self = Self::new();
    }

    /// Returns the number of snapshots.
    pub const fn snapshots(&self) -> usize {
        self.snapshots
    }

    /// Returns the normalised matrix `R`.
    pub fn matrix(&self) -> Matrix<N> {
        let scale = 1.0 / self.weight;
        self.sum.map(|row| row.map(|entry| entry * scale))
    }

    /// Returns the sum of the weighted snapshot products, without normalisation.
    pub(crate) const fn unscaled(&self) -> &Matrix<N> {
        &self.sum
    }

    /// Returns the sum of the weights, the normalisation of [`Self::unscaled`].
    pub(crate) const fn weight(&self) -> f64 {
        self.weight
    }

    /// Returns the mean power per antenna, `trace(R) / N`.
    pub fn power(&self) -> f64 {
        self.trace() / (self.weight * N as f64)
    }

    fn trace(&self) -> f64 {
        (0..N).map(|n| self.sum[n][n].re).sum()
    }

    /// Returns an error if the covariance is invalid for estimation.
    pub(crate) fn validated(self) -> Result<Self, Error> {
        if self.snapshots == 0 {
            return Err(Error::NoSnapshots);
        }
        // The largest entry of a covariance is on the diagonal.
        if !(self.weight.is_finite() && self.trace().is_finite()) {
            return Err(Error::NotFinite);
        }
        if self.weight <= 0.0 {
            return Err(Error::NotPositive {
                name: "weight",
                value: self.weight,
            });
        }
        if self.trace() <= 0.0 {
            return Err(Error::Zero);
        }
        Ok(self)
    }
}

impl<const N: usize> Default for Covariance<N> {
    fn default() -> Self {
        Self::new()
    }
}
