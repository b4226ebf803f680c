//! Protection levels: the distance that the error exceeds with a given risk.
//!
//! Solution separation as in ARAIM (Blanch, Walter, Enge, Lee, Pervan, Rippl, Spletter and Kropp,
//! IEEE Transactions on Aerospace and Electronic Systems 51, 2015): the level r solves
//! `Σₖ pₖ P(error > r | k) = risk` over the hypotheses k, the fault-free one (p = 1) and each fault
//! with its probability. Under k, the estimate of the filter that k does not affect is correct
//! within its own covariance. The actual separation of the two estimates is used, not its
//! threshold.

use std::f64::consts::{LN_2, LOG2_E, TAU};

use crate::gaussian::principal_variances;
use crate::localize::output::PoseEstimate;

/// Number of directions of the quadrature.
const DIRECTIONS: usize = 32;

/// Relative accuracy of the squared level, which is rounded up.
const ACCURACY: f64 = 4e-3;

/// Fraction of the risk below which an upper bound of a hypothesis' contribution is sufficient.
const NEGLIGIBLE: f64 = 1e-3;

/// Minimum logarithm of probability over risk: below it, the logarithm is not linear in the squared
/// level.
const MIN_EXCESS: f64 = -30.0;

/// Position of the vehicle relative to the estimate under a fault: a Gaussian.
#[derive(Clone, Copy, Debug)]
pub struct Hypothesis {
    probability: f64,
    /// Mean ahead of the estimate and to its left (m).
    separation_m: [f64; 2],
    /// Lower triangular square root of the covariance along these axes (m).
    root_m: [f64; 3],
    /// Larger standard deviation (m).
    std_m: f64,
}

impl Hypothesis {
    /// Creates the hypothesis that `correct` is correct within `variance_ratio` times its covariance,
    /// instead of `reported`; `None` if `correct` has no covariance.
    pub fn new(
        probability: f64,
        correct: &PoseEstimate,
        variance_ratio: f64,
        reported: &PoseEstimate,
    ) -> Option<Self> {
        let [[xx, xy, _], [_, yy, _], _] = correct.covariance?;
        let (sin, cos) = reported.pose.heading_rad.sin_cos();
        let [x_m, y_m] = [
            correct.pose.x_m - reported.pose.x_m,
            correct.pose.y_m - reported.pose.y_m,
        ];
        let along = cos * cos * xx + 2.0 * cos * sin * xy + sin * sin * yy;
        let across = sin * sin * xx - 2.0 * cos * sin * xy + cos * cos * yy;
        let mixed = cos * sin * (yy - xx) + (cos * cos - sin * sin) * xy;
        let [along, mixed, across] = [along, mixed, across].map(|it| variance_ratio * it);
        let first = along.max(0.0).sqrt();
        let shared = if first > 0.0 { mixed / first } else { 0.0 };
        let own = (across - shared * shared).max(0.0).sqrt();
        Some(Self {
            probability,
            separation_m: [cos * x_m + sin * y_m, cos * y_m - sin * x_m],
            root_m: [first, shared, own],
            std_m: principal_variances(along, mixed, across)[0].sqrt(),
        })
    }

    fn distance_m(&self) -> f64 {
        self.separation_m[0].hypot(self.separation_m[1])
    }

    /// Returns the probability that the error along the heading exceeds `level_m`.
    fn beyond_along(&self, level_m: f64) -> f64 {
        beyond_line(self.separation_m[0], self.root_m[0], level_m)
    }

    /// Returns the probability that the error across the heading exceeds `level_m`.
    fn beyond_across(&self, level_m: f64) -> f64 {
        let std_m = self.root_m[1].hypot(self.root_m[2]);
        beyond_line(self.separation_m[1], std_m, level_m)
    }

    /// Returns an upper bound of the probability that the error exceeds the radius,
    /// `exp(−((r − d)/σ)²/2)`: that of a circular distribution.
    fn max_beyond_circle(&self, radius_m: f64) -> f64 {
        let room_m = radius_m - self.distance_m();
        if room_m <= 0.0 {
            return 1.0;
        }
        exp_of_negative(-0.5 * (room_m / self.std_m).powi(2))
    }

