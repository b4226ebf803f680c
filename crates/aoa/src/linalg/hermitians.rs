//! Hermitian matrices processed together.
//!
//! A single small matrix has too few products for vector registers. Therefore, `W` matrices are
//! processed together, and the compiler vectorises the innermost loops. The result of one matrix
//! does not depend on the others.

use num_complex::Complex64;

use super::eigen::hermitian_eigen;
use super::matrix::Matrix;
use crate::simd::math::{select, times_plus};

/// `W` vectors of `N` elements.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vectors<const N: usize, const W: usize> {
    pub(crate) re: [[f64; W]; N],
    pub(crate) im: [[f64; W]; N],
}

/// Lower triangles of `W` Hermitian matrices.
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

    /// Returns entry (i, j) of every matrix: real parts, imaginary parts, and the sign of the
    /// imaginary parts.
    #[inline(always)]
    pub(crate) fn entries(&self, i: usize, j: usize) -> (&[f64; W], &[f64; W], f64) {
        if j <= i {
            (&self.re[i][j], &self.im[i][j], 1.0)
        } else {
            (&self.re[j][i], &self.im[j][i], -1.0)
        }
    }

    /// Multiplies row `n` of every matrix by `factors[n]` and column `n` by its conjugate.
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

    /// Returns `(R + J conj(R) J) / 2`, where `J` reverses the order.
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

    /// Sets entry (i, j) of matrix `w`, and entry (j, i) to its conjugate.
    #[inline(always)]
    fn put(&mut self, (i, j, w): (usize, usize, usize), re: f64, im: f64) {
        (self.re[i][j][w], self.im[i][j][w]) = (re, im);
        (self.re[j][i][w], self.im[j][i][w]) = (re, -im);
    }

    /// Computes `A^2 / tr A^2` of full matrices into `square` and returns the traces of the
    /// squares. If `keep[w]` is not zero, `A` is copied. Because `A = A^H`, entry (i, j) of the
    /// square is the product of rows i and j.
    #[inline(always)]
    fn square_into<const FUSED: bool>(&self, square: &mut Self, keep: &[f64; W]) -> [f64; W] {
        let (mut diagonal, mut traces) = ([[0.0; W]; N], [0.0; W]);
        for i in 0..N {
            for w in 0..W {
                let mut sum = 0.0;
                for k in 0..N {
                    let (a, b) = (self.re[i][k][w], self.im[i][k][w]);
                    sum = times_plus::<FUSED>(a, a, times_plus::<FUSED>(b, b, sum));
                }
                diagonal[i][w] = sum;
                traces[w] += sum;
            }
        }
        let scales = traces.map(|trace| 1.0 / trace);
        for i in 0..N {
            for w in 0..W {
                let kept = select(keep[w] == 0.0, diagonal[i][w] * scales[w], self.re[i][i][w]);
                square.re[i][i][w] = kept;
            }
            for j in 0..i {
                for w in 0..W {
                    let (mut re, mut im) = (0.0, 0.0);
                    for k in 0..N {
                        let (a, b) = (self.re[i][k][w], self.im[i][k][w]);
                        let (c, d) = (self.re[j][k][w], self.im[j][k][w]);
                        re = times_plus::<FUSED>(a, c, times_plus::<FUSED>(b, d, re));
                        im = times_plus::<FUSED>(b, c, times_plus::<FUSED>(-a, d, im));
                    }
                    let on = keep[w] == 0.0;
                    let re = select(on, re * scales[w], self.re[i][j][w]);
                    let im = select(on, im * scales[w], self.im[i][j][w]);
                    square.put((i, j, w), re, im);
                }
            }
        }
        traces
    }

    /// Computes the unit eigenvectors of the largest eigenvalues of positive semidefinite matrices.
    ///
    /// Each squaring of a matrix squares the ratios of its eigenvalues. After a few squarings only
    /// the largest eigenvalue remains, and a product with the last square replaces one squaring. If
    /// the two largest eigenvalues are almost equal, Jacobi's method is used instead. A zero matrix
    /// gives a zero vector.
    #[inline(always)]
    pub(crate) fn principal_eigenvectors<const FUSED: bool>(&self) -> Vectors<N, W> {
        const SQUARINGS: usize = 9;
        // If a matrix of unit trace has a square of trace 1 - x, a fraction x / 2 is outside its
        // largest eigenvalue. The fraction is x^2 / 4 for the square. A column of the square,
        // multiplied by the square once more, has a fraction of x^4 / 16, which is the error of the
        // vector.
        const REMAINDER: f64 = 2e-3;
        let traces = self.traces();
        let (mut scales, mut done) = ([0.0; W], [0.0; W]);
        for w in 0..W {
            let filled = traces[w] > 0.0;
            scales[w] = select(filled, 1.0 / traces[w], 0.0);
            done[w] = select(filled, 0.0, 1.0);
        }
        let (mut first, mut second) = (Self::ZERO, Self::ZERO);
        let (mut power, mut square) = (&mut first, &mut second);
        for i in 0..N {
            for j in 0..=i {
                for w in 0..W {
                    let (re, im) = (self.re[i][j][w], self.im[i][j][w]);
                    power.put((i, j, w), re * scales[w], im * scales[w]);
                }
            }
        }
        for _ in 0..SQUARINGS {
            // Converged matrices are not changed while the others are iterated.
            let traces = power.square_into::<FUSED>(square, &done);
            std::mem::swap(&mut power, &mut square);
            for w in 0..W {
                done[w] = select(traces[w] > 1.0 - REMAINDER, 1.0, done[w]);
            }
            if done.iter().all(|it| *it > 0.0) {
                break;
            }
        }
        let mut vectors = power.times::<FUSED>(&power.heaviest_columns());
        vectors.normalise::<FUSED>();
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

    /// Returns the columns of full matrices with the largest diagonal entries.
    #[inline(always)]
    fn heaviest_columns(&self) -> Vectors<N, W> {
        let mut columns = Vectors {
            re: [[0.0; W]; N],
            im: [[0.0; W]; N],
        };
        let mut heaviest = [0.0; W];
        for n in 0..N {
            for w in 0..W {
                let entry = self.re[n][n][w];
                let heavier = entry > heaviest[w];
                for k in 0..N {
                    let (x, y) = (&mut columns.re[k][w], &mut columns.im[k][w]);
                    *x = select(heavier, self.re[k][n][w], *x);
                    *y = select(heavier, self.im[k][n][w], *y);
                }
                heaviest[w] = select(heavier, entry, heaviest[w]);
            }
        }
        columns
    }

    /// Returns `A v`.
    #[inline(always)]
    pub(crate) fn times<const FUSED: bool>(&self, vectors: &Vectors<N, W>) -> Vectors<N, W> {
        let mut products = Vectors {
            re: [[0.0; W]; N],
            im: [[0.0; W]; N],
        };
        for i in 0..N {
            for w in 0..W {
                let (mut re, mut im) = (0.0, 0.0);
                for k in 0..N {
                    let (a, b, sign) = self.entries(i, k);
                    let (a, b) = (a[w], sign * b[w]);
                    let (c, d) = (vectors.re[k][w], vectors.im[k][w]);
                    re = times_plus::<FUSED>(a, c, times_plus::<FUSED>(-b, d, re));
                    im = times_plus::<FUSED>(a, d, times_plus::<FUSED>(b, c, im));
                }
                (products.re[i][w], products.im[i][w]) = (re, im);
            }
        }
        products
    }
}

