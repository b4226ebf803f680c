//! Eigenvalues of small matrices by textbook methods. For four antennas, a general library is
//! slower.

use num_complex::Complex64;

use super::matrix::{Matrix, zeros};

/// Maximum number of cyclic Jacobi sweeps; the convergence is quadratic, and N <= 16 never needs
/// ten.
const SWEEPS: usize = 12;

/// Eigenvalues in descending order, with the eigenvectors as the *rows* of `vectors`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HermitianEigen<const N: usize> {
    pub(crate) values: [f64; N],
    pub(crate) vectors: Matrix<N>,
}

/// Computes the eigendecomposition of the leading `n` by `n` block of a Hermitian matrix by cyclic
/// complex Jacobi rotations (Golub and Van Loan, Matrix Computations, 8.5). The input must be
/// finite.
pub(crate) fn hermitian_eigen<const N: usize>(mut a: Matrix<N>, n: usize) -> HermitianEigen<N> {
    let mut v = zeros::<N>();
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = Complex64::ONE;
    }
    let total: f64 = a.iter().flatten().map(Complex64::norm_sqr).sum();
    let negligible = total * f64::EPSILON * f64::EPSILON * 1e-2;
    for _ in 0..SWEEPS {
        let mut off_diagonal = 0.0;
        for p in 0..n {
            for q in p + 1..n {
                let squared = a[p][q].norm_sqr();
                off_diagonal += squared;
                if squared > negligible * 1e-3 {
                    rotate(&mut a, &mut v, p, q, n);
                }
            }
        }
        if off_diagonal <= negligible {
            break;
        }
    }
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order[..n].sort_unstable_by(|&i, &j| a[j][j].re.total_cmp(&a[i][i].re));
    HermitianEigen {
        values: order.map(|i| a[i][i].re),
        vectors: order.map(|i| v[i]),
    }
}

/// Applies a unitary rotation of rows and columns p and q that annihilates entry (p, q). The
/// eigenvectors are the rows of `v`.
fn rotate<const N: usize>(a: &mut Matrix<N>, v: &mut Matrix<N>, p: usize, q: usize, n: usize) {
    let magnitude = a[p][q].norm_sqr().sqrt();
    let phase = a[p][q] / magnitude;
    let tau = (a[q][q].re - a[p][p].re) / (2.0 * magnitude);
    let t = 1.0_f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
    let c = 1.0 / (1.0 + t * t).sqrt();
    let s = phase * (t * c);
    a[p][p].re -= t * magnitude;
    a[q][q].re += t * magnitude;
    a[p][q] = Complex64::ZERO;
    a[q][p] = Complex64::ZERO;
    for k in 0..n {
        if k != p && k != q {
            let (kp, kq) = (a[k][p], a[k][q]);
            a[k][p] = kp * c - kq * s.conj();
            a[k][q] = kp * s + kq * c;
            a[p][k] = a[k][p].conj();
            a[q][k] = a[k][q].conj();
        }
        let (pk, qk) = (v[p][k], v[q][k]);
        v[p][k] = pk * c - qk * s.conj();
        v[q][k] = pk * s + qk * c;
    }
}

/// Computes the eigenvalues of the leading `n` by `n` block of a general complex matrix by shifted
/// QR iteration with Givens rotations (Golub and Van Loan, 7.5) and deflation.
pub(crate) fn general_eigenvalues<const N: usize>(mut a: Matrix<N>, n: usize) -> [Complex64; N] {
    let mut active = n;
    for iteration in 0..40 * n {
        while active >= 2 {
            let row = active - 1;
            let below: f64 = a[row][..row].iter().map(Complex64::norm_sqr).sum();
            let total: f64 = a[..active]
                .iter()
                .map(|r| r[..active].iter().map(Complex64::norm_sqr).sum::<f64>())
                .sum();
            if below > f64::EPSILON * f64::EPSILON * total {
                break;
            }
            active -= 1;
        }
        if active < 2 {
            break;
        }
        let mut shift = corner_eigenvalue(&a, active);
        if iteration % 11 == 10 {
            // An exceptional shift ends a rare cycle.
            shift += a[active - 1][active - 2].norm();
        }
        qr_step(&mut a, active, shift);
    }
    std::array::from_fn(|i| a[i][i])
}

/// Returns Wilkinson's shift: the eigenvalue of the last 2 by 2 block that is nearer to its last
/// entry.
fn corner_eigenvalue<const N: usize>(a: &Matrix<N>, n: usize) -> Complex64 {
    let (p, q) = (n - 2, n - 1);
    let half = (a[p][p] - a[q][q]) * 0.5;
    let root = (half * half + a[p][q] * a[q][p]).sqrt();
    let divisor = if (half.conj() * root).re >= 0.0 {
        half + root
    } else {
        half - root
    };
    if divisor.norm_sqr() == 0.0 {
        a[q][q]
    } else {
        a[q][q] - a[p][q] * a[q][p] / divisor
    }
}

/// Computes one QR step: `A - s I = Q R`, then `A = R Q + s I`.
fn qr_step<const N: usize>(a: &mut Matrix<N>, n: usize, shift: Complex64) {
    for (i, row) in a[..n].iter_mut().enumerate() {
        row[i] -= shift;
    }
    let mut rotations = [(0usize, 0usize, Complex64::ONE, Complex64::ZERO); 128];
    let mut count = 0;
    for column in 0..n {
        for row in column + 1..n {
            let (x, y) = (a[column][column], a[row][column]);
            let norm = (x.norm_sqr() + y.norm_sqr()).sqrt();
            if norm == 0.0 {
                continue;
            }
            let (c, s) = (x / norm, y / norm);
            for k in 0..n {
                let (u, v) = (a[column][k], a[row][k]);
                a[column][k] = c.conj() * u + s.conj() * v;
                a[row][k] = c * v - s * u;
            }
            if let Some(slot) = rotations.get_mut(count) {
                *slot = (column, row, c, s);
                count += 1;
            }
        }
    }
    for &(p, q, c, s) in &rotations[..count] {
        for row in &mut a[..n] {
            let (u, v) = (row[p], row[q]);
            row[p] = u * c + v * s;
            row[q] = v * c.conj() - u * s.conj();
        }
    }
    for (i, row) in a[..n].iter_mut().enumerate() {
        row[i] += shift;
    }
}