    /// Returns the probability that the error exceeds the radius; an upper bound if it is at most
    /// `negligible`.
    ///
    /// In polar coordinates around the mean, scaled so that the Gaussian is circular, the ray in
    /// direction t leaves the circle at ρ(t), and the fraction `exp(−ρ²/2)` of the ray's
    /// probability is beyond: `1/2π ∫ exp(−ρ(t)²/2) dt`.
    fn beyond_circle(
        &self,
        directions: &[[f64; DIRECTIONS]; 2],
        radius_m: f64,
        negligible: f64,
    ) -> f64 {
        let most = self.max_beyond_circle(radius_m);
        if most < negligible {
            return most;
        }
        let ([x, y], [first, shared, own]) = (self.separation_m, self.root_m);
        let room = radius_m * radius_m - x * x - y * y;
        if room <= 0.0 {
            return 1.0;
        }
        let [cosines, sines] = directions;
        let mut beyond = [0.0; DIRECTIONS];
        // A loop without branches is vectorised.
        for ((beyond, cos), sin) in beyond.iter_mut().zip(cosines).zip(sines) {
            let ray = [first * cos, shared * cos + own * sin];
            let along = x * ray[0] + y * ray[1];
            let square = ray[0] * ray[0] + ray[1] * ray[1];
            let exit = ((along * along + square * room).sqrt() - along) / square;
            let of_ray = exp_of_negative(-0.5 * exit * exit);
            *beyond = if square > 0.0 { of_ray } else { 0.0 };
        }
        beyond.iter().sum::<f64>() / DIRECTIONS as f64
    }
}

/// Returns `exp(x)` for x ≤ 0 with a relative error of 2 · 10⁻⁷, which does not affect the level.
/// The library function is not vectorised and took half of the pipeline's time. `2ⁿ exp(r)` for
/// integer n and |r| ≤ ½ ln 2 (Muller, Elementary Functions, 2016, chapter 11), with the Taylor
/// polynomial of exp(r).
#[inline]
fn exp_of_negative(x: f64) -> f64 {
    /// 1.5 · 2⁵²: added to a number, it leaves the nearest integer in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// Below about −708, the result is a subnormal number.
    const LEAST: f64 = -700.0;
    const TAYLOR: [f64; 7] = [
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    // NaN remains NaN.
    let x = if x < LEAST { LEAST } else { x };
    let rounded = x * LOG2_E + ROUND;
    let rest = x - (rounded - ROUND) * LN_2;
    let power = f64::from_bits((rounded.to_bits() << 52).wrapping_add(1.0_f64.to_bits()));
    TAYLOR.iter().fold(0.0, |sum, term| sum * rest + term) * power
}

/// Returns the probability that a Gaussian is farther from zero than `level`; at most 1.4 % too
/// large where it is small.
fn beyond_line(mean: f64, std: f64, level: f64) -> f64 {
    let room = level - mean.abs();
    if room <= 0.0 {
        return 1.0;
    }
    (upper_tail(room / std) + upper_tail((level + mean.abs()) / std)).min(1.0)
}

/// Returns an upper bound of the probability that a standard normal variable exceeds x ≥ 0
/// (Sampford, Annals of Mathematical Statistics 24, 1953).
fn upper_tail(x: f64) -> f64 {
    4.0 * exp_of_negative(-0.5 * x * x) / (TAU.sqrt() * (3.0 * x + (x * x + 8.0).sqrt()))
}

/// Protection levels for a given risk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// In any direction (m).
    pub horizontal_m: f64,
    /// Along the heading (m).
    pub along_m: f64,
    /// Across the heading (m).
    pub across_m: f64,
}

/// Solver of the level equation for a risk.
#[derive(Clone, Debug)]
pub struct LevelEquation {
    risk: f64,
    /// Cosines and sines of the directions.
    directions: [[f64; DIRECTIONS]; 2],
}

impl LevelEquation {
    /// Creates the solver for a risk in (0, 1).
    pub fn new(risk: f64) -> Self {
        let turns_rad: [f64; DIRECTIONS] =
            std::array::from_fn(|number| TAU * number as f64 / DIRECTIONS as f64);
        let directions = [turns_rad.map(f64::cos), turns_rad.map(f64::sin)];
        Self { risk, directions }
    }

    /// Returns the risk.
    pub const fn risk(&self) -> f64 {
        self.risk
    }

    /// Whether a level holds for all hypotheses together, which is far cheaper than the solution of
    /// the equation.
    pub fn holds(&self, level_m: f64, hypotheses: impl Iterator<Item = Hypothesis>) -> bool {
        let beyond = hypotheses.map(|it| self.share_beyond(level_m, &it));
        beyond.sum::<f64>() <= self.risk
    }

    /// Returns the contribution of a hypothesis to the probability of exceeding a level, relative
    /// to the risk.
    pub fn share_beyond(&self, level_m: f64, hypothesis: &Hypothesis) -> f64 {
        let negligible = NEGLIGIBLE * self.risk / hypothesis.probability;
        hypothesis.probability * hypothesis.beyond_circle(&self.directions, level_m, negligible)
    }

