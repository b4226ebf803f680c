//! Root-MUSIC (Barabell 1983; Rao and Hari 1989): roots of the null spectrum instead of its minima.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::array::steering::aperture;
use crate::linalg::hermitians::Vectors;
use crate::list::List;
use crate::simd::math::times_plus;
use crate::spectrum::polynomial::Spectrum;
use crate::spectrum::side_by_side::{Places, Spectra};

const ITERATIONS: usize = 60;

/// Returns the electrical angles of the `sources` roots nearest to the unit circle. `null` is the
/// spectrum of the noise subspace.
pub(crate) fn phases<const N: usize>(null: &Spectrum<N>, sources: usize) -> List<f64, N> {
    // The asymmetric initial values prevent two roots from converging together.
    let mut start = [Complex64::ZERO; N];
    for (i, root) in start[..N - 1].iter_mut().enumerate() {
        *root = Complex64::from_polar(0.7, 0.4 + TAU * i as f64 / (N - 1) as f64);
    }
    let mut roots = inner_roots(null, start);
    roots[..N - 1].sort_unstable_by(|a, b| b.norm_sqr().total_cmp(&a.norm_sqr()));
    List::collect(
        0.0,
        roots[..sources]
            .iter()
            .map(|root| refined_phase(null, *root)),
    )
}

/// Estimates one source in each of many items: the root at the highest peak of the spectrum. At a
/// sufficient SNR, this root is the nearest to the unit circle. Newton's method starts above the
/// peak, with the root's mirror image divided out.
#[inline(always)]
pub(crate) fn places<const FUSED: bool, const N: usize, const W: usize>(
    principal: &Vectors<N, W>,
) -> Places<W> {
    const STEPS: usize = 8;
    /// Relative depth of the null (divided by N) below which the root and its mirror image coincide
    /// numerically. The peak between them is then better determined.
    const DOUBLE: f64 = 1e-10;
    let signal = Spectra::of_vectors::<FUSED>(principal);
    let peaks = signal.maxima::<FUSED>();
    let heights = signal.values::<FUSED>(&peaks);
    let (mut re, mut im) = (peaks.cos, peaks.sin);
    let mut free = [0.0; W];
    for w in 0..W {
        let depth = N as f64 - heights[w];
        free[w] = if depth > DOUBLE * N as f64 { 1.0 } else { 0.0 };
        // Without other roots, the null is a parabola with the curvature of an exact source.
        let inward = (depth.abs() / aperture::<N>()).sqrt();
        let radius = 1.0 - free[w] * if inward < 0.5 { inward } else { 0.5 };
        re[w] *= radius;
        im[w] *= radius;
    }
    for _ in 0..STEPS {
        for w in 0..W {
            let (x, y) = (re[w], im[w]);
            // P(z) and P'(z) by Horner's scheme, with the coefficients of N - f in descending
            // order.
            let (mut p_re, mut p_im, mut slope_re, mut slope_im) = (0.0, 0.0, 0.0, 0.0);
            for place in 0..2 * N - 1 {
                let k = place.abs_diff(N - 1);
                let c_re = if k == 0 { N as f64 } else { 0.0 } - signal.re[k][w];
                let c_im = signal.im[k][w] * if place < N { 1.0 } else { -1.0 };
                let next =
                    times_plus::<FUSED>(slope_re, x, times_plus::<FUSED>(-slope_im, y, p_re));
                slope_im = times_plus::<FUSED>(slope_re, y, times_plus::<FUSED>(slope_im, x, p_im));
                slope_re = next;
                let next = times_plus::<FUSED>(p_re, x, times_plus::<FUSED>(-p_im, y, c_re));
                p_im = times_plus::<FUSED>(p_re, y, times_plus::<FUSED>(p_im, x, c_im));
                p_re = next;
            }
            // Compute step = P / (P' - P / (z - 1 / conj(z))).
            let squared = times_plus::<FUSED>(x, x, y * y);
            let inverse = 1.0 / (squared - 1.0);
            let (a, b) = (x * inverse, -y * inverse);
            let divisor_re = slope_re - (p_re * a - p_im * b);
            let divisor_im = slope_im - (p_re * b + p_im * a);
            let power = times_plus::<FUSED>(divisor_re, divisor_re, divisor_im * divisor_im);
            let scale = if power > 0.0 { free[w] / power } else { 0.0 };
            let moves = free[w] > 0.0;
            let step_re = times_plus::<FUSED>(p_re, divisor_re, p_im * divisor_im) * scale;
            let step_im = times_plus::<FUSED>(p_im, divisor_re, -(p_re * divisor_im)) * scale;
            let (next_re, next_im) = (x - step_re, y - step_im);
            let modulus = times_plus::<FUSED>(next_re, next_re, next_im * next_im);
            let inside = if modulus > 1.0 { 1.0 / modulus } else { 1.0 };
            re[w] = if moves { next_re * inside } else { x };
            im[w] = if moves { next_im * inside } else { y };
            let moved = times_plus::<FUSED>(step_re, step_re, step_im * step_im);
            free[w] = if moved > 1e-12 { free[w] } else { 0.0 };
        }
        if free.iter().all(|it| *it == 0.0) {
            break;
        }
    }
    Places::of_directions::<FUSED>(&re, &im)
}

