//! Hermitian matrices side by side.
//!
//! The products of one small matrix are too few for vector registers, so `W` matrices go through every
//! step together, and the compiler makes vectors of the innermost loops. What becomes of one matrix
//! does not depend on its neighbours.

use num_complex::Complex64;

use super::eigen::hermitian_eigen;
use super::matrix::Matrix;
use crate::simd::math::times_plus;

/// `W` vectors of `N` elements.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vectors<const N: usize, const W: usize> {
    pub(crate) re: [[f64; W]; N],
    pub(crate) im: [[f64; W]; N],
}

/// `W` Hermitian matrices, their lower triangles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hermitians<const N: usize, const W: usize> {
    re: [[[f64; W]; N]; N],
    im: [[[f64; W]; N]; N],
}

impl<const N: usize, const W: usize> Hermitians<N, W> {
    pub(crate) const ZERO: Self = Self {
        re: [[[0.0; W]; N]; N],
        im: [[[0.0; W]; N]; N],
    };

    #[inline(always)]
    pub(crate) fn set(&mut self, w: usize, matrix: &Matrix<N>) {
        for i in 0..N {
            for j in 0..=i {
                (self.re[i][j][w], self.im[i][j][w]) = (matrix[i][j].re, matrix[i][j].im);
            }
        }
    }

    fn get(&self, w: usize) -> Matrix<N> {
        let entry = |i: usize, j: usize| {
            let (re, im, sign) = self.entries(i, j);
            Complex64::new(re[w], sign * im[w])
        };
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }

    /// Entry (i, j) of every matrix: real parts, imaginary parts, and the sign of the latter.
    #[inline(always)]
    pub(crate) fn entries(&self, i: usize, j: usize) -> (&[f64; W], &[f64; W], f64) {
        if j <= i {
            (&self.re[i][j], &self.im[i][j], 1.0)
        } else {
            (&self.re[j][i], &self.im[j][i], -1.0)
        }
    }

    /// Row and column `n` of every matrix times `factors[n]` and its conjugate.
    #[inline(always)]
    pub(crate) fn scaled(mut self, factors: &[Complex64; N]) -> Self {
        for i in 0..N {
            for j in 0..=i {
                let factor = factors[i] * factors[j].conj();
                for w in 0..W {
                    let (re, im) = (self.re[i][j][w], self.im[i][j][w]);
                    self.re[i][j][w] = re * factor.re - im * factor.im;
                    self.im[i][j][w] = re * factor.im + im * factor.re;
                }
            }
        }
        self
    }

    /// `(R + J conj(R) J) / 2`, `J` reversing the order.
    #[inline(always)]
    pub(crate) fn forward_backward(&self) -> Self {
        let mut average = *self;
        for i in 0..N {
            for j in 0..=i {
                let (k, l) = (N - 1 - j, N - 1 - i);
                for w in 0..W {
                    average.re[i][j][w] = 0.5 * (self.re[i][j][w] + self.re[k][l][w]);
                    average.im[i][j][w] = 0.5 * (self.im[i][j][w] + self.im[k][l][w]);
                }
            }
        }
        average
    }

    #[inline(always)]
    fn traces(&self) -> [f64; W] {
        let mut traces = [0.0; W];
        for n in 0..N {
            for w in 0..W {
                traces[w] += self.re[n][n][w];
            }
        }
        traces
    }

    /// `A A = A A^H`: entry (i, j) is the product of rows i and j.
    #[inline(always)]
    fn squared<const FUSED: bool>(&self) -> Self {
        let mut full = *self;
        for i in 0..N {
            for j in 0..i {
                full.re[j][i] = self.re[i][j];
                for w in 0..W {
                    full.im[j][i][w] = -self.im[i][j][w];
                }
            }
        }
        let mut square = Self::ZERO;
        for i in 0..N {
            for j in 0..=i {
                let (mut re, mut im) = ([0.0; W], [0.0; W]);
                for k in 0..N {
                    for w in 0..W {
                        let (a, b) = (full.re[i][k][w], full.im[i][k][w]);
                        let (c, d) = (full.re[j][k][w], full.im[j][k][w]);
                        re[w] = times_plus::<FUSED>(a, c, times_plus::<FUSED>(b, d, re[w]));
                        if i != j {
                            im[w] = times_plus::<FUSED>(b, c, times_plus::<FUSED>(-a, d, im[w]));
                        }
                    }
                }
                (square.re[i][j], square.im[i][j]) = (re, im);
            }
        }
        square
    }

