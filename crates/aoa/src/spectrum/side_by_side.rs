//! Maxima of many spectra, searched together.
//!
//! The search of one spectrum takes some hundred branch-free operations. Therefore, `W` spectra are
//! searched together, and the compiler vectorises the innermost loops. `FUSED` selects fused
//! multiply-add for processors that have the instruction.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::error::Error;
use crate::linalg::hermitians::{Hermitians, Vectors};
use crate::simd::math::{arg, times_plus};

/// Number of points of the finest search grid on the circle.
const CIRCLE: usize = 128;
/// `cos(2 pi i / 128)`.
const COS: [f64; CIRCLE] = cosines();
/// Maximum number of Newton steps; three to four are required from the grid.
const NEWTON_STEPS: usize = 6;

/// `W` spectra `f(omega) = c_0 + 2 Re sum_k c_k exp(-j k omega)` of degree N - 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spectra<const N: usize, const W: usize> {
    pub(crate) re: [[f64; W]; N],
    pub(crate) im: [[f64; W]; N],
}

/// One position on the circle for each spectrum.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Places<const W: usize> {
    /// Electrical angle in (-pi, pi].
    pub(crate) phase_rad: [f64; W],
    pub(crate) cos: [f64; W],
    pub(crate) sin: [f64; W],
}

impl<const W: usize> Places<W> {
    /// Returns the phases of complex numbers of any modulus.
    #[inline(always)]
    pub(crate) fn of_directions<const FUSED: bool>(re: &[f64; W], im: &[f64; W]) -> Self {
        let mut places = Self {
            phase_rad: [0.0; W],
            cos: [1.0; W],
            sin: [0.0; W],
        };
        for w in 0..W {
            let (x, y) = (re[w], im[w]);
            let modulus = times_plus::<FUSED>(x, x, y * y).sqrt();
            let inverse = 1.0 / modulus;
            places.phase_rad[w] = arg::<FUSED>(x, y);
            places.cos[w] = if modulus > 0.0 { x * inverse } else { 1.0 };
            places.sin[w] = if modulus > 0.0 { y * inverse } else { 0.0 };
        }
        places
    }
}

/// Best grid point.
#[derive(Clone, Copy)]
struct Best<const W: usize> {
    value: [f64; W],
    phase: [f64; W],
    cos: [f64; W],
    sin: [f64; W],
}

impl<const N: usize, const W: usize> Spectra<N, W> {
    pub(crate) const ZERO: Self = Self {
        re: [[0.0; W]; N],
        im: [[0.0; W]; N],
    };

    /// Stride of the search grid, with at least eight points per antenna.
    const STRIDE: usize = match N {
        0..=2 => 8,
        3..=4 => 4,
        5..=8 => 2,
        _ => 1,
    };

    /// Checks that the first `count` spectra are those of valid covariances.
    ///
    /// # Errors
    /// Index and error of the first spectrum that is not of a valid covariance.
    #[inline(always)]
    pub(crate) fn check(&self, count: usize) -> Result<(), (usize, Error)> {
        for (w, trace) in self.re[0].iter().take(count).enumerate() {
            if !trace.is_finite() {
                return Err((w, Error::NotFinite));
            }
            if *trace <= 0.0 {
                return Err((w, Error::Zero));
            }
        }
        Ok(())
    }

    /// Returns the spectra `a^H A a` of Hermitian matrices from the sums along their diagonals.
    #[inline(always)]
    pub(crate) fn of_matrices(matrices: &Hermitians<N, W>) -> Self {
        let mut spectra = Self::ZERO;
        for i in 0..N {
            for j in 0..=i {
                let (re, im, _) = matrices.entries(i, j);
                for w in 0..W {
                    spectra.re[i - j][w] += re[w];
                    spectra.im[i - j][w] += im[w];
                }
            }
        }
        spectra
    }

    /// Returns the spectra `|a^H u|^2` of vectors.
    #[inline(always)]
    pub(crate) fn of_vectors<const FUSED: bool>(vectors: &Vectors<N, W>) -> Self {
        let mut spectra = Self::ZERO;
        for i in 0..N {
            for j in 0..=i {
                let k = i - j;
                for w in 0..W {
                    let (a, b) = (vectors.re[i][w], vectors.im[i][w]);
                    let (c, d) = (vectors.re[j][w], vectors.im[j][w]);
                    let re = times_plus::<FUSED>(b, d, spectra.re[k][w]);
                    let im = times_plus::<FUSED>(-a, d, spectra.im[k][w]);
                    spectra.re[k][w] = times_plus::<FUSED>(a, c, re);
                    spectra.im[k][w] = times_plus::<FUSED>(b, c, im);
                }
            }
        }
        spectra
    }

