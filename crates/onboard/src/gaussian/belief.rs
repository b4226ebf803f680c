//! Gaussian distribution of fixed size: mean and covariance with linearised prediction and scalar
//! measurement updates. No allocation, no general linear algebra.

use std::f64::consts::TAU;

/// Number of standard deviations that random errors rarely exceed: 0.27 % for a Gaussian.
pub const CERTAIN_SIGMAS: f64 = 3.0;

/// Square matrix in row-major order.
pub type Matrix<const N: usize> = [[f64; N]; N];

/// Returns the variances of a covariance `[[xx, xy], [xy, yy]]` along its principal axes, larger
/// first.
pub fn principal_variances(xx: f64, xy: f64, yy: f64) -> [f64; 2] {
    let half = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
    let mean = 0.5 * (xx + yy);
    [mean + half, (mean - half).max(0.0)]
}

/// Returns the identity matrix.
pub fn identity<const N: usize>() -> Matrix<N> {
    let mut matrix = [[0.0; N]; N];
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    matrix
}

/// Returns the inner product.
pub fn dot<const N: usize>(left: &[f64; N], right: &[f64; N]) -> f64 {
    left.iter()
        .zip(right)
        .map(|(left, right)| left * right)
        .sum()
}

/// Returns the product of rows with a matrix. Zeros on the left are skipped: most elements of a Jacobian of motion.
pub fn product<const M: usize, const N: usize>(
    left: &[[f64; N]; M],
    right: &Matrix<N>,
) -> [[f64; N]; M] {
    let mut product = [[0.0; N]; M];
    for i in 0..M {
        for k in 0..N {
            let factor = left[i][k];
            if factor != 0.0 {
                for j in 0..N {
                    product[i][j] += factor * right[k][j];
                }
            }
        }
    }
    product
}

/// Returns a covariance in other coordinates, `J P Jᵀ`. The bound of the rounding errors of each
/// row is added to its diagonal, so that the result is positive definite (Gershgorin) even if `P`
/// is singular.
pub fn transformed<const N: usize>(jacobian: &Matrix<N>, covariance: &Matrix<N>) -> Matrix<N> {
    let mut made = [[0.0; N]; N];
    for i in 0..N {
        for j in i..N {
            let (mut sum, mut magnitude) = (0.0, 0.0);
            for k in 0..N {
                for l in 0..N {
                    let term = jacobian[i][k] * covariance[k][l] * jacobian[j][l];
                    sum += term;
                    magnitude += f64::abs(term);
                }
            }
            // Rounding error of N² terms with two products each.
            let rounding = (N * N + 2) as f64 * f64::EPSILON * magnitude;
            made[i][j] += sum;
            made[i][i] += rounding;
            if i != j {
                made[j][i] = made[i][j];
                made[j][j] += rounding;
            }
        }
    }
    made
}

/// Mean and covariance of `N` states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian<const N: usize> {
    /// Expected state.
    pub mean: [f64; N],
    /// Covariance, symmetric and positive semidefinite. A disabled state has a row and column of
    /// zeros, and no update changes it.
    pub covariance: Matrix<N>,
}

/// Innovation of a scalar measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Residual: measured minus predicted value.
    pub residual: f64,
    /// Variance of the innovation, `H P Hᵀ + R`.
    pub variance: f64,
    /// Variance of the measurement, `R`.
    pub measurement_variance: f64,
}

impl Innovation {
    /// Returns the squared Mahalanobis distance; χ² distributed with one degree of freedom if the
    /// model is correct.
    pub fn mahalanobis2(&self) -> f64 {
        self.residual * self.residual / self.variance
    }

    /// Returns the probability density of the residual, in the inverse of its unit.
    pub fn density(&self) -> f64 {
        (-0.5 * self.mahalanobis2()).exp() / (TAU * self.variance).sqrt()
    }
}

/// Returns the density (1/rad) of an angle that has the given density or, with probability
/// `outliers`, is uniformly distributed.
pub fn with_outliers(density: f64, outliers: f64) -> f64 {
    outliers / TAU + (1.0 - outliers) * density
}

