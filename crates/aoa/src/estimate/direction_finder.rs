//! Maximum likelihood estimate of azimuth and elevation of one source for an array of any shape.

use num_complex::Complex64;

use super::pilots::checked_noise_variance;
use super::residual;
use crate::array::manifold::{Direction, Manifold, Neighbourhood, dot, evenly_spread};
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::matrix::Matrix;
use crate::method::maximum_likelihood::{residual_power, snr};
use crate::result::azimuth_elevation::DirectionEstimate;
use crate::result::direction::{threshold_doubt, verdict};
use crate::result::goodness_of_fit::{Model, Residual};
use crate::result::verdict::Reason;

/// Spacing of the initial search grid, in units of the array's resolution. The nearest grid point
/// receives at least nine tenths of a source's power.
const SPACING: f64 = 0.44;
/// Minimum likelihood ratio of the best direction to another direction outside its main lobe.
const LIKELIER: f64 = 100.0;
/// Maximum number of ascent steps. Each step reduces the error to the order of the noise.
const STEPS: usize = 40;
/// Step size in rad that ends the ascent, far below the displacement by any noise.
const SETTLED_RAD: f64 = 1e-9;

/// Estimator of directions with the manifold `M` of `N` antennas.
///
/// Create it once per array: it stores the responses of the initial search grid.
///
/// ```
/// use aoa::{ArbitraryArray, Complex64, Covariance, Direction, DirectionFinder, Manifold};
///
/// let array = ArbitraryArray::<5>::circular(0.4)?;
/// let finder = DirectionFinder::new(array, [0.0, 1.5])?;
/// let response = array.response(Direction::new(2.0, 0.3));
/// let snapshots = [response, response.map(|it| it * Complex64::I)];
/// let found = finder.estimate(&Covariance::from_snapshots(&snapshots)?)?;
/// assert!((found.direction.azimuth_rad - 2.0).abs() < 1e-6);
/// assert!((found.direction.elevation_rad - 0.3).abs() < 1e-6);
/// # Ok::<(), aoa::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct DirectionFinder<M, const N: usize> {
    manifold: M,
    elevations_rad: [f64; 2],
    resolution_rad: f64,
    /// Grid of directions, with the responses normalised to unit length.
    grid: Vec<(Direction, [Complex64; N])>,
}

/// Direction during the ascent.
pub(super) struct Candidate<const N: usize> {
    pub(super) direction: Direction,
    around: Neighbourhood<N>,
    /// Beamformer power, `a^H R a / a^H a`.
    beam: f64,
}

impl<M: Manifold<N>, const N: usize> DirectionFinder<M, N> {
    /// Creates an estimator for the elevations from the first to the second value in rad. With
    /// equal values, only the azimuth is estimated. A horizontal planar array cannot distinguish
    /// directions above and below, so that the range must contain one of both only.
    ///
    /// # Errors
    /// [`Error::Elevations`].
    pub fn new(manifold: M, elevations_rad: [f64; 2]) -> Result<Self, Error> {
        let [lowest, highest] = elevations_rad;
        let most = std::f64::consts::FRAC_PI_2 + 1e-9;
        if !(-most <= lowest && lowest <= highest && highest <= most) {
            return Err(Error::Elevations { lowest, highest });
        }
        // The limit of the resolution keeps the grid below about 1 MB for an array of any size.
        let resolution_rad = manifold.resolution_rad().clamp(0.02, 1.0);
        let grid = evenly_spread(elevations_rad, SPACING * resolution_rad)
            .into_iter()
            .map(|direction| {
                let response = manifold.response(direction);
                let length = dot(&response, &response).re.sqrt();
                (direction, response.map(|element| element / length))
            })
            .collect();
        Ok(Self {
            manifold,
            elevations_rad,
            resolution_rad,
            grid,
        })
    }

    /// Returns the manifold.
    pub const fn manifold(&self) -> &M {
        &self.manifold
    }

    /// Returns the direction of the strongest source: the maximum of `a^H R a / a^H a`.
    ///
    /// The covariance is that of the received snapshots; the manifold includes the channel gains.
    ///
    /// # Errors
    /// An error if the covariance is empty, zero or not finite.
    pub fn estimate(&self, covariance: &Covariance<N>) -> Result<DirectionEstimate, Error> {
        self.strongest(covariance, None)
    }

    /// Returns the direction from despread pilots, like
    /// [`maximum_likelihood_pilots`](crate::maximum_likelihood_pilots) for a linear array. A known
    /// noise variance per antenna and block determines the covariance and the verdict.
    ///
    /// # Errors
    /// [`Error::NotPositive`] for an invalid noise variance; errors of
    /// [`Covariance::from_snapshots`].
    pub fn estimate_pilots(
        &self,
        blocks: &[[Complex64; N]],
        noise_variance: Option<f64>,
    ) -> Result<DirectionEstimate, Error> {
        let noise_variance = noise_variance.map(checked_noise_variance).transpose()?;
        self.strongest(&Covariance::from_snapshots(blocks)?, noise_variance)
    }

