//! Transformations of a covariance before estimation: calibration, forward–backward averaging and
//! spatial smoothing.

use num_complex::Complex64;

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
        let size = [N, M];
        average_of_subarrays(self.sum.as_flattened(), sum.as_flattened_mut(), size);
        Covariance {
            sum,
            weight: self.weight,
            snapshots: self.snapshots,
        }
    }
}

/// Writes the average over the blocks of `m` rows and columns on the diagonal of an `n` by `n`
/// matrix to `average`, which is zero.
fn average_of_subarrays(matrix: &[Complex64], average: &mut [Complex64], [n, m]: [usize; 2]) {
    let scale = 1.0 / (n - m + 1) as f64;
    for first in 0..=n - m {
        for (i, row) in average.chunks_exact_mut(m).enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry += matrix[(first + i) * n + first + j] * scale;
            }
        }
    }
}
