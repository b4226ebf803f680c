//! Errors of an ideal filter, whose errors have exactly the reported covariance. They show the
//! random variation of a campaign's statistics for a given number of runs.
//!
//! The error of an ideal filter is a Gauss–Markov process: over a section of the route, `e⁺ = Ψ e +
//! ξ`, with the closed-loop transition `Ψ = Π (I − K H) F` and `Cov ξ = P⁺ − Ψ P Ψᵀ`. The errors of
//! the odometer's scale and of the start are constant during a run. Therefore, the steps of a run
//! are strongly correlated, and the statistics of an ideal filter vary between campaigns.

use onboard::gaussian::{Matrix, product};
use onboard::localize::ekf::state::{ACROSS, ALONG, STATES};
use rand::RngExt;
use rand_distr::StandardNormal;

use crate::cholesky::cholesky;
use crate::random::{Purpose, Streams};

/// Perfectly consistent filter along a route.
#[derive(Clone, Debug, Default)]
pub struct IdealFilter {
    points: Vec<RoutePoint>,
}

/// Position at which the error is drawn.
#[derive(Clone, Copy, Debug)]
struct RoutePoint {
    transition: Matrix<STATES>,
    /// Cholesky factor of the covariance of ξ, the new part of the error.
    fresh: Matrix<STATES>,
    covariance_m2: [[f64; 2]; 2],
}

/// Error at one position, along the filter's first two states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IdealError {
    /// Error (m).
    pub error_m: [f64; 2],
    /// Covariance of the error (m²).
    pub covariance_m2: [[f64; 2]; 2],
}

impl IdealFilter {
    /// Adds the next position: the closed-loop transition to it, and the covariances before and
    /// after.
    pub(crate) fn push(
        &mut self,
        transition: &Matrix<STATES>,
        before: &Matrix<STATES>,
        after: &Matrix<STATES>,
    ) {
        let carried = product(transition, before);
        let mut fresh = *after;
        for i in 0..STATES {
            for j in 0..STATES {
                for k in 0..STATES {
                    fresh[i][j] -= carried[i][k] * transition[j][k];
                }
            }
        }
        self.points.push(RoutePoint {
            transition: *transition,
            fresh: cholesky(&fresh, after),
            covariance_m2: [
                [after[ALONG][ALONG], after[ALONG][ACROSS]],
                [after[ACROSS][ALONG], after[ACROSS][ACROSS]],
            ],
        });
    }

    /// Draws the errors of one run. The transition to the first position starts from a zero error.
    pub fn run(&self, seed: u64, run: u64) -> impl Iterator<Item = IdealError> {
        let mut rng = Streams::new(seed, run).generator(Purpose::Start, 1);
        let mut error = [0.0; STATES];
        self.points.iter().map(move |point| {
            let mut next = [0.0; STATES];
            for j in 0..STATES {
                // A disabled state has zero variance and consumes no random number.
                let draw = if point.fresh[j][j] > 0.0 {
                    rng.sample::<f64, _>(StandardNormal)
                } else {
                    0.0
                };
                for i in 0..STATES {
                    next[i] += point.transition[i][j] * error[j] + point.fresh[i][j] * draw;
                }
            }
            error = next;
            IdealError {
                error_m: [error[ALONG], error[ACROSS]],
                covariance_m2: point.covariance_m2,
            }
        })
    }
}
