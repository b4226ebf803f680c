//! Small dense complex linear algebra on the leading `n` by `n` block of a matrix of fixed
//! capacity.

use num_complex::Complex64;

use super::matrix::{Matrix, zeros};

/// Returns `a b` of the leading blocks: `rows` by `inner` times `inner` by `columns`.
pub(crate) fn product<const N: usize>(
    a: &Matrix<N>,
    b: &Matrix<N>,
    [rows, inner, columns]: [usize; 3],
) -> Matrix<N> {
    let mut c = zeros::<N>();
    for i in 0..rows {
        for k in 0..inner {
            for j in 0..columns {
                c[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    c
}

/// Returns the conjugate transpose of the whole matrix.
pub(crate) fn adjoint<const N: usize>(a: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i].conj()))
}

/// Returns the inverse by Gauss–Jordan elimination with partial pivoting; `None` for a numerically
/// singular matrix.
pub(crate) fn inverse<const N: usize>(mut a: Matrix<N>, n: usize) -> Option<Matrix<N>> {
    let mut b = zeros::<N>();
    for (i, row) in b.iter_mut().enumerate() {
        row[i] = Complex64::ONE;
    }
    let scale = a[..n]
        .iter()
        .flat_map(|row| &row[..n])
        .map(Complex64::norm_sqr)
        .fold(0.0, f64::max);
    for column in 0..n {
        let pivot = (column..n)
            .max_by(|&i, &j| a[i][column].norm_sqr().total_cmp(&a[j][column].norm_sqr()))?;
        let size = a[pivot][column].norm_sqr();
        let regular = size > scale * f64::EPSILON * f64::EPSILON;
        if !regular {
            return None;
        }
        a.swap(column, pivot);
        b.swap(column, pivot);
        let factor = a[column][column].inv();
        for j in 0..n {
            a[column][j] *= factor;
            b[column][j] *= factor;
        }
        for i in (0..n).filter(|&i| i != column) {
            let factor = a[i][column];
            for j in 0..n {
                let (x, y) = (a[column][j], b[column][j]);
                a[i][j] -= factor * x;
                b[i][j] -= factor * y;
            }
        }
    }
    Some(b)
}
