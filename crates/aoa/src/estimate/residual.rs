//! Residual of the covariance after one source, see [`GoodnessOfFit`](crate::GoodnessOfFit).

use num_complex::Complex64;

use crate::array::manifold::dot;
use crate::array::steering::aperture;
use crate::linalg::hermitians::{Hermitians, Vectors};
use crate::linalg::matrix::Matrix;
use crate::result::goodness_of_fit::Residual;
use crate::simd::math::times_plus;
use crate::spectrum::side_by_side::Places;

/// Residuals of `W` items with sources at `places`.
#[derive(Debug)]
pub(super) struct Residuals<const W: usize> {
    coherent: [f64; W],
    rest: [f64; W],
    rest_squared: [f64; W],
}

impl<const W: usize> Residuals<W> {
    #[inline(always)]
    pub(super) fn of<const FUSED: bool, const N: usize>(
        covariances: &Hermitians<N, W>,
        places: &Places<W>,
    ) -> Self {
        let steering = Vectors::<N, W>::steering::<FUSED>(&places.cos, &places.sin);
        // Compute R a, a^H R a and its derivative.
        let received = covariances.times::<FUSED>(&steering);
        let (mut beam, mut slope) = ([0.0; W], [0.0; W]);
        for n in 0..N {
            let place = n as f64 - 0.5 * (N - 1) as f64;
            for w in 0..W {
                let (a, b) = (steering.re[n][w], steering.im[n][w]);
                let (c, d) = (received.re[n][w], received.im[n][w]);
                beam[w] = times_plus::<FUSED>(a, c, times_plus::<FUSED>(b, d, beam[w]));
                let turned = times_plus::<FUSED>(a, d, -b * c);
                slope[w] = times_plus::<FUSED>(place, turned, slope[w]);
            }
        }
        let (mut inverse, mut coherent) = ([0.0; W], [0.0; W]);
        for w in 0..W {
            inverse[w] = 1.0 / beam[w];
            coherent[w] = slope[w] * slope[w] * (-1.0 / aperture::<N>());
        }
        for n in 0..N {
            for w in 0..W {
                let own = -beam[w] * (1.0 / N as f64);
                let re = times_plus::<FUSED>(own, steering.re[n][w], received.re[n][w]);
                let im = times_plus::<FUSED>(own, steering.im[n][w], received.im[n][w]);
                coherent[w] = times_plus::<FUSED>(re, re, times_plus::<FUSED>(im, im, coherent[w]));
            }
        }
        let (mut rest, mut rest_squared) = ([0.0; W], [0.0; W]);
        for i in 0..N {
            for j in 0..=i {
                let (re, im, _) = covariances.entries(i, j);
                let both = if i == j { 1.0 } else { 2.0 };
                for w in 0..W {
                    let (a, b) = (
                        received.re[i][w] * inverse[w],
                        received.im[i][w] * inverse[w],
                    );
                    let (c, d) = (received.re[j][w], received.im[j][w]);
                    let x = re[w] - times_plus::<FUSED>(a, c, b * d);
                    let y = im[w] - times_plus::<FUSED>(b, c, -a * d);
                    if i == j {
                        rest[w] += x;
                    }
                    let squared = times_plus::<FUSED>(x, x, y * y);
                    rest_squared[w] = times_plus::<FUSED>(both, squared, rest_squared[w]);
                }
            }
        }
        for w in 0..W {
            let positive = if coherent[w] > 0.0 { coherent[w] } else { 0.0 };
            coherent[w] = positive * inverse[w];
        }
        Self {
            coherent,
            rest,
            rest_squared,
        }
    }

    #[inline(always)]
    pub(super) const fn item(&self, w: usize) -> Residual {
        Residual {
            coherent: self.coherent[w],
            rest: self.rest[w],
            rest_squared: self.rest_squared[w],
        }
    }
}

/// Returns the residual of a source with any response. The tangents are the derivatives with
/// respect to the estimated parameters, orthogonal to the response.
pub(super) fn of_response<const N: usize>(
    matrix: &Matrix<N>,
    response: &[Complex64; N],
    tangents: &[[Complex64; N]],
) -> Residual {
    let received: [Complex64; N] = std::array::from_fn(|i| {
        let row = matrix[i].iter().zip(response);
        row.map(|(entry, a)| entry * a).sum()
    });
    let beam = dot(response, &received).re;
    let own = beam / dot(response, response).re;
    let mut left: [Complex64; N] = std::array::from_fn(|n| received[n] - response[n] * own);
    // The coefficients of the tangents are real.
    let mut taken: [Option<[Complex64; N]>; 2] = [None; 2];
    for (place, tangent) in taken.iter_mut().zip(tangents) {
        *place = Some(*tangent);
    }
    if let [Some(first), Some(second)] = &mut taken {
        let along = dot(first, second).re / dot(first, first).re.max(f64::MIN_POSITIVE);
        for (b, a) in second.iter_mut().zip(first) {
            *b -= *a * along;
        }
    }
    for tangent in taken.iter().flatten() {
        let power = dot(tangent, tangent).re.max(f64::MIN_POSITIVE);
        let along = dot(tangent, &left).re / power;
        for (element, step) in left.iter_mut().zip(tangent) {
            *element -= step * along;
        }
    }
    let (mut rest, mut rest_squared) = (0.0, 0.0);
    for i in 0..N {
        for j in 0..N {
            let entry = matrix[i][j] - received[i] * received[j].conj() / beam;
            rest_squared += entry.norm_sqr();
            if i == j {
                rest += entry.re;
            }
        }
    }
    Residual {
        coherent: dot(&left, &left).re / beam,
        rest,
        rest_squared,
    }
}