    fn strongest(
        &self,
        covariance: &Covariance<N>,
        noise_variance: Option<f64>,
    ) -> Result<DirectionEstimate, Error> {
        let covariance = covariance.validated()?;
        let noise = noise_variance.map(|variance| variance * covariance.weight());
        let matrix = covariance.unscaled();
        let trace = covariance.power() * covariance.weight() * N as f64;
        let powers: Vec<f64> = self.grid.iter().map(|(_, a)| power(matrix, a)).collect();
        let ascend_from_best = |allowed: &dyn Fn(&Direction) -> bool| {
            let mut best: Option<(f64, Direction)> = None;
            for ((direction, _), power) in self.grid.iter().zip(&powers) {
                // Whether a direction is allowed takes longer to compute than its power.
                let is_better = best.is_none_or(|(most, _)| power.total_cmp(&most).is_ge());
                if is_better && allowed(direction) {
                    best = Some((*power, *direction));
                }
            }
            best.map(|(_, direction)| self.ascend(matrix, trace, direction))
        };
        let mut best = ascend_from_best(&|_| true).ok_or(Error::Singular)?;
        let mut other = ascend_from_best(&|direction| best.is_far_from(direction));
        if let Some(other) = other.as_mut().filter(|other| other.beam > best.beam) {
            std::mem::swap(&mut best, other);
        }
        let snapshots = covariance.snapshots();
        let noise_power = noise.unwrap_or_else(|| residual_power::<N>(trace, best.beam));
        let snr = snr::<N>(best.beam, noise_power);
        let model = Model::new::<N>(
            [1, if self.is_level() { 1 } else { 2 }],
            snapshots,
            noise.is_some(),
        );
        let tests = model.tests();
        let needed = tests.needed_snr(bound::resolvable_snr::<N>(snapshots));
        let noise_covariance = bound::covariance_around(
            &best.around,
            best.direction,
            snr,
            snapshots,
            !self.is_level(),
        )
        .map(|row| row.map(|it| it * tests.variance_factor(snr, needed)));
        let is_ambiguous = other
            .filter(|other| best.is_far_from(&other.direction))
            .is_some_and(|other| {
                let per_snapshot = match noise {
                    Some(noise) => (best.beam - other.beam) / noise,
                    None => log_likelihood_ratio::<N>(trace, best.beam, other.beam),
                };
                per_snapshot * (snapshots as f64) < LIKELIER.ln()
            });
        let at_edge = self.is_at_edge(best.direction, &noise_covariance);
        let left = best.residual(matrix, usize::from(model.parameters));
        let tested = tests.of(&left, noise_power, trace);
        let misfit = tests.misfit(tested.ratios());
        let weak = threshold_doubt(snr, needed).or(tests.noise_doubt());
        let geometric = if is_ambiguous {
            Some(Reason::Ambiguous)
        } else {
            at_edge.then_some(Reason::EdgeOfElevations)
        };
        Ok(DirectionEstimate {
            direction: best.direction,
            covariance: noise_covariance.map(|row| row.map(|it| it * tested.inflation)),
            noise_covariance,
            snr_db: 10.0 * snr.log10(),
            fit: tests.fit(&tested),
            verdict: verdict(weak, geometric, misfit),
        })
    }

    /// Returns an estimator with equal settings for another manifold, with an empty grid.
    pub(super) const fn with_manifold<L>(&self, manifold: L) -> DirectionFinder<L, N> {
        DirectionFinder {
            manifold,
            elevations_rad: self.elevations_rad,
            resolution_rad: self.resolution_rad,
            grid: Vec::new(),
        }
    }

    /// Returns the grid of directions, with the responses normalised to unit length.
    pub(super) fn grid(&self) -> &[(Direction, [Complex64; N])] {
        &self.grid
    }

    /// Whether the source may be outside the range of elevations. The zenith is not a limit.
    pub(super) fn is_at_edge(&self, direction: Direction, covariance: &[[f64; 2]; 2]) -> bool {
        let [lowest, highest] = self.elevations_rad;
        let margin = 3.0 * covariance[1][1].sqrt();
        let low = direction.elevation_rad - margin < lowest && lowest > -1.57;
        let high = direction.elevation_rad + margin > highest && highest < 1.57;
        !self.is_level() && (low || high)
    }

    /// Whether the elevation is fixed.
    pub(super) fn is_level(&self) -> bool {
        self.elevations_rad[0] == self.elevations_rad[1]
    }

    fn candidate(&self, matrix: &Matrix<N>, direction: Direction) -> Candidate<N> {
        let around = Neighbourhood::of(&self.manifold, direction);
        let beam = power(matrix, &around.response) / around.power;
        Candidate {
            direction,
            around,
            beam,
        }
    }

