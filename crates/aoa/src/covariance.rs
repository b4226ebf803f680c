//! The sample covariance and its averages.

use num_complex::Complex;

use crate::kernel::Real;
use crate::spectrum::Spectrum;
use crate::{Array, Complex64, Error};

/// A Hermitian matrix, row-major.
pub type Matrix<const N: usize> = [[Complex64; N]; N];

pub(crate) const fn zeros<const N: usize>() -> Matrix<N> {
    [[Complex64::ZERO; N]; N]
}

/// Covariance `R = sum_t w_t x_t x_t^H / sum_t w_t` of the antennas, and how many snapshots it
/// stands for.
///
/// The mean is *not* removed: despread pilots are the same vector in every snapshot, and that vector
/// is the signal.
///
/// Streaming use: [`Covariance::new`], [`accumulate`](Covariance::accumulate) per snapshot,
/// [`reset`](Covariance::reset).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Covariance<const N: usize> {
    sum: Matrix<N>,
    weight: f64,
    snapshots: usize,
}

impl<const N: usize> Covariance<N> {
    /// An empty covariance, to be accumulated.
    pub const fn new() -> Self {
        Self {
            sum: zeros(),
            weight: 0.0,
            snapshots: 0,
        }
    }

    /// The sample covariance of snapshots, one value per antenna each.
    ///
    /// # Errors
    /// [`Error::NoSnapshots`], [`Error::NotFinite`], [`Error::Zero`].
    pub fn from_snapshots(snapshots: &[[Complex64; N]]) -> Result<Self, Error> {
        let mut covariance = Self::new();
        for snapshot in snapshots {
            covariance.accumulate(snapshot, 1.0);
        }
        covariance.validated()
    }

    /// The sample covariance of channels: `channels[n]` holds the samples of antenna `n`. Channels
    /// longer than the shortest are cut.
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

    /// A covariance known otherwise, standing for `snapshots` snapshots (which set the standard
    /// deviations of the estimates).
    ///
    /// # Errors
    /// [`Error::NoSnapshots`], [`Error::NotFinite`], [`Error::Zero`], [`Error::NotHermitian`].
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
        if hermitian {
            Ok(covariance)
        } else {
            Err(Error::NotHermitian)
        }
    }

    /// Adds one snapshot. Bad values are noticed when an estimate is asked for.
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

    /// Forgets everything accumulated.
    pub const fn reset(&mut self) {
        *self = Self::new();
    }

    /// How many snapshots this stands for.
    pub const fn snapshots(&self) -> usize {
        self.snapshots
    }

    /// The normalised matrix `R`.
    pub fn matrix(&self) -> Matrix<N> {
        let scale = 1.0 / self.weight;
        self.sum.map(|row| row.map(|entry| entry * scale))
    }

    /// The matrix up to a factor.
    pub(crate) const fn unscaled(&self) -> &Matrix<N> {
        &self.sum
    }

    /// `a^H R a`, up to the same factor.
    pub(crate) fn spectrum(&self) -> Spectrum<N> {
        Spectrum::of_matrix(&self.sum)
    }

    /// The sum of the weights, which is that factor.
    pub(crate) const fn weight(&self) -> f64 {
        self.weight
    }

    /// Mean power per antenna, `trace(R) / N`.
    pub fn power(&self) -> f64 {
        self.trace() / (self.weight * N as f64)
    }

    fn trace(&self) -> f64 {
        (0..N).map(|n| self.sum[n][n].re).sum()
    }

    /// The covariance that ideal channels would have measured: entry (i, j) divided by
    /// `g_i conj(g_j)`. [`estimate`](crate::estimate) does this by itself.
    #[must_use]
    pub fn calibrated(&self, array: &Array<N>) -> Self {
        if array.is_ideal() {
            return *self;
        }
        let inverse = array.calibration().gains().map(|gain| gain.inv());
        let mut result = *self;
        for (i, row) in result.sum.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry *= inverse[i] * inverse[j].conj();
            }
        }
        result
    }

    /// Forward–backward average `(R + J conj(R) J) / 2`, `J` reversing the antennas: two coherent
    /// sources become two. Only meaningful for ideal (or [`calibrated`](Self::calibrated)) channels.
    #[must_use]
    pub fn forward_backward(&self) -> Self {
        let mut result = *self;
        for i in 0..N {
            for j in 0..N {
                result.sum[i][j] = (self.sum[i][j] + self.sum[N - 1 - i][N - 1 - j].conj()) * 0.5;
            }
        }
        result
    }

    /// Average over the `N - M + 1` subarrays of `M` antennas: decorrelates coherent sources (Shan,
    /// Wax and Kailath 1985). Estimate with [`Array::subarray`]. Only meaningful for ideal (or
    /// [`calibrated`](Self::calibrated)) channels.
    #[must_use]
    pub fn spatially_smoothed<const M: usize>(&self) -> Covariance<M> {
        const { assert!(M >= 2 && M <= N, "a subarray has 2 to N antennas") };
        let mut sum = zeros::<M>();
        let scale = 1.0 / (N - M + 1) as f64;
        for first in 0..=N - M {
            for i in 0..M {
                for j in 0..M {
                    sum[i][j] += self.sum[first + i][first + j] * scale;
                }
            }
        }
        Covariance {
            sum,
            weight: self.weight,
            snapshots: self.snapshots,
        }
    }

    /// Fails unless the covariance is fit for estimation.
    pub(crate) fn validated(self) -> Result<Self, Error> {
        if self.snapshots == 0 {
            return Err(Error::NoSnapshots);
        }
        // No entry is larger than the largest on the diagonal.
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
