//! Transformations of a covariance before estimation: calibration, forward–backward averaging and
//! spatial smoothing.

use super::sample::Covariance;
use crate::array::linear::Array;
use crate::linalg::matrix::zeros;

impl<const N: usize> Covariance<N> {
    /// Returns the covariance that ideal channels would have measured: entry (i, j) divided by `g_i
    /// conj(g_j)`. [`estimate`](crate::estimate) applies this transformation itself.
    #[must_use]
    pub fn calibrated(&self, array: &Array<N>) -> Self {
        if array.is_ideal() {
            return *self;
        }
        let inverse = array.calibration().inverse_gains();
        let mut result = *self;
        for (i, row) in result.sum.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry *= inverse[i] * inverse[j].conj();
            }
        }
        result
    }

    /// Returns the forward–backward average `(R + J conj(R) J) / 2`, where `J` reverses the
    /// antennas. The average separates two coherent sources. Valid for ideal or
    /// [`calibrated`](Self::calibrated) channels only.
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

    /// Returns the average over the `N - M + 1` subarrays of `M` antennas, which decorrelates
    /// coherent sources (Shan, Wax and Kailath 1985). Estimate with [`Array::subarray`]. Valid for
    /// ideal or [`calibrated`](Self::calibrated) channels only.
    #[must_use]
    pub fn spatially_smoothed<const M: usize>(&self) -> Covariance<M> {
        const { assert!(M >= 2 && M <= N, "a subarray has 2 to N antennas") };
        self.over_subarrays()
    }

    /// Returns the spatially smoothed covariance without the compile-time check of `M <= N`.
    pub(crate) fn over_subarrays<const M: usize>(&self) -> Covariance<M> {
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
}