    /// Returns the levels that hold for all hypotheses together.
    pub fn solve(&self, hypotheses: &[Hypothesis]) -> Levels {
        let total: f64 = hypotheses.iter().map(|it| it.probability).sum();
        let at_none = (total / self.risk).ln();
        // The probability of exceeding t standard deviations in a circle is at most exp(−t²/2): at
        // this radius, all hypotheses are within the risk.
        let deviations = (2.0 * at_none).max(0.0).sqrt();
        let reach_m = (hypotheses.iter())
            .map(|it| it.distance_m() + deviations * it.std_m)
            .fold(0.0, f64::max);
        let mut brackets = [Bracket::new(reach_m, at_none); 3];
        while brackets.iter().any(Bracket::is_open) {
            let [circle_m, along_m, across_m] = brackets.map(|it| it.next().sqrt());
            let is_open = brackets.map(|it| it.is_open());
            let mut beyond = [0.0; 3];
            for one in hypotheses {
                if is_open[0] {
                    beyond[0] += self.share_beyond(circle_m, one);
                }
                if is_open[1] {
                    beyond[1] += one.probability * one.beyond_along(along_m);
                }
                if is_open[2] {
                    beyond[2] += one.probability * one.beyond_across(across_m);
                }
            }
            for (bracket, beyond) in brackets.iter_mut().zip(beyond) {
                bracket.narrow((beyond / self.risk).ln());
            }
        }
        let [horizontal_m, along_m, across_m] = brackets.map(|it| it.high.sqrt());
        Levels {
            horizontal_m,
            along_m,
            across_m,
        }
    }
}

/// Bracket of the squared level, with the logarithms of probability over risk at its ends. The
/// logarithm is almost linear in the squared level: regula falsi, with the retained end halved
/// (Illinois algorithm) so that both ends converge.
#[derive(Clone, Copy, Debug)]
struct Bracket {
    low: f64,
    high: f64,
    at_low: f64,
    at_high: f64,
}

impl Bracket {
    fn new(reach_m: f64, at_none: f64) -> Self {
        Self {
            low: 0.0,
            high: reach_m * reach_m,
            at_low: at_none,
            at_high: -0.1 * at_none,
        }
    }

    fn is_open(&self) -> bool {
        self.high - self.low > ACCURACY * self.high
    }

    /// Returns the next candidate.
    fn next(&self) -> f64 {
        let share = (self.at_low / (self.at_low - self.at_high)).clamp(0.05, 0.95);
        self.low + share * (self.high - self.low)
    }