impl<const N: usize> Gaussian<N> {
    /// Creates a Gaussian with independent states.
    pub fn independent(mean: [f64; N], sigma: [f64; N]) -> Self {
        let mut covariance = [[0.0; N]; N];
        for i in 0..N {
            covariance[i][i] = sigma[i] * sigma[i];
        }
        Self { mean, covariance }
    }

    /// Predicts the covariance with a linearised motion, `P ← F P Fᵀ + Q`. The caller predicts the
    /// mean with the non-linear motion.
    pub fn spread(&mut self, jacobian: &Matrix<N>, noise: &Matrix<N>) {
        // `(F P)ᵀ`: Jacobians of motion are almost the identity, so that most products are skipped.
        let mut left = [[0.0; N]; N];
        for i in 0..N {
            let mut row = [0.0; N];
            for k in 0..N {
                let f = jacobian[i][k];
                if f != 0.0 {
                    for j in 0..N {
                        row[j] += f * self.covariance[k][j];
                    }
                }
            }
            for j in 0..N {
                left[j][i] = row[j];
            }
        }
        for j in 0..N {
            let mut column = [0.0; N];
            for i in 0..N {
                column[i] = noise[i][j];
            }
            for k in 0..N {
                let f = jacobian[j][k];
                if f != 0.0 {
                    for i in 0..N {
                        column[i] += left[k][i] * f;
                    }
                }
            }
            for i in 0..=j {
                self.covariance[i][j] = column[i];
                self.covariance[j][i] = column[i];
            }
        }
    }

    /// Returns the covariance of the first `M` states after a linearised motion, equal to that of [`spread`](Self::spread).
    pub fn spread_first<const M: usize>(
        &self,
        jacobian: &Matrix<N>,
        noise: &Matrix<N>,
    ) -> Matrix<M> {
        let first: [[f64; N]; M] = std::array::from_fn(|i| jacobian[i]);
        let rows = product(&first, &self.covariance);
        let mut covariance = [[0.0; M]; M];
        for j in 0..M {
            for i in 0..=j {
                let mut sum = noise[i][j];
                for k in 0..N {
                    let f = jacobian[j][k];
                    if f != 0.0 {
                        sum += rows[i][k] * f;
                    }
                }
                covariance[i][j] = sum;
                covariance[j][i] = sum;
            }
        }
        covariance
    }

    /// Returns `P Hᵀ` for one measurement row.
    pub fn cross(&self, row: &[f64; N]) -> [f64; N] {
        let mut cross = [0.0; N];
        for i in 0..N {
            for j in 0..N {
                cross[i] += self.covariance[i][j] * row[j];
            }
        }
        cross
    }

    /// Returns the variance of `H x`.
    pub fn variance_along(&self, row: &[f64; N]) -> f64 {
        dot(row, &self.cross(row)).max(0.0)
    }

    /// Returns the innovation of a measurement without an update.
    pub fn innovation(&self, residual: f64, row: &[f64; N], variance: f64) -> Innovation {
        Innovation {
            residual,
            variance: self.variance_along(row) + variance,
            measurement_variance: variance,
        }
    }

