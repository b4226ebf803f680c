//! Square matrices of fixed size.

use num_complex::Complex64;

/// Hermitian matrix, row-major.
pub type Matrix<const N: usize> = [[Complex64; N]; N];

pub(crate) const fn zeros<const N: usize>() -> Matrix<N> {
    [[Complex64::ZERO; N]; N]
}