/// Returns the phase of a root. A root on the unit circle is double, and rounding moves it along
/// the circle by the square root of eps. The spectrum has a zero there, whose minimum is well
/// determined.
fn refined_phase<const N: usize>(null: &Spectrum<N>, root: Complex64) -> f64 {
    let phase = root.arg();
    if root.norm_sqr() > 1.0 - 1e-4 {
        let minimum = null.negated().refined_maximum(phase, 1e-3);
        if null.value(minimum) < null.lags[0].re * 1e-12 {
            return minimum;
        }
    }
    phase
}

/// Returns the N - 1 roots inside or on the unit circle of `P(z) = z^(N-1) sum_k (c_k z^-k +
/// conj(c_k) z^k)`. The other roots are their mirror images `1 / conj(z)`.
///
/// Ehrlich–Aberth iteration of the inner roots; the mirror images contribute to the repulsion.
fn inner_roots<const N: usize>(null: &Spectrum<N>, mut roots: [Complex64; N]) -> [Complex64; N] {
    let degree = N - 1;
    for _ in 0..ITERATIONS {
        let mut moved: f64 = 0.0;
        for i in 0..degree {
            let z = roots[i];
            let (value, slope) = evaluate(null, z);
            if value.norm_sqr() == 0.0 {
                continue;
            }
            let mut repulsion = Complex64::ZERO;
            for (j, other) in roots[..degree].iter().enumerate() {
                if j != i && *other != z {
                    repulsion += (z - other).inv();
                }
                let mirror = z * other.conj() - 1.0;
                if mirror != Complex64::ZERO {
                    repulsion += other.conj() / mirror;
                }
            }
            // Newton's step is value / slope; this form is finite for a zero slope.
            let step = value / (slope - value * repulsion);
            if step.is_finite() {
                let mut next = z - step;
                if next.norm_sqr() > 1.0 {
                    next = next.conj().inv();
                }
                roots[i] = next;
                moved = moved.max(step.norm_sqr());
            }
        }
        // The iteration converges cubically for simple roots.
        if moved < 1e-12 {
            break;
        }
    }
    roots
}

/// Returns P(z) and P'(z) by Horner's scheme, with the coefficients in descending order of power:
/// `conj(c_(N-1)), ..., conj(c_1), c_0, c_1, ..., c_(N-1)`.
fn evaluate<const N: usize>(null: &Spectrum<N>, z: Complex64) -> (Complex64, Complex64) {
    let (mut value, mut slope) = (Complex64::ZERO, Complex64::ZERO);
    let mirrored = null.lags.iter().rev().map(Complex64::conj);
    for coefficient in mirrored.chain(null.lags.iter().skip(1).copied()) {
        slope = slope * z + value;
        value = value * z + coefficient;
    }
    (value, slope)
}