    /// Maximises the power by Fisher scoring: the step is the slope divided by the expected
    /// curvature, halved until the power increases.
    pub(super) fn ascend(&self, matrix: &Matrix<N>, trace: f64, start: Direction) -> Candidate<N> {
        let mut here = self.candidate(matrix, start);
        for _ in 0..STEPS {
            let mut step = self.scoring_step(matrix, trace, &here);
            let mut next = self.candidate(matrix, self.moved(here.direction, step));
            while next.beam < here.beam && step[0].hypot(step[1]) > SETTLED_RAD {
                step = step.map(|it| 0.5 * it);
                next = self.candidate(matrix, self.moved(here.direction, step));
            }
            let moved = here.direction.step_to(&next.direction);
            if next.beam >= here.beam {
                here = next;
            }
            if moved[0].hypot(moved[1]) <= SETTLED_RAD {
                break;
            }
        }
        here
    }

    /// Returns a step limited to the range of elevations. A step beyond the limit ends half-way to
    /// the limit, because the slope may vanish at the limit itself.
    fn moved(&self, from: Direction, step: [f64; 2]) -> Direction {
        let [lowest, highest] = self.elevations_rad;
        let to = from.moved(step);
        let elevation_rad = if to.elevation_rad < lowest {
            0.5 * (from.elevation_rad + lowest)
        } else if to.elevation_rad > highest {
            0.5 * (from.elevation_rad + highest)
        } else {
            to.elevation_rad
        };
        Direction::new(to.azimuth_rad, elevation_rad)
    }

    fn scoring_step(&self, matrix: &Matrix<N>, trace: f64, here: &Candidate<N>) -> [f64; 2] {
        let around = &here.around;
        let received: [Complex64; N] = std::array::from_fn(|i| {
            matrix[i]
                .iter()
                .zip(&around.response)
                .map(|(entry, a)| entry * a)
                .sum()
        });
        let slope = [0, 1].map(|i: usize| {
            let tangent = &around.tangents[i];
            let along = dot(tangent, &received) - dot(tangent, &around.response) * here.beam;
            2.0 * along.re / around.power
        });
        let signal = here.beam - residual_power::<N>(trace, here.beam);
        // Without a source the curvature is small, so that the step must be limited.
        let curvature = 2.0 * signal.max(0.1 * here.beam) / around.power;
        let [[a, b], [_, c]] = around.metric.map(|row| row.map(|it| it * curvature));
        let longest = 0.5 * self.resolution_rad;
        let bounded = |step: f64| step.clamp(-longest, longest);
        let elevation = if self.is_level() {
            0.0
        } else {
            // The ridge keeps a parameter without influence (elevation at the horizon) unchanged.
            let ridge = 1e-9 * (a + c);
            let determinant = (a + ridge) * (c + ridge) - b * b;
            bounded(((a + ridge) * slope[1] - b * slope[0]) / determinant)
        };
        // Use the limited elevation step: near the horizon it may be much shorter than the
        // unlimited one, and must not shorten the azimuth step.
        let step = [bounded((slope[0] - b * elevation) / a), elevation];
        if step.iter().all(|it| it.is_finite()) {
            step
        } else {
            [0.0; 2]
        }
    }
}

impl<const N: usize> Candidate<N> {
    /// Returns the residual after subtraction of a source; `parameters` is the number of estimated
    /// direction parameters.
    fn residual(&self, matrix: &Matrix<N>, parameters: usize) -> Residual {
        let Neighbourhood {
            response,
            power,
            tangents,
            ..
        } = &self.around;
        let tangents = tangents.map(|tangent| {
            let along = dot(response, &tangent) / power;
            std::array::from_fn(|n| tangent[n] - response[n] * along)
        });
        residual::of_response(matrix, response, &tangents[..parameters])
    }

    /// Whether the other direction is outside the main lobe, where the first-order expansion of the
    /// response is invalid.
    fn is_far_from(&self, direction: &Direction) -> bool {
        let [x, y] = self.direction.step_to(direction);
        let [[a, b], [_, c]] = self.around.metric;
        a * x * x + 2.0 * b * x * y + c * y * y > self.around.power
    }
}

/// Returns `a^H R a`.
pub(super) fn power<const N: usize>(matrix: &Matrix<N>, a: &[Complex64; N]) -> f64 {
    let mut power = 0.0;
    for i in 0..N {
        let mut row = Complex64::ZERO;
        for j in 0..i {
            row += matrix[i][j] * a[j];
        }
        power += 2.0 * (a[i].conj() * row).re + matrix[i][i].re * a[i].norm_sqr();
    }
    power
}

/// Returns the logarithm of the likelihood ratio of two directions per snapshot. The concentrated
/// log-likelihood of a direction is `-ln(beam) - (N - 1) ln(noise)` (Jaffer 1988).
fn log_likelihood_ratio<const N: usize>(trace: f64, best: f64, other: f64) -> f64 {
    let noise = |beam: f64| (trace - beam).max(trace * 1e-15);
    (N - 1) as f64 * (noise(other) / noise(best)).ln() - (best / other).ln()
}
