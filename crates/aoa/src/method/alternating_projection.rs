//! Maximum likelihood estimate of several sources with unknown waveforms: the minimum over the
//! electrical angles of `V = tr(P R)`, where `P` projects onto the complement of the steering
//! vectors.
//!
//! Alternating projection (Ziskind and Wax 1988) gives initial angles: in turn, each angle is moved
//! to the maximum of the power that the other sources leave. Scoring steps complete the search
//! (Viberg, Ottersten and Kailath 1991). With the pseudo-inverse `A+` and the derivatives `D`,
//! slope and curvature are
//!
//! `V' = -2 Re diag(A+ R P D)`, `V'' = 2 Re[(D^H P D) * (A+ R A+^H)^T]`.
//!
//! Coherent sources require no averaging.

use num_complex::Complex64;

use crate::array::steering::steering_vector;
use crate::bound::steering_matrix;
use crate::linalg::dense::{adjoint, inverse, product};
use crate::linalg::matrix::{Matrix, zeros};
use crate::list::List;
use crate::result::goodness_of_fit::Residual;
use crate::spectrum::polynomial::wrap;

/// Number of search directions on the circle per antenna.
const DIRECTIONS: usize = 8;
/// Maximum number of rounds of alternating projection; each reduces the error to the order of the
/// noise.
const ROUNDS: usize = 20;
/// Maximum number of scoring steps.
const STEPS: usize = 40;
/// Change in rad below which scoring steps replace alternating projection.
const NEAR_RAD: f64 = 1e-2;
/// Relative increase of `V` that is attributed to rounding.
const ROUNDING: f64 = 1e-12;
/// Step size in rad that ends the search.
const SETTLED_RAD: f64 = 1e-10;

/// Likelihood near the directions of sources, each with an equal number of parameters.
pub(crate) struct Fit<const N: usize> {
    sources: usize,
    /// Number of parameters of all sources; the parameters of one source are adjacent.
    parameters: usize,
    /// Pseudo-inverse `A+`, sources by antennas.
    pseudo_inverse: Matrix<N>,
    /// `P D`, antennas by parameters.
    projected: Matrix<N>,
    /// `D^H P D`, parameters by parameters.
    metric: Matrix<N>,
    /// `A+ R A+^H`, sources by sources.
    powers: Matrix<N>,
    /// `(A^H A)^-1`, sources by sources.
    gram_inverse: Matrix<N>,
    /// `V'`.
    slope: [f64; N],
    /// Covariance `R`.
    matrix: Matrix<N>,
    /// `A+ R`, sources by antennas.
    received: Matrix<N>,
    /// Residual power `V`.
    residual: f64,
}

impl<const N: usize> Fit<N> {
    /// Creates the fit at electrical angles; `None` if the steering vectors are linearly dependent.
    pub(crate) fn at(matrix: &Matrix<N>, phases: &[f64]) -> Option<Self> {
        let steering = steering_matrix::<N>(phases);
        let mut derivative = steering;
        for (n, row) in derivative.iter_mut().enumerate() {
            for element in row {
                *element *= Complex64::new(0.0, n as f64);
            }
        }
        Self::around(matrix, (&steering, &derivative), [phases.len(); 2])
    }

    /// Creates the fit from the responses `A` of the sources and their derivatives `D` with respect
    /// to all parameters, both as columns.
    pub(crate) fn around(
        matrix: &Matrix<N>,
        (steering, derivative): (&Matrix<N>, &Matrix<N>),
        [k, parameters]: [usize; 2],
    ) -> Option<Self> {
        let steering_h = adjoint(steering);
        let gram_inverse = inverse(product(&steering_h, steering, [k, N, k]), k)?;
        let pseudo_inverse = product(&gram_inverse, &steering_h, [k, k, N]);
        let within = product(&pseudo_inverse, derivative, [k, N, parameters]);
        let removed = product(steering, &within, [N, k, parameters]);
        let mut projected = *derivative;
        for (row, removed) in projected.iter_mut().zip(removed) {
            for (entry, removed) in row.iter_mut().zip(removed) {
                *entry -= removed;
            }
        }
        let received = product(&pseudo_inverse, matrix, [k, N, N]);
        let slopes = product(&received, &projected, [k, N, parameters]);
        let explained = product(&received, steering, [k, N, k]);
        let trace: f64 = (0..N).map(|n| matrix[n][n].re).sum();
        let explained: f64 = (0..k).map(|i| explained[i][i].re).sum();
        Some(Self {
            sources: k,
            parameters,
            metric: product(
                &adjoint(derivative),
                &projected,
                [parameters, N, parameters],
            ),
            powers: product(&received, &adjoint(&pseudo_inverse), [k, N, k]),
            slope: std::array::from_fn(|i| -2.0 * slopes[i * k / parameters][i].re),
            matrix: *matrix,
            received,
            residual: (trace - explained).max(trace * 1e-15),
            pseudo_inverse,
            projected,
            gram_inverse,
        })
    }