    /// Narrows the bracket with the value at the candidate.
    fn narrow(&mut self, excess: f64) {
        if !self.is_open() {
            return;
        }
        let middle = self.next();
        if excess > 0.0 {
            (self.low, self.at_low, self.at_high) = (middle, excess, 0.5 * self.at_high);
        } else {
            let excess = excess.max(MIN_EXCESS);
            (self.high, self.at_high, self.at_low) = (middle, excess, 0.5 * self.at_low);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::gaussian::{RadialQuantile, normal_quantile};
    use crate::geometry::Pose;

    fn estimate(x_m: f64, y_m: f64, covariance: [[f64; 2]; 2]) -> PoseEstimate {
        let [[xx, xy], [_, yy]] = covariance;
        PoseEstimate {
            time_s: 0.0,
            pose: Pose {
                x_m,
                y_m,
                heading_rad: 0.6,
            },
            covariance: Some([[xx, xy, 0.0], [xy, yy, 0.0], [0.0; 3]]),
            integrity: None,
        }
    }

    fn hypothesis(probability: f64, [x_m, y_m]: [f64; 2], covariance: [[f64; 2]; 2]) -> Hypothesis {
        let reported = estimate(1.0, -2.0, [[0.0; 2]; 2]);
        let correct = estimate(1.0 + x_m, -2.0 + y_m, covariance);
        Hypothesis::new(probability, &correct, 1.0, &reported).unwrap()
    }

    fn levels(risk: f64, hypotheses: &[Hypothesis]) -> Levels {
        LevelEquation::new(risk).solve(hypotheses)
    }

    #[test]
    fn the_exponential_equals_the_standard_library() {
        for step in 0..70_000 {
            let x = -0.01 * f64::from(step);
            assert!((exp_of_negative(x) / x.exp() - 1.0).abs() < 2e-7, "{x}");
        }
        assert_eq!(exp_of_negative(0.0), 1.0);
        assert!(exp_of_negative(-1e300) < 1e-300 && exp_of_negative(f64::NEG_INFINITY) > 0.0);
        assert!(exp_of_negative(f64::NAN).is_nan());
    }

    #[test]
    fn without_separation_the_levels_are_the_quantiles() {
        for risk in [1e-2, 1e-3, 1e-8] {
            for small in [0.0, 0.04, 0.3, 1.0] {
                let found = levels(
                    risk,
                    &[hypothesis(1.0, [0.0; 2], [[1.0, 0.0], [0.0, small]])],
                );
                let radius = RadialQuantile::new(risk).radius([1.0, small]);
                // Up to 0.2 % due to rounding up.
                assert!((-1e-3..3e-3).contains(&(found.horizontal_m / radius - 1.0)));
                let along_std = 0.6_f64.cos().hypot(small.sqrt() * 0.6_f64.sin());
                let along = normal_quantile(0.5 * risk) * along_std;
                let ratio = found.along_m / along;
                assert!((1.0..1.006).contains(&ratio), "{ratio}");
            }
        }
    }

    #[test]
    fn for_a_large_separation_the_radius_is_the_one_sided_quantile() {
        // Φ⁻¹(0.99) = 2.326.
        let found = levels(
            1e-2,
            &[hypothesis(1.0, [3.0, 4.0], [[0.36, 0.48], [0.48, 0.64]])],
        );
        assert!(
            (found.horizontal_m / 7.326 - 1.0).abs() < 0.005,
            "{found:?}"
        );
    }

    /// The fraction of simulated positions beyond the level equals the risk.
    #[test]
    fn hypotheses_share_the_risk() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let narrow = [[0.01, 0.002], [0.002, 0.02]];
        let (draws, risk) = (200_000, 1e-2);
        for (wide, separation_m) in [
            ([[0.09, 0.02], [0.02, 0.04]], [0.3, -0.2]),
            ([[1.0, -0.3], [-0.3, 0.1]], [0.0, 1.5]),
            ([[0.01, 0.0], [0.0, 4e-4]], [0.05, 0.0]),
        ] {
            let fault = 0.3;
            let all = [
                hypothesis(1.0 - fault, [0.0; 2], narrow),
                hypothesis(fault, separation_m, wide),
            ];
            let found = levels(risk, &all);
            let equation = LevelEquation::new(risk);
            assert!(equation.holds(found.horizontal_m, all.into_iter()));
            assert!(!equation.holds(0.99 * found.horizontal_m, all.into_iter()));
            let mut beyond = [0; 3];
            for _ in 0..draws {
                let one = all[usize::from(rng.random::<f64>() < fault)];
                let mut normal = || rng.sample::<f64, _>(StandardNormal);
                let (a, b) = (normal(), normal());
                let x = one.separation_m[0] + one.root_m[0] * a;
                let y = one.separation_m[1] + one.root_m[1] * a + one.root_m[2] * b;
                beyond[0] += u32::from(x.hypot(y) > found.horizontal_m);
                beyond[1] += u32::from(x.abs() > found.along_m);
                beyond[2] += u32::from(y.abs() > found.across_m);
            }
            // Expected count 2000 ± 45. Rounding up (0.2 %) and the bound of the tail reduce it by
            // up to 4 %.
            for share in beyond.map(|count| f64::from(count) / (f64::from(draws) * risk)) {
                assert!(
                    (0.89..1.07).contains(&share),
                    "{separation_m:?}: {beyond:?}"
                );
            }
        }
    }

    #[test]
    fn a_rarer_fault_increases_the_level_less() {
        let nominal = hypothesis(1.0, [0.0; 2], [[0.01, 0.0], [0.0, 0.01]]);
        let fault = |probability| hypothesis(probability, [0.3, 0.1], [[0.04, 0.0], [0.0, 0.02]]);
        let with = |probability| levels(1e-3, &[nominal, fault(probability)]).horizontal_m;
        assert!(with(0.1) > 1.05 * with(0.01));
        assert!((with(1e-9) / levels(1e-3, &[nominal]).horizontal_m - 1.0).abs() < 3e-3);
    }

    #[test]
    fn the_level_of_a_zero_covariance_is_the_separation() {
        let exact = |separation_m| levels(1e-2, &[hypothesis(1.0, separation_m, [[0.0; 2]; 2])]);
        assert_eq!(exact([0.0, 0.0]).horizontal_m, 0.0);
        let radius_m = exact([0.3, 0.4]).horizontal_m;
        assert!((radius_m - 0.5).abs() < 0.002, "{radius_m}");
    }
}