impl<const N: usize, const W: usize> Vectors<N, W> {
    /// Returns the steering vectors of the electrical angles with the given cosines and sines.
    #[inline(always)]
    pub(crate) fn steering<const FUSED: bool>(cos: &[f64; W], sin: &[f64; W]) -> Self {
        let mut steering = Self {
            re: [[1.0; W]; N],
            im: [[0.0; W]; N],
        };
        for n in 1..N {
            for w in 0..W {
                let (a, b) = (steering.re[n - 1][w], steering.im[n - 1][w]);
                steering.re[n][w] = times_plus::<FUSED>(a, cos[w], -b * sin[w]);
                steering.im[n][w] = times_plus::<FUSED>(a, sin[w], b * cos[w]);
            }
        }
        steering
    }

    /// Normalises to unit norm; a zero vector remains zero.
    #[inline(always)]
    fn normalise<const FUSED: bool>(&mut self) {
        let mut powers = [0.0; W];
        for n in 0..N {
            for w in 0..W {
                let (re, im) = (self.re[n][w], self.im[n][w]);
                powers[w] = times_plus::<FUSED>(re, re, times_plus::<FUSED>(im, im, powers[w]));
            }
        }
        let mut scales = [0.0; W];
        for w in 0..W {
            scales[w] = select(powers[w] > 0.0, 1.0 / powers[w].sqrt(), 0.0);
        }
        for n in 0..N {
            for w in 0..W {
                self.re[n][w] *= scales[w];
                self.im[n][w] *= scales[w];
            }
        }
    }
}

/// Returns the unit eigenvector of the largest eigenvalue of a positive semidefinite matrix.
pub(crate) fn principal_eigenvector<const N: usize>(matrix: &Matrix<N>) -> [Complex64; N] {
    let mut single = Hermitians::<N, 1>::ZERO;
    single.set(0, matrix);
    let vectors = single.principal_eigenvectors::<false>();
    std::array::from_fn(|n| Complex64::new(vectors.re[n][0], vectors.im[n][0]))
}
