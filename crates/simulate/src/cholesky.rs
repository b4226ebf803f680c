//! Cholesky factor of a covariance.

use onboard::gaussian::Matrix;

/// Returns the lower factor `L` with `L Lᵀ` equal to a positive semidefinite matrix. Only the lower
/// triangle is read. Directions with less variance than the rounding error of `scale` get a zero
/// column.
pub(crate) fn cholesky<const N: usize>(matrix: &Matrix<N>, scale: &Matrix<N>) -> Matrix<N> {
    let mut factor = [[0.0; N]; N];
    for j in 0..N {
        let own = matrix[j][j] - (0..j).map(|k| factor[j][k] * factor[j][k]).sum::<f64>();
        if own <= 1e-12 * scale[j][j] {
            continue;
        }
        factor[j][j] = own.sqrt();
        for i in j + 1..N {
            let shared = (0..j).map(|k| factor[i][k] * factor[j][k]).sum::<f64>();
            factor[i][j] = (matrix[i][j] - shared) / factor[j][j];
        }
    }
    factor
}
