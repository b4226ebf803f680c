//! ESPRIT (Roy and Kailath 1989): the rotation between the subspaces of two overlapping subarrays.

use num_complex::Complex64;

use crate::linalg::dense::{inverse, product};
use crate::linalg::eigen::{HermitianEigen, general_eigenvalues, hermitian_eigen};
use crate::linalg::hermitians::Vectors;
use crate::linalg::matrix::{Matrix, zeros};
use crate::list::List;
use crate::simd::math::times_plus;
use crate::spectrum::side_by_side::Places;

/// Returns the ratio of standard deviation to Cramér–Rao bound for one source and high SNR: `sqrt(N
/// (N + 1) / (6 (N - 1)))` (Rao and Hari 1989). The loss of one antenna in each subarray is small.
pub(crate) fn excess<const N: usize>() -> f64 {
    let n = N as f64;
    (n * (n + 1.0) / (6.0 * (n - 1.0))).sqrt()
}

/// Estimates one source in each of many items: both kinds of least squares give the phase of `sum
/// conj(u_n) u_(n+1)`.
#[inline(always)]
pub(crate) fn places<const FUSED: bool, const N: usize, const W: usize>(
    principal: &Vectors<N, W>,
) -> Places<W> {
    let (mut re, mut im) = ([0.0; W], [0.0; W]);
    for n in 1..N {
        for w in 0..W {
            let (a, b) = (principal.re[n][w], principal.im[n][w]);
            let (c, d) = (principal.re[n - 1][w], principal.im[n - 1][w]);
            re[w] = times_plus::<FUSED>(a, c, times_plus::<FUSED>(b, d, re[w]));
            im[w] = times_plus::<FUSED>(b, c, times_plus::<FUSED>(-a, d, im[w]));
        }
    }
    Places::of_directions::<FUSED>(&re, &im)
}

/// Computes the phases by least squares: the eigenvalues of `Psi = (U1^H U1)^-1 U1^H U2` are `exp(j
/// omega)`. Returns `None` for a singular matrix.
pub(crate) fn least_squares<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Option<List<f64, N>> {
    let (mut gram, mut cross) = (zeros::<N>(), zeros::<N>());
    for i in 0..sources {
        for j in 0..sources {
            for n in 0..N - 1 {
                gram[i][j] += eigen.vectors[i][n].conj() * eigen.vectors[j][n];
                cross[i][j] += eigen.vectors[i][n].conj() * eigen.vectors[j][n + 1];
            }
        }
    }
    let rotation = product(&inverse(gram, sources)?, &cross, [sources; 3]);
    Some(phases_of(rotation, sources))
}

/// Computes the phases by total least squares, which allows for errors in both subspaces. With the
/// eigenvectors `E` of `[U1 U2]^H [U1 U2]` in order of descending eigenvalues, `Psi = -E12 E22^-1`.
/// Returns `None` for a singular matrix.
pub(crate) fn total_least_squares<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Option<List<f64, N>> {
    // The capacity must hold the bases of both subarrays.
    match 2 * sources {
        0..=8 => total::<N, 8>(eigen, sources),
        9..=16 => total::<N, 16>(eigen, sources),
        _ => total::<N, 64>(eigen, sources),
    }
}

fn total<const N: usize, const ROOM: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Option<List<f64, N>> {
    if 2 * sources > ROOM {
        return None;
    }
    let mut gram = zeros::<ROOM>();
    let entry = |column: usize, n: usize| eigen.vectors[column % sources][n + column / sources];
    for i in 0..2 * sources {
        for j in 0..2 * sources {
            gram[i][j] = (0..N - 1).map(|n| entry(i, n).conj() * entry(j, n)).sum();
        }
    }
    let vectors = hermitian_eigen(gram, 2 * sources).vectors;
    let (mut upper, mut lower) = (zeros::<N>(), zeros::<N>());
    for i in 0..sources {
        for j in 0..sources {
            upper[i][j] = -vectors[sources + j][i];
            lower[i][j] = vectors[sources + j][sources + i];
        }
    }
    let rotation = product(&upper, &inverse(lower, sources)?, [sources; 3]);
    Some(phases_of(rotation, sources))
}

fn phases_of<const N: usize>(rotation: Matrix<N>, sources: usize) -> List<f64, N> {
    let eigenvalues = general_eigenvalues(rotation, sources);
    List::collect(
        0.0,
        eigenvalues[..sources].iter().copied().map(Complex64::arg),
    )
}
