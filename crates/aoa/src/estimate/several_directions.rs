//! Maximum likelihood estimate of azimuth and elevation of several sources for an array of any
//! shape.

use num_complex::Complex64;

use super::direction_finder::{DirectionFinder, power};
use crate::array::manifold::{Direction, Manifold, Neighbourhood, dot};
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::dense::product;
use crate::linalg::matrix::{Matrix, zeros};
use crate::list::List;
use crate::method::alternating_projection::Fit;
use crate::result::azimuth_elevation::DirectionEstimate;
use crate::result::direction::{threshold_doubt, verdict};
use crate::result::goodness_of_fit::{Model, Tested};
use crate::result::verdict::Reason;

/// Maximum number of rounds of alternating projection.
const ROUNDS: usize = 300;
/// Step size in rad that ends the iteration, far below the displacement by any noise.
const SETTLED_RAD: f64 = 1e-8;

/// Maximum number of initial directions of the first source.
const FIRSTS: usize = 64;

/// Response of an array orthogonal to the responses of other directions.
struct ProjectedManifold<'a, M, const N: usize> {
    manifold: &'a M,
    /// Orthonormal basis of the responses of the other directions.
    others: List<[Complex64; N], N>,
}

impl<'a, M: Manifold<N>, const N: usize> ProjectedManifold<'a, M, N> {
    fn new(manifold: &'a M, directions: impl Iterator<Item = Direction>) -> Self {
        let mut projected = Self {
            manifold,
            others: List::empty([Complex64::ZERO; N]),
        };
        for direction in directions {
            projected.add(manifold.response(direction));
        }
        projected
    }

    fn add(&mut self, response: [Complex64; N]) {
        let left = self.left_of(response);
        let length = dot(&left, &left).re.sqrt();
        if length > 1e-6 {
            self.others.push(left.map(|element| element / length));
        }
    }

    fn left_of(&self, mut response: [Complex64; N]) -> [Complex64; N] {
        for other in self.others.iter() {
            let along = dot(other, &response);
            for (element, q) in response.iter_mut().zip(other) {
                *element -= q * along;
            }
        }
        response
    }

    /// Returns the response of unit length with the largest remaining power, and the power.
    fn strongest<'g>(
        &self,
        matrix: &Matrix<N>,
        grid: &'g [(Direction, [Complex64; N])],
    ) -> Option<(f64, &'g (Direction, [Complex64; N]))> {
        let beams = grid.iter().filter_map(|point| {
            let left = self.left_of(point.1);
            let length = dot(&left, &left).re;
            // Skip directions whose response is almost in the span of the others.
            (length > 1e-3).then(|| (power(matrix, &left) / length, point))
        });
        beams.max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

impl<M: Manifold<N>, const N: usize> Manifold<N> for ProjectedManifold<'_, M, N> {
    fn response(&self, direction: Direction) -> [Complex64; N] {
        self.left_of(self.manifold.response(direction))
    }

    fn resolution_rad(&self) -> f64 {
        self.manifold.resolution_rad()
    }
}

impl<M: Manifold<N>, const N: usize> DirectionFinder<M, N> {
    /// Returns the directions of `sources` sources, including coherent ones, in order of ascending
    /// azimuth. The estimate minimises `tr(P R)` by alternating projection (Ziskind and Wax 1988).
    ///
    /// ```
    /// use aoa::{ArbitraryArray, Covariance, Direction, DirectionFinder, Manifold};
    ///
    /// let array = ArbitraryArray::<6>::circular(0.5)?;
    /// let finder = DirectionFinder::new(array, [0.0, 0.0])?;
    /// let [a, b] = [-1.0, 2.0].map(|azimuth| array.response(Direction::new(azimuth, 0.0)));
    /// let found = finder.estimate_several(&Covariance::from_snapshots(&[a, b])?, 2)?;
    /// assert!((found[0].direction.azimuth_rad + 1.0).abs() < 1e-6);
    /// assert!((found[1].direction.azimuth_rad - 2.0).abs() < 1e-6);
    /// # Ok::<(), aoa::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::TooManySources`] unless there are fewer sources than antennas and at most as many
    /// parameters as the antennas allow; [`Error::Singular`] if the sources are inseparable; errors
    /// of [`estimate`](Self::estimate).
    pub fn estimate_several(
        &self,
        covariance: &Covariance<N>,
        sources: usize,
    ) -> Result<Vec<DirectionEstimate>, Error> {
        let each = if self.is_level() { 1 } else { 2 };
        let maximum = (N / each).min(N - 1);
        if !(1..=maximum).contains(&sources) {
            return Err(Error::TooManySources {
                requested: sources,
                maximum,
            });
        }
        if sources == 1 {
            return Ok(vec![self.estimate(covariance)?]);
        }
        let covariance = covariance.validated()?;
        let directions = self.alternate(&covariance, sources)?;
        self.describe_several(&covariance, &directions, each)
    }