    /// Returns the residual and the resulting noise variance per antenna, in the scale of the
    /// fitted matrix. Returns `None` if the source covariance is singular.
    ///
    /// With `H = P R A+^H`, regressed on the waveforms `S = A+ R A+^H`, the part that is correlated
    /// with the waveforms is `tr(H S^-1 H^H)`. The choice of the angles removes `V'^T V''^-1 V' /
    /// 2` of this part, without the noise in `V''`.
    pub(crate) fn residual(&self) -> Option<(Residual, f64)> {
        let k = self.sources;
        let inverse_powers = inverse(self.powers, k)?;
        // R A+^H, N by k.
        let received = adjoint(&self.received);
        let weighted = product(&received, &inverse_powers, [N, k, k]);
        let explained = product(&weighted, &self.received, [N, k, N]);
        let (mut rest, mut rest_squared) = (0.0, 0.0);
        for i in 0..N {
            for j in 0..N {
                let entry = self.matrix[i][j] - explained[i][j];
                rest_squared += entry.norm_sqr();
                if i == j {
                    rest += entry.re;
                }
            }
        }
        let inverse_curvature = self.inverse_curvature(0.0)?;
        let mut taken = 0.0;
        for i in 0..self.parameters {
            for j in 0..self.parameters {
                taken += 0.5 * self.slope[i] * inverse_curvature[i][j].re * self.slope[j];
            }
        }
        let residual = Residual {
            coherent: (self.residual - rest - taken).max(0.0),
            rest,
            rest_squared,
        };
        Some((residual, self.noise_variance()))
    }

    /// Returns the noise variance per antenna.
    pub(crate) fn noise_variance(&self) -> f64 {
        self.residual / (N - self.sources) as f64
    }

    /// Returns the source to which a parameter belongs.
    const fn owner(&self, parameter: usize) -> usize {
        parameter * self.sources / self.parameters
    }

    /// Returns the SNR of a source.
    pub(crate) fn snr(&self, source: usize) -> f64 {
        let noise = self.noise_variance();
        let power = self.powers[source][source].re - self.gram_inverse[source][source].re * noise;
        (power / noise).max(1e-9)
    }

    /// Returns the inverse of the curvature for sources with the covariance `A+ R A+^H` minus the
    /// noise's contribution.
    fn inverse_curvature(&self, noise_variance: f64) -> Option<Matrix<N>> {
        let mut curvature = zeros::<N>();
        for i in 0..self.parameters {
            for j in 0..self.parameters {
                let (a, b) = (self.owner(i), self.owner(j));
                let source = self.powers[b][a] - self.gram_inverse[b][a] * noise_variance;
                curvature[i][j] = (2.0 * (self.metric[i][j] * source).re).into();
            }
        }
        inverse(curvature, self.parameters)
    }

    /// Calls `visit` for each parameter with the Hermitian `H` of its first-order dependence on the
    /// covariance, `d omega = tr(H dR)`: `-V''^-1 dV'`. Returns `None` if the curvature is
    /// singular.
    pub(crate) fn sensitivities(&self, mut visit: impl FnMut(&Matrix<N>)) -> Option<()> {
        let inverse_curvature = self.inverse_curvature(self.noise_variance())?;
        for k in 0..self.parameters {
            let mut weighted = zeros::<N>();
            for s in 0..self.parameters {
                let weight = inverse_curvature[k][s];
                let pseudo_inverse = &self.pseudo_inverse[self.owner(s)];
                for i in 0..N {
                    for j in 0..N {
                        weighted[i][j] += self.projected[i][s] * pseudo_inverse[j] * weight;
                    }
                }
            }
            let mirrored = adjoint(&weighted);
            let h =
                std::array::from_fn(|i| std::array::from_fn(|j| weighted[i][j] + mirrored[i][j]));
            visit(&h);
        }
        Some(())
    }
}