    /// Returns `f` at the given positions by Horner's scheme.
    #[inline(always)]
    pub(crate) fn values<const FUSED: bool>(&self, places: &Places<W>) -> [f64; W] {
        let mut values = [0.0; W];
        for w in 0..W {
            let (re, im) = (places.cos[w], -places.sin[w]);
            let (mut sum_re, mut sum_im) = (0.0, 0.0);
            for k in (1..N).rev() {
                let (a, b) = (sum_re + self.re[k][w], sum_im + self.im[k][w]);
                sum_re = times_plus::<FUSED>(a, re, -(b * im));
                sum_im = times_plus::<FUSED>(a, im, b * re);
            }
            values[w] = times_plus::<FUSED>(2.0, sum_re, self.re[0][w]);
        }
        values
    }

    /// Returns the positions of the maxima: the best point of a grid, refined by Newton's method.
    ///
    /// A spectrum `f >= 0` of degree n = N - 1 is at least `cos(n x / 2)^2` times its maximum at
    /// the distance x from it (M. Riesz 1914), i.e. 96 % at the nearest of eight points per
    /// antenna. The result is the global maximum unless another peak is within 4 % of it.
    #[inline(always)]
    pub(crate) fn maxima<const FUSED: bool>(&self) -> Places<W> {
        let best = self.best_grid_points::<FUSED>();
        self.refined::<FUSED>(&best)
    }

    #[inline(always)]
    fn best_grid_points<const FUSED: bool>(&self) -> Best<W> {
        let mut best = Best {
            value: [f64::NEG_INFINITY; W],
            phase: [0.0; W],
            cos: [1.0; W],
            sin: [0.0; W],
        };
        let mut point = 0;
        while point <= CIRCLE / 4 {
            // The sums over even and odd k give the spectrum at omega, -omega, pi - omega and omega
            // - pi, which differ in signs only.
            let angle = TAU * point as f64 / CIRCLE as f64;
            let (cos, sin) = (COS[point], COS[CIRCLE / 4 - point]);
            for w in 0..W {
                let (mut even_cos, mut odd_cos, mut even_sin, mut odd_sin) = (0.0, 0.0, 0.0, 0.0);
                for k in 1..N {
                    let c = COS[point * k % CIRCLE];
                    let s = COS[(point * k + CIRCLE * 3 / 4) % CIRCLE];
                    if k % 2 == 0 {
                        even_cos = times_plus::<FUSED>(self.re[k][w], c, even_cos);
                        even_sin = times_plus::<FUSED>(self.im[k][w], s, even_sin);
                    } else {
                        odd_cos = times_plus::<FUSED>(self.re[k][w], c, odd_cos);
                        odd_sin = times_plus::<FUSED>(self.im[k][w], s, odd_sin);
                    }
                }
                let (right, left) = (odd_sin + even_sin, odd_sin - even_sin);
                let ahead = even_cos + odd_cos + right.abs();
                let behind = even_cos - odd_cos + left.abs();
                let forward = ahead > behind;
                let value = if forward { ahead } else { behind };
                let side = if forward { right } else { left };
                let better = value > best.value[w];
                let phase = (if forward { angle } else { PI - angle }).copysign(side);
                best.value[w] = if better { value } else { best.value[w] };
                best.phase[w] = if better { phase } else { best.phase[w] };
                best.cos[w] = if better {
                    if forward { cos } else { -cos }
                } else {
                    best.cos[w]
                };
                best.sin[w] = if better {
                    sin.copysign(side)
                } else {
                    best.sin[w]
                };
            }
            point += Self::STRIDE;
        }
        best
    }