    fn alternate(
        &self,
        covariance: &Covariance<N>,
        sources: usize,
    ) -> Result<Vec<Direction>, Error> {
        let matrix = covariance.unscaled();
        let trace = covariance.power() * covariance.weight() * N as f64;
        let mut directions = self.start(matrix, sources).ok_or(Error::Singular)?;
        for _ in 0..ROUNDS {
            let mut moved = 0.0_f64;
            for k in 0..sources {
                let others = (0..sources).filter(|other| *other != k);
                let projected =
                    ProjectedManifold::new(self.manifold(), others.map(|other| directions[other]));
                let finder = self.with_manifold(projected);
                let found = finder.ascend(matrix, trace, directions[k]).direction;
                let [x, y] = directions[k].step_to(&found);
                moved = moved.max(x.hypot(y));
                directions[k] = found;
            }
            if moved < SETTLED_RAD {
                break;
            }
        }
        directions.sort_unstable_by(|a, b| a.azimuth_rad.total_cmp(&b.azimuth_rad));
        Ok(directions)
    }

    /// Returns initial directions. Each of several directions is tried for the first source, and
    /// the others follow by the largest remaining power. The best set is selected. The direction of
    /// maximum power alone may be far from all sources, because coherent sources can add up to a
    /// beam in another direction.
    fn start(&self, matrix: &Matrix<N>, sources: usize) -> Option<Vec<Direction>> {
        let grid = self.grid();
        let firsts = grid.iter().step_by(grid.len().div_ceil(FIRSTS).max(1));
        let sets = firsts.filter_map(|first| {
            let mut projected = ProjectedManifold::new(self.manifold(), std::iter::empty());
            let mut explained = power(matrix, &first.1);
            let mut set = vec![first.0];
            projected.add(first.1);
            while set.len() < sources {
                let (beam, next) = projected.strongest(matrix, grid)?;
                explained += beam;
                set.push(next.0);
                projected.add(next.1);
            }
            Some((explained, set))
        });
        Some(sets.max_by(|a, b| a.0.total_cmp(&b.0))?.1)
    }

    /// Returns the estimates of sources in the given directions with `each` parameters per source.
    fn describe_several(
        &self,
        covariance: &Covariance<N>,
        directions: &[Direction],
        each: usize,
    ) -> Result<Vec<DirectionEstimate>, Error> {
        let (sources, snapshots) = (directions.len(), covariance.snapshots());
        let parameters = sources * each;
        let (mut steering, mut derivative) = (zeros::<N>(), zeros::<N>());
        for (k, direction) in directions.iter().enumerate() {
            let around = Neighbourhood::of(self.manifold(), *direction);
            for n in 0..N {
                steering[n][k] = around.response[n];
                for (p, tangent) in around.tangents[..each].iter().enumerate() {
                    derivative[n][k * each + p] = tangent[n];
                }
            }
        }
        let matrix = covariance.unscaled();
        let fit = Fit::around(matrix, (&steering, &derivative), [sources, parameters]);
        let fit = fit.ok_or(Error::Singular)?;
        let tests = Model::new::<N>([sources, parameters], snapshots, false).tests();
        let power = covariance.power() * covariance.weight() * N as f64;
        let tested = fit.residual().map_or(Tested::NOTHING, |(left, noise)| {
            tests.of(&left, noise, power)
        });
        let misfit = tests.misfit(tested.ratios());
        let mut sensitivities = Vec::with_capacity(parameters);
        let determined = fit.sensitivities(|h| sensitivities.push(product(h, matrix, [N; 3])));
        let described = directions.iter().enumerate().map(|(k, direction)| {
            let mut noise_covariance = [[0.0; 2]; 2];
            for (p, row) in noise_covariance.iter_mut().enumerate().take(each) {
                for (q, entry) in row.iter_mut().enumerate().take(each) {
                    *entry = match determined {
                        // The result does not depend on the scale of the matrix.
                        Some(()) => {
                            let at = [p, q].map(|it| &sensitivities[k * each + it]);
                            trace_of_product(at) / snapshots as f64
                        }
                        None if p == q => f64::INFINITY,
                        None => 0.0,
                    };
                }
            }
            // Convert from the great circle to the azimuth.
            let stretch = direction.elevation_rad.cos().recip();
            noise_covariance[0][0] *= stretch * stretch;
            noise_covariance[0][1] *= stretch;
            noise_covariance[1][0] *= stretch;
            let snr = fit.snr(k);
            let weak = threshold_doubt(snr, bound::resolvable_snr::<N>(snapshots));
            let known = noise_covariance.iter().flatten().all(|it| it.is_finite());
            let at_edge = self.is_at_edge(*direction, &noise_covariance);
            let doubt = weak.or((!known).then_some(Reason::SourcesNotSeparated));
            let edge = at_edge.then_some(Reason::EdgeOfElevations);
            DirectionEstimate {
                direction: *direction,
                covariance: noise_covariance.map(|row| row.map(|it| it * tested.inflation)),
                noise_covariance,
                snr_db: 10.0 * snr.log10(),
                fit: tests.fit(&tested),
                verdict: verdict(doubt, edge, misfit),
            }
        });
        Ok(described.collect())
    }
}

/// Returns `tr(A B)` of two Hermitian matrices, which is real.
fn trace_of_product<const N: usize>([a, b]: [&Matrix<N>; 2]) -> f64 {
    let mut trace = 0.0;
    for i in 0..N {
        for j in 0..N {
            trace += (a[i][j] * b[j][i]).re;
        }
    }
    trace
}