    /// Times `scales[w]` the matrices of `other`, but where `keep[w]` is not zero.
    #[inline(always)]
    fn replace(&mut self, other: &Self, scales: &[f64; W], keep: &[f64; W]) {
        for i in 0..N {
            for j in 0..=i {
                for w in 0..W {
                    let (re, im) = (&mut self.re[i][j][w], &mut self.im[i][j][w]);
                    *re = if keep[w] == 0.0 {
                        other.re[i][j][w] * scales[w]
                    } else {
                        *re
                    };
                    *im = if keep[w] == 0.0 {
                        other.im[i][j][w] * scales[w]
                    } else {
                        *im
                    };
                }
            }
        }
    }

    /// The eigenvectors (unit norm) of the largest eigenvalues of positive semidefinite matrices.
    ///
    /// Squaring a matrix squares the ratios of its eigenvalues; after a few squarings only the largest
    /// is left. Where the two largest are nearly equal that takes too many, and Jacobi's method takes
    /// over. A matrix that is zero has no such vector, and gets zeros.
    #[inline(always)]
    pub(crate) fn principal_eigenvectors<const FUSED: bool>(&self) -> Vectors<N, W> {
        const SQUARINGS: usize = 9;
        // A matrix of unit trace whose square has the trace 1 - x has a share of x / 2 outside its
        // largest eigenvalue, and its square one of x^2 / 4, which is the error of the vector.
        const REMAINDER: f64 = 1e-5;
        let traces = self.traces();
        let (mut scales, mut done) = ([0.0; W], [0.0; W]);
        for w in 0..W {
            scales[w] = if traces[w] > 0.0 {
                1.0 / traces[w]
            } else {
                0.0
            };
            done[w] = if traces[w] > 0.0 { 0.0 } else { 1.0 };
        }
        let mut power = Self::ZERO;
        power.replace(self, &scales, &done);
        for _ in 0..SQUARINGS {
            let square = power.squared::<FUSED>();
            let traces = square.traces();
            for w in 0..W {
                scales[w] = 1.0 / traces[w];
            }
            // Whoever is done stays as it is, however long the others take.
            power.replace(&square, &scales, &done);
            for w in 0..W {
                done[w] = if traces[w] > 1.0 - REMAINDER {
                    1.0
                } else {
                    done[w]
                };
            }
            if done.iter().all(|it| *it > 0.0) {
                break;
            }
        }
        let mut vectors = power.heaviest_columns::<FUSED>();
        for w in 0..W {
            if done[w] == 0.0 {
                let vector = hermitian_eigen(self.get(w), N).vectors[0];
                for n in 0..N {
                    (vectors.re[n][w], vectors.im[n][w]) = (vector[n].re, vector[n].im);
                }
            }
        }
        vectors
    }

    /// Of matrices of rank one, the columns with the largest entries on the diagonal, normalised.
    #[inline(always)]
    fn heaviest_columns<const FUSED: bool>(&self) -> Vectors<N, W> {
        let mut columns = Vectors {
            re: [[0.0; W]; N],
            im: [[0.0; W]; N],
        };
        let mut heaviest = [0.0; W];
        for n in 0..N {
            for k in 0..N {
                let (re, im, sign) = self.entries(k, n);
                for w in 0..W {
                    let heavier = self.re[n][n][w] > heaviest[w];
                    let (x, y) = (&mut columns.re[k][w], &mut columns.im[k][w]);
                    *x = if heavier { re[w] } else { *x };
                    *y = if heavier { sign * im[w] } else { *y };
                }
            }
            for w in 0..W {
                let entry = self.re[n][n][w];
                heaviest[w] = if entry > heaviest[w] {
                    entry
                } else {
                    heaviest[w]
                };
            }
        }
        let mut powers = [0.0; W];
        for n in 0..N {
            for w in 0..W {
                let (re, im) = (columns.re[n][w], columns.im[n][w]);
                powers[w] = times_plus::<FUSED>(re, re, times_plus::<FUSED>(im, im, powers[w]));
            }
        }
        for n in 0..N {
            for w in 0..W {
                let scale = if powers[w] > 0.0 {
                    1.0 / powers[w].sqrt()
                } else {
                    0.0
                };
                columns.re[n][w] *= scale;
                columns.im[n][w] *= scale;
            }
        }
        columns
    }
}

/// The eigenvector (unit norm) of the largest eigenvalue of a positive semidefinite matrix.
pub(crate) fn principal_eigenvector<const N: usize>(matrix: &Matrix<N>) -> [Complex64; N] {
    let mut single = Hermitians::<N, 1>::ZERO;
    single.set(0, matrix);
    let vectors = single.principal_eigenvectors::<false>();
    std::array::from_fn(|n| Complex64::new(vectors.re[n][0], vectors.im[n][0]))
}
