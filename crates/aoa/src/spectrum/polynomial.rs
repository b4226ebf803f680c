//! Spectrum that every spectral method searches: `f(omega) = a(omega)^H M a(omega)`.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::side_by_side::Spectra;
use crate::linalg::matrix::Matrix;
use crate::list::List;

/// Number of Newton steps. Starting from eight points per antenna, each step doubles the number of
/// digits.
const NEWTON_STEPS: usize = 6;

/// For a Hermitian `M`, `f(omega) = a^H M a` is a trigonometric polynomial of degree N - 1. With
/// the sum `c_k` along the k-th off-diagonal of `M`, `f(omega) = c_0 + 2 Re sum_k c_k exp(-j k
/// omega)`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spectrum<const N: usize> {
    pub(crate) lags: [Complex64; N],
}

impl<const N: usize> Spectrum<N> {
    pub(crate) fn of_matrix(matrix: &Matrix<N>) -> Self {
        let mut lags = [Complex64::ZERO; N];
        for i in 0..N {
            for j in 0..=i {
                lags[i - j] += matrix[i][j];
            }
        }
        Self { lags }
    }

    /// Creates the spectrum of the projection onto orthonormal vectors, `M = sum u u^H`.
    pub(crate) fn of_subspace(vectors: &[[Complex64; N]]) -> Self {
        let mut lags = [Complex64::ZERO; N];
        for u in vectors {
            for i in 0..N {
                for j in 0..=i {
                    lags[i - j] += u[i] * u[j].conj();
                }
            }
        }
        Self { lags }
    }

    /// Returns `-f`, whose maxima are the minima of `f`.
    pub(crate) fn negated(&self) -> Self {
        Self {
            lags: self.lags.map(|lag| -lag),
        }
    }

    /// Returns `f` at one electrical angle.
    pub(crate) fn value(&self, phase_rad: f64) -> f64 {
        self.derivatives(Complex64::cis(-phase_rad)).0
    }

    /// Returns f, f', f'' at `rotation = exp(-j omega)`.
    fn derivatives(&self, rotation: Complex64) -> (f64, f64, f64) {
        let (mut f, mut df, mut ddf) = (0.5 * self.lags[0].re, 0.0, 0.0);
        let mut power = rotation;
        for (k, lag) in self.lags.iter().enumerate().skip(1) {
            let term = lag * power;
            let k = k as f64;
            f += term.re;
            df += k * term.im;
            ddf -= k * k * term.re;
            power *= rotation;
        }
        (2.0 * f, 2.0 * df, 2.0 * ddf)
    }

    /// Returns the electrical angle of the global maximum of `f`, and the maximum.
    pub(crate) fn maximum(&self) -> (f64, f64) {
        let single = Spectra::<N, 1> {
            re: self.lags.map(|lag| [lag.re]),
            im: self.lags.map(|lag| [lag.im]),
        };
        let place = single.maxima::<false>();
        (place.phase_rad[0], single.values::<false>(&place)[0])
    }

    /// Returns all local maxima as electrical angle and value. A polynomial of degree N - 1 has at
    /// most N - 1. No peak is missed: intervals are bisected until bounds on the derivatives prove
    /// that each contains at most one extremum.
    pub(crate) fn peaks(&self) -> List<(f64, f64), N> {
        let orders = self.lags.iter().enumerate();
        let third = orders.map(|(k, lag)| 2.0 * (k as f64).powi(3) * lag.norm());
        let search = PeakSearch {
            spectrum: self,
            third_derivative: third.sum(),
        };
        let mut peaks = List::empty((0.0, 0.0));
        if search.third_derivative > 0.0 {
            let intervals = 2 * N;
            let phase = |i: usize| TAU * i as f64 / intervals as f64 - PI;
            let mut low = (-PI, self.slope(-PI));
            for i in 1..=intervals {
                // The end of the last interval is bit-identical to the start of the first one, so
                // that no peak is lost or found twice.
                let high = (phase(i), self.slope(phase(i % intervals)));
                search.search_between(low, high, &mut peaks);
                low = high;
            }
        }
        peaks
    }

    fn slope(&self, phase_rad: f64) -> f64 {
        self.derivatives(Complex64::cis(-phase_rad)).1
    }

    /// Returns the local maximum within `reach` of `start` in (-pi, pi] by Newton's method.
    pub(crate) fn refined_maximum(&self, start: f64, reach: f64) -> f64 {
        let mut offset: f64 = 0.0;
        for _ in 0..NEWTON_STEPS {
            let (_, slope, curvature) = self.derivatives(Complex64::cis(-(start + offset)));
            // If the curvature is positive, move uphill by half of the reach.
            let newton = if curvature < 0.0 {
                -slope / curvature
            } else {
                slope.signum() * 0.5 * reach
            };
            let next = (offset + newton).clamp(-reach, reach);
            if !next.is_finite() || (next - offset).abs() < 1e-15 {
                break;
            }
            offset = next;
        }
        wrap(start + offset)
    }
}

/// Search for all local maxima.
struct PeakSearch<'a, const N: usize> {
    spectrum: &'a Spectrum<N>,
    /// Upper bound of the third derivative.
    third_derivative: f64,
}

impl<const N: usize> PeakSearch<'_, N> {
    /// Adds the maxima between two electrical angles, each given with its slope.
    fn search_between(&self, low: (f64, f64), high: (f64, f64), peaks: &mut List<(f64, f64), N>) {
        // Minimum distance of two extrema in rad.
        const CLOSEST_RAD: f64 = 1e-9;
        let (middle, half) = (0.5 * (low.0 + high.0), 0.5 * (high.0 - low.0));
        let (_, slope, curvature) = self.spectrum.derivatives(Complex64::cis(-middle));
        let curvature_varies = self.third_derivative * half;
        if slope.abs() > (curvature.abs() + 0.5 * curvature_varies) * half {
            return;
        }
        if curvature.abs() > 2.0 * curvature_varies || half < CLOSEST_RAD {
            if low.1 > 0.0 && high.1 <= 0.0 {
                let phase_rad = self.spectrum.refined_maximum(middle, half);
                peaks.push((phase_rad, self.spectrum.value(phase_rad)));
            }
            return;
        }
        self.search_between(low, (middle, slope), peaks);
        self.search_between((middle, slope), high, peaks);
    }
}

/// Wraps an angle into (-pi, pi].
pub(crate) fn wrap(angle_rad: f64) -> f64 {
    let wrapped = angle_rad - TAU * (angle_rad / TAU).round();
    if wrapped <= -PI {
        wrapped + TAU
    } else {
        wrapped
    }
}
