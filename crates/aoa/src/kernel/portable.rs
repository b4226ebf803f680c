//! Kernels for any processor.

use num_complex::{Complex, Complex64};

use crate::linalg::matrix::{Matrix, zeros};
use crate::spectrum::side_by_side::Spectra;

/// `sum_t x_t conj(y_t)`.
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
    for i in 0..N {
        for j in 0..=i {
            matrix[i][j] = correlation(channels[i], channels[j]);
            matrix[j][i] = matrix[i][j].conj();
        }
    }
    matrix
}

/// Adds to each lag what the samples from `start` on contribute.
pub(super) fn add_lags<T: Copy + Into<f64>, const N: usize>(
    rows: &[&[Complex<T>]; N],
    start: usize,
    lags: &mut [Complex64; N],
) {
    for i in 0..N {
        for j in 0..=i {
            lags[i - j] += correlation(&rows[i][start..], &rows[j][start..]);
        }
    }
}

pub(super) fn spectra<T: Copy + Into<f64>, const N: usize, const W: usize>(
    samples: &[Complex<T>],
    snapshots: usize,
    spectra: &mut Spectra<N, W>,
) {
    for (w, item) in samples.chunks_exact(N * snapshots).take(W).enumerate() {
        let rows = std::array::from_fn(|n| &item[n * snapshots..(n + 1) * snapshots]);
        let mut lags = [Complex64::ZERO; N];
        add_lags(&rows, 0, &mut lags);
        for (k, lag) in lags.iter().enumerate() {
            spectra.re[k][w] = lag.re;
            spectra.im[k][w] = lag.im;
        }
    }
}
