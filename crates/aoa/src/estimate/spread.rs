//! Asymptotic variance of an electrical angle for each method, any correlation of the sources and
//! any averaging of the covariance.
//!
//! To first order, an angle is a linear function of the error of the sample covariance, `d omega =
//! tr(H dR)`. For Gaussian snapshots, `var tr(H R^) = tr(H R H R) / L`. With `w = Rs^+ a` and the
//! signal part `Rs` of the covariance, `H` is the Hermitian part of `w v^H`:
//!
//! - MUSIC and Root-MUSIC: `v = P d / (d^H P d)`, where `d` is the derivative of `a` and `P`
//!   projects onto the noise subspace (Stoica and Nehorai 1989; Rao and Hari 1989 for the roots).
//! - ESPRIT: `v^H = -j exp(-j omega) b^H`, where `b^H` is the source's row of `A1^+ ([0 I] - exp(j
//!   omega) [I 0])` and `A1` are the steering vectors without the last antenna (Rao and Hari 1989).
//!   Least squares and total least squares have equal variances.
//!
//! Maximum likelihood has a different `H`, see [`Fit::sensitivities`].
//!
//! An average over subarrays or a forward–backward average is linear in `R` and gives an average of
//! `H`.

use num_complex::Complex64;

use super::choice::Method;
use super::whole_array::WholeArray;
use crate::bound::steering_matrix;
use crate::linalg::dense::{adjoint, inverse, product};
use crate::linalg::eigen::HermitianEigen;
use crate::linalg::matrix::Matrix;
use crate::list::List;
use crate::method::alternating_projection::Fit;

/// Inputs of the asymptotic variance.
pub(super) struct Spread<'a, const M: usize> {
    /// Eigendecomposition of the averaged covariance.
    pub(super) eigen: &'a HermitianEigen<M>,
    pub(super) sources: usize,
    pub(super) noise_variance: f64,
    /// Whether the covariance was averaged forward and backward after the average over subarrays.
    pub(super) forward_backward: bool,
    /// Original covariance.
    pub(super) whole: &'a dyn WholeArray,
}

impl<const M: usize> Spread<'_, M> {
    /// Returns the standard deviations in rad; `None` if the steering vectors are linearly
    /// dependent.
    pub(super) fn phase_sigmas_rad(&self, method: Method, phases: &[f64]) -> Option<List<f64, M>> {
        let steering = steering_matrix::<M>(phases);
        let rotations = match method {
            Method::EspritLs | Method::EspritTls => Some(esprit_rows(&steering, phases)?),
            _ => None,
        };
        let mut sigmas = [0.0; M];
        for (k, sigma) in sigmas[..phases.len()].iter_mut().enumerate() {
            let a: [Complex64; M] = std::array::from_fn(|n| steering[n][k]);
            let v = match &rotations {
                Some(rows) => rows[k].map(|it| it.conj()),
                None => self.towards_noise(&a)?,
            };
            let w = self.of_signal(&a);
            let h = std::array::from_fn(|i| {
                std::array::from_fn(|j| (w[i] * v[j].conj() + v[i] * w[j].conj()) * 0.5)
            });
            *sigma = self.variance(&h).sqrt();
        }
        let determined = sigmas[..phases.len()].iter().all(|it| it.is_finite());
        determined.then(|| List::collect(0.0, sigmas[..phases.len()].iter().copied()))
    }

    /// Returns the standard deviations of maximum likelihood in rad.
    pub(super) fn of_maximum_likelihood(&self, likelihood: &Fit<M>) -> Option<List<f64, M>> {
        let mut sigmas = List::empty(0.0);
        likelihood.sensitivities(|h| sigmas.push(self.variance(h).sqrt()))?;
        sigmas.iter().all(|it| it.is_finite()).then_some(sigmas)
    }

    /// Returns the mean fraction of the weakest signal eigenvector that noise mixes into it:
    /// `sigma^2 l / (L (l - sigma^2)^2)` for each dimension of the noise subspace.
    pub(super) fn mixing(&self) -> f64 {
        let weakest = self.eigen.values[self.sources - 1];
        let gap = weakest - self.noise_variance;
        let each = self.noise_variance * weakest / (self.whole.snapshots() as f64 * gap * gap);
        each * (M - self.sources) as f64
    }

    /// Returns `P d / (d^H P d)`.
    fn towards_noise(&self, a: &[Complex64; M]) -> Option<[Complex64; M]> {
        let derivative: [Complex64; M] =
            std::array::from_fn(|n| a[n] * Complex64::new(0.0, n as f64));
        let mut projected = [Complex64::ZERO; M];
        for vector in &self.eigen.vectors[self.sources..] {
            add(&mut projected, vector, dot(vector, &derivative));
        }
        let power = dot(&projected, &derivative).re;
        (power > 0.0).then(|| projected.map(|it| it / power))
    }

    /// Returns `Rs^+ a`.
    fn of_signal(&self, a: &[Complex64; M]) -> [Complex64; M] {
        let mut result = [Complex64::ZERO; M];
        let eigen = self.eigen.values.iter().zip(&self.eigen.vectors);
        for (value, vector) in eigen.take(self.sources) {
            let signal = (value - self.noise_variance).max(f64::MIN_POSITIVE);
            add(&mut result, vector, dot(vector, a) / signal);
        }
        result
    }

    /// Returns the variance for the `H` of the averaged covariance.
    fn variance(&self, of_average: &Matrix<M>) -> f64 {
        let mut h = *of_average;
        if self.forward_backward {
            for i in 0..M {
                for j in 0..M {
                    let mirrored = of_average[M - 1 - i][M - 1 - j].conj();
                    h[i][j] = (of_average[i][j] + mirrored) * 0.5;
                }
            }
        }
        self.whole.variance(h.as_flattened(), M)
    }
}

/// Returns ESPRIT's `-j exp(-j omega) b^H` of every source; see the module documentation.
fn esprit_rows<const M: usize>(
    steering: &Matrix<M>,
    phases: &[f64],
) -> Option<[[Complex64; M]; M]> {
    let sources = phases.len();
    let adjoint_steering = adjoint(steering);
    let gram = product(&adjoint_steering, steering, [sources, M - 1, sources]);
    let pseudo_inverse = product(
        &inverse(gram, sources)?,
        &adjoint_steering,
        [sources, sources, M - 1],
    );
    let mut rows = [[Complex64::ZERO; M]; M];
    for (k, (row, phase)) in rows.iter_mut().zip(phases).enumerate() {
        let rotation = Complex64::cis(*phase);
        let turn = Complex64::new(0.0, -1.0) * rotation.conj();
        for n in 0..M - 1 {
            row[n + 1] += pseudo_inverse[k][n] * turn;
            row[n] -= pseudo_inverse[k][n] * rotation * turn;
        }
    }
    Some(rows)
}

/// Returns `a^H b`.
fn dot<const M: usize>(a: &[Complex64; M], b: &[Complex64; M]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

fn add<const M: usize>(to: &mut [Complex64; M], vector: &[Complex64; M], scale: Complex64) {
    for (sum, element) in to.iter_mut().zip(vector) {
        *sum += element * scale;
    }
}
