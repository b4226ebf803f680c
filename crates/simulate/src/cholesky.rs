//! Roots of covariances.

use onboard::gaussian::Matrix;

/// Lower factor `L Lᵀ` of a positive semidefinite matrix, of which the lower triangle is read;
/// directions that have less than a rounding error of the variance `scale` get none.
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