    #[inline(always)]
    fn refined<const FUSED: bool>(&self, best: &Best<W>) -> Places<W> {
        let reach = 0.75 * TAU * Self::STRIDE as f64 / CIRCLE as f64;
        let Best {
            phase,
            mut cos,
            mut sin,
            ..
        } = *best;
        let mut offset = [0.0; W];
        // Converged positions are not changed while the others are iterated.
        let mut free = [1.0; W];
        for _ in 0..NEWTON_STEPS {
            for w in 0..W {
                // z = exp(-j omega), raised to the k-th power in the loop.
                let (z_re, z_im) = (cos[w], -sin[w]);
                let (mut power_re, mut power_im) = (z_re, z_im);
                let (mut slope, mut curvature) = (0.0, 0.0);
                for k in 1..N {
                    let (re, im) = (self.re[k][w], self.im[k][w]);
                    let term_re = times_plus::<FUSED>(re, power_re, -(im * power_im));
                    let term_im = times_plus::<FUSED>(re, power_im, im * power_re);
                    let order = k as f64;
                    slope = times_plus::<FUSED>(order, term_im, slope);
                    curvature = times_plus::<FUSED>(-order * order, term_re, curvature);
                    let next_re = times_plus::<FUSED>(power_re, z_re, -(power_im * z_im));
                    power_im = times_plus::<FUSED>(power_re, z_im, power_im * z_re);
                    power_re = next_re;
                }
                // If the spectrum is convex, move uphill instead.
                let newton = -slope / curvature;
                let gradient_step = (0.5 * reach).copysign(slope);
                let step = if curvature < 0.0 {
                    newton
                } else {
                    gradient_step
                };
                let target = offset[w] + step;
                let target = if target > reach { reach } else { target };
                let target = if target < -reach { -reach } else { target };
                let step = (target - offset[w]) * free[w];
                offset[w] += step;
                // Rotate by the step, with |step| <= 2 reach.
                let (step_sin, step_cos) = small_sin_cos::<FUSED>(step);
                let next_cos = times_plus::<FUSED>(cos[w], step_cos, -(sin[w] * step_sin));
                sin[w] = times_plus::<FUSED>(cos[w], step_sin, sin[w] * step_cos);
                cos[w] = next_cos;
                // The convergence is quadratic.
                free[w] = if step.abs() > 1e-7 { free[w] } else { 0.0 };
            }
            if free.iter().all(|it| *it == 0.0) {
                break;
            }
        }
        let mut phase_rad = [0.0; W];
        for w in 0..W {
            let turned = phase[w] + offset[w];
            let turned = if turned > PI { turned - TAU } else { turned };
            phase_rad[w] = if turned <= -PI { turned + TAU } else { turned };
        }
        Places {
            phase_rad,
            cos,
            sin,
        }
    }
}

/// Returns sine and cosine by their Taylor series with an error of 1e-14 for |x| < 0.6.
#[inline(always)]
fn small_sin_cos<const FUSED: bool>(x: f64) -> (f64, f64) {
    let squared = x * x;
    let (mut sin, mut cos) = (0.0, 0.0);
    for term in SINE_COSINE.iter().rev() {
        sin = times_plus::<FUSED>(sin, squared, term.0);
        cos = times_plus::<FUSED>(cos, squared, term.1);
    }
    (x * sin, cos)
}

/// Coefficients of `sin(x) / x` and of `cos(x)` in powers of `x^2`.
const SINE_COSINE: [(f64, f64); 7] = {
    let mut series = [(1.0, 1.0); 7];
    let mut n = 1;
    while n < series.len() {
        let order = 2.0 * n as f64;
        series[n].0 = -series[n - 1].0 / (order * (order + 1.0));
        series[n].1 = -series[n - 1].1 / (order * (order - 1.0));
        n += 1;
    }
    series
};

/// Returns the cosines of the grid by the Taylor series at the nearest multiple of pi / 2.
const fn cosines() -> [f64; CIRCLE] {
    let mut table = [0.0; CIRCLE];
    let mut i = 0;
    while i < CIRCLE {
        // Reduce to the first octant, where the series of sine and cosine converge fast.
        let quadrant = (i + CIRCLE / 8) / (CIRCLE / 4);
        let x = (i as f64 - (quadrant * CIRCLE / 4) as f64) * (FRAC_PI_2 / (CIRCLE / 4) as f64);
        let (mut sin, mut cos) = (0.0, 0.0);
        let mut n = 20.0;
        while n > 1.0 {
            sin = (1.0 + sin) * (-x * x / (n * (n + 1.0)));
            cos = (1.0 + cos) * (-x * x / (n * (n - 1.0)));
            n -= 2.0;
        }
        let (sin, cos) = (x * (1.0 + sin), 1.0 + cos);
        table[i] = match quadrant % 4 {
            0 => cos,
            1 => -sin,
            2 => -cos,
            _ => sin,
        };
        i += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_cosines_equal_the_standard_library() {
        for (i, value) in COS.iter().enumerate() {
            assert!(
                (value - (TAU * i as f64 / CIRCLE as f64).cos()).abs() < 1e-15,
                "{i}"
            );
        }
    }

    #[test]
    fn small_angle_sine_and_cosine_equal_the_standard_library() {
        for i in -60..=60 {
            let x = f64::from(i) * 0.01;
            let (sin, cos) = small_sin_cos::<false>(x);
            assert!(
                (sin - x.sin()).abs() < 1e-14 && (cos - x.cos()).abs() < 1e-14,
                "{x}"
            );
        }
    }
}
