//! Portable kernels.

use num_complex::{Complex, Complex64};

use crate::linalg::matrix::{Matrix, zeros};

/// Returns the length of the shortest channel.
#[inline]
pub(super) fn shortest<T, const N: usize>(channels: &[&[T]; N]) -> usize {
    let mut length = usize::MAX;
    for channel in channels {
        length = length.min(channel.len());
    }
    length
}

/// Returns `sum_t x_t conj(y_t)`.
pub(super) fn correlation<T: Copy + Into<f64>>(x: &[Complex<T>], y: &[Complex<T>]) -> Complex64 {
    let wide = |z: &Complex<T>| Complex64::new(z.re.into(), z.im.into());
    let (mut even, mut odd) = (Complex64::ZERO, Complex64::ZERO);
    for (x, y) in x.chunks(2).zip(y.chunks(2)) {
        even += wide(&x[0]) * wide(&y[0]).conj();
        if let ([_, x], [_, y]) = (x, y) {
            odd += wide(x) * wide(y).conj();
        }
    }
    even + odd
}

pub(super) fn products<T: Copy + Into<f64>, const N: usize>(
    channels: &[&[Complex<T>]; N],
) -> Matrix<N> {
    let mut matrix = zeros::<N>();
    add_products(channels, 0, &mut matrix);
    for i in 0..N {
        for j in 0..i {
            matrix[j][i] = matrix[i][j].conj();
        }
    }
    matrix
}

/// Adds the products of the samples from `start` to the lower triangle.
pub(super) fn add_products<T: Copy + Into<f64>, const N: usize>(
    channels: &[&[Complex<T>]; N],
    start: usize,
    matrix: &mut Matrix<N>,
) {
    for i in 0..N {
        for j in 0..=i {
            matrix[i][j] += correlation(&channels[i][start..], &channels[j][start..]);
        }
    }
}
