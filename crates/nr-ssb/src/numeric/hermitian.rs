//! Small Hermitian positive definite systems, by Cholesky factorisation.

use num_complex::Complex64;

pub(crate) type Matrix<const N: usize> = [[Complex64; N]; N];

/// Returns the lower Cholesky factor with an inverted diagonal; `None` unless positive definite.
pub(crate) fn cholesky<const N: usize>(matrix: &Matrix<N>) -> Option<Matrix<N>> {
    let mut factor = [[Complex64::ZERO; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let mut sum = matrix[i][j];
            for m in 0..j {
                sum -= factor[i][m] * factor[j][m].conj();
            }
            if i != j {
                factor[i][j] = sum * factor[j][j].re;
            } else if sum.re > 0.0 {
                factor[i][i] = Complex64::new(1.0 / sum.re.sqrt(), 0.0);
            } else {
                return None;
            }
        }
    }
    Some(factor)
}

/// Solves `L Lᴴ x = b` for a factor of [`cholesky`].
pub(crate) fn solve<const N: usize>(factor: &Matrix<N>, right: &[Complex64; N]) -> [Complex64; N] {
    let mut x = *right;
    for i in 0..N {
        let mut sum = x[i];
        for j in 0..i {
            sum -= factor[i][j] * x[j];
        }
        x[i] = sum * factor[i][i].re;
    }
    for i in (0..N).rev() {
        let mut sum = x[i];
        for j in i + 1..N {
            sum -= factor[j][i].conj() * x[j];
        }
        x[i] = sum * factor[i][i].re;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_with_a_known_solution_is_solved() {
        let root: Matrix<3> = std::array::from_fn(|i| {
            std::array::from_fn(|j| Complex64::new(1.0 + (i * j) as f64, i as f64 - 2.0 * j as f64))
        });
        let matrix: Matrix<3> = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let unit = if i == j {
                    Complex64::ONE
                } else {
                    Complex64::ZERO
                };
                unit + (0..3)
                    .map(|m| root[i][m] * root[j][m].conj())
                    .sum::<Complex64>()
            })
        });
        let truth = [
            Complex64::new(1.0, 2.0),
            Complex64::new(-0.5, 0.0),
            Complex64::I,
        ];
        let right = matrix.map(|row| row.iter().zip(&truth).map(|(a, x)| a * x).sum());
        let solution = solve(&cholesky(&matrix).unwrap(), &right);
        for (x, expected) in solution.iter().zip(&truth) {
            assert!((x - expected).norm() < 1e-12);
        }
        let mut indefinite = matrix;
        indefinite[1][1] = -Complex64::ONE;
        assert!(cholesky(&indefinite).is_none());
    }
}
