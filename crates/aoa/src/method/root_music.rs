//! Root-MUSIC (Barabell 1983; Rao and Hari 1989): the roots of the null spectrum instead of its
//! minima.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::array::steering::aperture;
use crate::list::List;
use crate::spectrum::polynomial::Spectrum;

const ITERATIONS: usize = 60;

/// Electrical angles of the `sources` roots nearest to the unit circle. `null` is the spectrum of the
/// noise subspace.
pub(crate) fn phases<const N: usize>(null: &Spectrum<N>, sources: usize) -> List<f64, N> {
    // A start without symmetry, so that no two roots can stay together.
    let mut start = [Complex64::ZERO; N];
    for (i, root) in start[..N - 1].iter_mut().enumerate() {
        *root = Complex64::from_polar(0.7, 0.4 + TAU * i as f64 / (N - 1) as f64);
    }
    let mut roots = inner_roots(null, start);
    roots[..N - 1].sort_unstable_by(|a, b| b.norm_sqr().total_cmp(&a.norm_sqr()));
    List::collect(
        0.0,
        roots[..sources].iter().map(|root| settled(null, *root)),
    )
}

/// The electrical angle of the root nearest to the unit circle, for one source with the given signal
/// spectrum.
pub(crate) fn phase<const N: usize>(signal: &Spectrum<N>) -> f64 {
    let mut null = signal.negated();
    null.lags[0] += N as f64;
    // Without noise one root is on the circle at the source, the others lie about half way in,
    // between the zeros of the array's pattern; noise moves them little.
    let (peak, height) = signal.maximum();
    let depth = ((N as f64 - height).max(0.0) / aperture::<N>()).sqrt();
    let mut start = [Complex64::ZERO; N];
    start[0] = Complex64::from_polar(1.0 - depth.min(0.5), peak);
    for (i, root) in start[..N - 1].iter_mut().enumerate().skip(1) {
        let side = TAU * (i as f64 + 0.5 - 0.5 / N as f64) / (N as f64 - 1.0 / N as f64);
        *root = Complex64::from_polar(0.45, peak + side);
    }
    let roots = inner_roots(&null, start);
    let nearest = roots[..N - 1].iter().fold(Complex64::ZERO, |best, root| {
        if root.norm_sqr() > best.norm_sqr() {
            *root
        } else {
            best
        }
    });
    settled(&null, nearest)
}

/// The phase of a root. A root on the circle is double, and rounding moves it along the circle by
/// the square root of eps; but there the spectrum has a zero, and its minimum is well determined.
fn settled<const N: usize>(null: &Spectrum<N>, root: Complex64) -> f64 {
    let phase = root.arg();
    if root.norm_sqr() > 1.0 - 1e-4 {
        let minimum = null.negated().refined_maximum(phase, 1e-3);
        if null.value(minimum) < null.lags[0].re * 1e-12 {
            return minimum;
        }
    }
    phase
}

/// The N - 1 roots inside (or on) the unit circle of
/// `P(z) = z^(N-1) sum_k (c_k z^-k + conj(c_k) z^k)`; the others are their mirror images
/// `1 / conj(z)`.
///
/// Ehrlich–Aberth iteration on the inner roots alone, the mirror images taking part in the
/// repulsion.
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
            // Newton's step is value / slope; written so that a zero slope does no harm.
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
        // The error of a simple root cubes at each step.
        if moved < 1e-12 {
            break;
        }
    }
    roots
}

/// P(z) and P'(z) by Horner's scheme, coefficients from the highest power down:
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