/// Returns the electrical angles of `sources` sources; `None` for zero sources or at least as many
/// as antennas.
pub(crate) fn phases<const N: usize>(matrix: &Matrix<N>, sources: usize) -> Option<List<f64, N>> {
    if !(1..N).contains(&sources) {
        return None;
    }
    let mut phases = [0.0; N];
    for k in 0..sources {
        phases[k] = Beam::with_nulls(&phases[..k]).strongest(matrix);
    }
    for _ in 0..ROUNDS {
        let mut moved = 0.0_f64;
        for k in 0..sources {
            let mut others = phases;
            others[k..sources].rotate_left(1);
            let phase = Beam::with_nulls(&others[..sources - 1]).strongest(matrix);
            moved = moved.max(wrap(phase - phases[k]).abs());
            phases[k] = phase;
        }
        if sources == 1 || moved < NEAR_RAD {
            break;
        }
    }
    refine_phases(matrix, &mut phases[..sources]);
    Some(List::collect(0.0, phases[..sources].iter().copied()))
}

/// Applies scoring steps, halved until `V` decreases.
fn refine_phases<const N: usize>(matrix: &Matrix<N>, phases: &mut [f64]) {
    let Some(mut here) = Fit::<N>::at(matrix, phases) else {
        return;
    };
    for _ in 0..STEPS {
        // Without subtraction of the noise, the curvature is positive definite for all angles.
        let Some(inverse_curvature) = here.inverse_curvature(0.0) else {
            return;
        };
        let mut step = [0.0; N];
        for (step, row) in step.iter_mut().zip(&inverse_curvature).take(phases.len()) {
            let along = row.iter().zip(&here.slope).take(phases.len());
            *step = -along.map(|(entry, slope)| entry.re * slope).sum::<f64>();
        }
        let mut longest = step
            .iter()
            .fold(0.0_f64, |longest, it| longest.max(it.abs()));
        loop {
            if longest.is_nan() || longest < SETTLED_RAD {
                return;
            }
            let mut there = [0.0; N];
            for (there, (phase, step)) in there.iter_mut().zip(phases.iter().zip(step)) {
                *there = phase + step;
            }
            let next = Fit::<N>::at(matrix, &there[..phases.len()]);
            let most = here.residual * (1.0 + ROUNDING);
            if let Some(next) = next.filter(|next| next.residual <= most) {
                for (phase, there) in phases.iter_mut().zip(there) {
                    *phase = wrap(there);
                }
                here = next;
                break;
            }
            step = step.map(|it| 0.5 * it);
            longest *= 0.5;
        }
    }
}

/// Beam with nulls in several directions: orthonormal basis of their steering vectors.
struct Beam<const N: usize>(List<[Complex64; N], N>);

impl<const N: usize> Beam<N> {
    fn with_nulls(phases: &[f64]) -> Self {
        let mut beam = Self(List::empty([Complex64::ZERO; N]));
        for &phase in phases {
            let (left, power) = beam.left_of(phase);
            if power > 1e-12 {
                beam.0.push(left.map(|element| element / power.sqrt()));
            }
        }
        beam
    }

    /// Returns the part of a steering vector orthogonal to the nulls, and its power.
    fn left_of(&self, phase: f64) -> ([Complex64; N], f64) {
        let mut left = steering_vector::<N>(phase);
        for vector in self.0.iter() {
            let along: Complex64 = vector.iter().zip(&left).map(|(q, a)| q.conj() * a).sum();
            for (element, q) in left.iter_mut().zip(vector) {
                *element -= q * along;
            }
        }
        let power = left.iter().map(Complex64::norm_sqr).sum();
        (left, power)
    }

    /// Returns the power from a direction; 0 near a null.
    fn power(&self, matrix: &Matrix<N>, phase: f64) -> f64 {
        let (left, power) = self.left_of(phase);
        if power < 1e-6 * N as f64 {
            return 0.0;
        }
        let mut sum = 0.0;
        for (row, a) in matrix.iter().zip(&left) {
            let received: Complex64 = row.iter().zip(&left).map(|(r, b)| r * b).sum();
            sum += (a.conj() * received).re;
        }
        sum / power
    }

    /// Returns the direction of maximum power: the best point of a grid, refined by golden section
    /// search.
    fn strongest(&self, matrix: &Matrix<N>) -> f64 {
        let spacing = std::f64::consts::TAU / (DIRECTIONS * N) as f64;
        let power = |phase: f64| self.power(matrix, phase);
        let grid = (0..DIRECTIONS * N).map(|i| i as f64 * spacing);
        let best = grid.map(|phase| (power(phase), phase));
        let (_, best) = best.fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (best - spacing, best + spacing);
        while high - low > 0.1 * NEAR_RAD {
            let inner = [high - golden * (high - low), low + golden * (high - low)];
            if power(inner[0]) > power(inner[1]) {
                high = inner[1];
            } else {
                low = inner[0];
            }
        }
        wrap(0.5 * (low + high))
    }
}