    /// Updates mean and covariance with one scalar measurement. The covariance has the Joseph form
    /// `(I − K H) P (I − K H)ᵀ + K R Kᵀ`, computed in one pass. Returns the gain K.
    pub fn update(&mut self, residual: f64, row: &[f64; N], variance: f64) -> [f64; N] {
        let cross = self.cross(row);
        let total = (0..N).map(|i| row[i] * cross[i]).sum::<f64>().max(0.0) + variance;
        if total <= 0.0 {
            return [0.0; N]; // both the belief and the measurement are exact: nothing to learn
        }
        let mut gain = cross;
        for g in &mut gain {
            *g /= total;
        }
        for i in 0..N {
            self.mean[i] += gain[i] * residual;
        }
        for i in 0..N {
            for j in i..N {
                let p = self.covariance[i][j] - gain[i] * cross[j] - cross[i] * gain[j]
                    + gain[i] * gain[j] * total;
                self.covariance[i][j] = p;
                self.covariance[j][i] = p;
            }
        }
        gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn correlated() -> Gaussian<3> {
        Gaussian {
            mean: [1.0, -2.0, 0.5],
            covariance: [[2.0, 0.3, -0.1], [0.3, 1.0, 0.2], [-0.1, 0.2, 0.5]],
        }
    }

    #[test]
    fn update_equals_the_information_form() {
        let mut belief = correlated();
        let row = [1.0, 2.0, -1.0];
        let (residual, variance) = (0.7, 0.4);
        let prior = belief;
        belief.update(residual, &row, variance);
        // P⁺ (P⁻¹ + Hᵀ R⁻¹ H) = I, tested as P⁺ + P⁺ Hᵀ R⁻¹ H P⁻ = P⁻.
        let after = belief.cross(&row);
        let before = prior.cross(&row);
        for i in 0..3 {
            for j in 0..3 {
                let sum = belief.covariance[i][j] + after[i] * before[j] / variance;
                assert!((sum - prior.covariance[i][j]).abs() < 1e-12);
            }
            let step = after[i] / variance * residual;
            assert!((belief.mean[i] - prior.mean[i] - step).abs() < 1e-12);
        }
    }

    #[test]
    fn a_singular_covariance_stays_semidefinite_after_a_change_of_coordinates() {
        // Heading and path direction cancel, so that the third variance is zero except for rounding
        // errors.
        for curvature in [0.3, -0.07, 1e-3, 12.7] {
            let (cos, sin) = (0.3_f64.cos(), 0.3_f64.sin());
            let jacobian = [[cos, -sin, 0.0], [sin, cos, 0.0], [curvature, 0.0, 1.0]];
            let along = 0.7_f64;
            let cross = -along * curvature;
            let inner = [
                [along, 0.0, cross],
                [0.0, 0.01, 0.0],
                [cross, 0.0, -cross * curvature],
            ];
            let [[xx, xy, xh], [_, yy, yh], [hx, hy, hh]] = transformed(&jacobian, &inner);
            let rounding = 64.0 * f64::EPSILON * along * (1.0 + curvature * curvature);
            assert!(hh > 0.0 && hh < rounding, "{hh}");
            assert!((xh, yh) == (hx, hy));
            let minor = xx * yy - xy * xy;
            let whole =
                xx * (yy * hh - yh * hy) - xy * (xy * hh - yh * hx) + xh * (xy * hy - yy * hx);
            assert!(minor > 0.0 && whole > 0.0, "{minor} {whole}");
        }
    }

    #[test]
    fn a_disabled_state_remains_disabled() {
        let mut belief = Gaussian::independent([0.0, 3.0], [1.0, 0.0]);
        belief.update(5.0, &[1.0, 1.0], 0.1);
        assert_eq!(belief.mean[1], 3.0);
        assert_eq!(belief.covariance[1], [0.0, 0.0]);
    }

    #[test]
    fn spread_equals_the_matrix_product() {
        let mut belief = correlated();
        let f = [[1.0, 0.5, 0.0], [0.0, 1.0, -0.3], [0.0, 0.0, 0.9]];
        let q = [[0.1, 0.0, 0.0], [0.0, 0.2, 0.05], [0.0, 0.05, 0.3]];
        let p = belief.covariance;
        let [[xx, xy], [yx, yy]] = belief.spread_first::<2>(&f, &q);
        belief.spread(&f, &q);
        let [[s_xx, s_xy, _], [s_yx, s_yy, _], _] = belief.covariance;
        assert_eq!([xx, xy, yx, yy], [s_xx, s_xy, s_yx, s_yy]);
        for i in 0..3 {
            for j in 0..3 {
                let mut sum = q[i][j];
                for k in 0..3 {
                    for l in 0..3 {
                        sum += f[i][k] * p[k][l] * f[j][l];
                    }
                }
                assert!((belief.covariance[i][j] - sum).abs() < 1e-12);
            }
        }
    }
}
