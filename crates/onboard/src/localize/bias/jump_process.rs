//! Time-correlated bias of a radio head's angles, and its level: a jump process.
//!
//! The bias due to reflections is almost constant over about a metre, and then changes. Its size
//! depends on the radio head and on the position. The model is a jump process (hidden Markov
//! model): the bias is retained, or drawn again from one of a few levels, and the level itself
//! changes after some distance. Each angle also has a short-lived error of the same level. The
//! process depends on distance, not on time, because the error is constant at standstill. The bias
//! is estimated together with the state, see
//! [`MultipathBias`](super::multipath_bias::MultipathBias); this module weights the jump
//! hypotheses of an angle by Bayes' rule.

use std::f64::consts::TAU;

use crate::gaussian::Innovation;
use crate::geometry::wrap_angle;

/// Number of levels of the bias.
pub(super) const LEVELS: usize = 4;
/// Variance of each level (rad²): from a calibration residual to an almost unknown direction.
pub(super) const VARIANCES: [f64; LEVELS] = [0.02 * 0.02, 0.1 * 0.1, 0.3 * 0.3, 1.0];

/// Index of the first large level. A radio head with a large bias contributes almost no
/// information.
const LARGE: usize = 2;
/// Squared bias above which a bias is large (rad²).
pub const MAX_VARIANCE: f64 = VARIANCES[LARGE];

/// Level of an almost unknown direction. A new bias of this level has a uniform distribution, so that
/// its angle determines the bias and contains no information about the state. A Gaussian would favour
/// a wrong position for which the bias is smaller.
const UNKNOWN: usize = LEVELS - 1;

/// Correlation distance of the bias (m): an assumption. In the ray-traced street, the ellipses of 95 % cover 94, 98 and 100 %
/// of the positions with 0.5, 0.7 and 1 m (notes/experiments.md).
pub const VALUE_M: f64 = 0.7;
/// Correlation distance of the level (m).
pub(super) const LEVEL_M: f64 = 20.0;

/// Correlation distance of the short-lived error (m).
pub(super) const SOON_M: f64 = 0.3;

/// Minimum distance between two angles, as a fraction of the correlation distance. At standstill
/// there is no new information, but the variance must remain finite.
const MIN_SHARE: f64 = 1e-5;

/// Returns the independent fraction of a measurement `travelled_m` after the previous one: one
/// independent measurement in twice the correlation distance.
pub fn independent(travelled_m: f64, correlation_m: f64) -> f64 {
    (0.5 * travelled_m / correlation_m).clamp(0.0, 1.0)
}

/// Returns the probability that the bias is unchanged after a distance.
fn kept(travelled_m: f64) -> f64 {
    (-travelled_m / VALUE_M).exp()
}

/// Returns the independent fraction of the short-lived error.
pub fn share(travelled_m: f64) -> f64 {
    (travelled_m / SOON_M).clamp(MIN_SHARE, 1.0)
}

/// Dependence of an angle's error on that of the previous angle of the radio head.
#[derive(Clone, Copy, Debug)]
pub struct Dependence {
    /// Distance between both (m).
    pub travelled_m: f64,
    /// Fraction of the bias's variance that is scatter instead, and therefore short-lived.
    pub white_fraction: f64,
}

impl Dependence {
    /// Returns the dependence without scatter.
    #[cfg(test)]
    pub(super) const fn of_bias(travelled_m: f64) -> Self {
        Self {
            travelled_m,
            white_fraction: 0.0,
        }
    }

    /// Returns the variances of the bias and of the short-lived error (rad²) at a level. Their sum is
    /// twice the variance of the level, so that the likelihood of an angle hardly depends on the
    /// fraction of scatter.
    pub(super) fn parts(&self, value: f64) -> [f64; 2] {
        [1.0 - self.white_fraction, 1.0 + self.white_fraction].map(|fraction| value * fraction)
    }
}

/// Level of a radio head's bias: the probability of each level, current and prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpProcess {
    pub(super) levels: [f64; LEVELS],
    first: [f64; LEVELS],
}

/// Hypothesis for an angle: the bias is retained, or drawn again (a jump).
#[derive(Clone, Copy, Debug)]
pub struct JumpHypothesis {
    /// Probability of the hypothesis.
    pub share: f64,
    /// Residual `r` (rad).
    pub residual: f64,
    /// Mean `E 1/S` of the inverse innovation variance over the levels (1/rad²). The gain is `P Hᵀ
    /// E 1/S`.
    pub gain: f64,
    /// `E 1/S − r² Var 1/S` (1/rad²). The updated covariance is `P − P Hᵀ (E 1/S − r² Var 1/S) H
    /// P`.
    pub narrowing: f64,
}

/// Both hypotheses for the bias of an angle.
pub struct JumpHypotheses {
    /// Probability density of the angle (1/rad).
    pub density: f64,
    pub kept: JumpHypothesis,
    pub redrawn: JumpHypothesis,
    /// Probability of each level given this angle.
    levels: [f64; LEVELS],
    /// Probability of each level before this angle, given the distance driven.
    predicted_levels: [f64; LEVELS],
    /// Mean of a bias that is drawn again, given this angle (rad).
    pub mean_rad: f64,
    /// Variance of this bias (rad²).
    pub variance: f64,
    /// Covariance of this bias with the state, divided by the negative covariance of the state with
    /// the angle.
    pub narrowing: f64,
}

impl JumpHypotheses {
    /// Returns the innovation given each hypothesis, with the expected inverse variance, weighted with the probability
    /// of the hypothesis (E-step of expectation maximisation; Dempster, Laird and Rubin, J. Royal Statistical Society
    /// B 39, 1977). The variance is infinite without information about the state.
    pub fn innovations(&self, without_bias: &Innovation) -> [Innovation; 2] {
        [&self.kept, &self.redrawn].map(|it| Innovation {
            residual: it.residual,
            variance: (it.share * it.gain).recip(),
            ..*without_bias
        })
    }
}

/// Returns mean and variance over the levels.
fn moments(weights: &[f64; LEVELS], values: &[f64; LEVELS]) -> (f64, f64) {
    let mean = covariance(weights, values, &[1.0; LEVELS]).1;
    (mean, covariance(weights, values, values).0)
}

/// Returns the covariance of two quantities over the levels, and the mean of their product.
fn covariance(weights: &[f64; LEVELS], one: &[f64; LEVELS], other: &[f64; LEVELS]) -> (f64, f64) {
    let (mut total, mut means, mut product) = (0.0, [0.0; 2], 0.0);
    for ((weight, one), other) in weights.iter().zip(one).zip(other) {
        total += weight;
        means = [means[0] + weight * one, means[1] + weight * other];
        product += weight * one * other;
    }
    if total <= 0.0 {
        return (0.0, 0.0);
    }
    // Normalised, because the weights of a bias retained over a long distance are small.
    product /= total;
    (product - means[0] / total * (means[1] / total), product)
}

impl JumpProcess {
    /// Creates a process with a prior probability of a bias; given a bias, all levels are equally
    /// probable.
    pub fn new(probability: f64) -> Self {
        let mut first = [probability / (LEVELS - 1) as f64; LEVELS];
        first[0] = 1.0 - probability;
        Self {
            levels: first,
            first,
        }
    }

    /// Returns the probabilities of the levels after a distance.
    fn predicted_levels(&self, travelled_m: f64) -> [f64; LEVELS] {
        let changes = -(-travelled_m / LEVEL_M).exp_m1();
        let levels = self.levels.into_iter().zip(self.first);
        let mut predicted_levels = [0.0; LEVELS];
        for (predicted_levels, (level, first)) in predicted_levels.iter_mut().zip(levels) {
            *predicted_levels = level + changes * (first - level);
        }
        predicted_levels
    }

    /// Returns the probability that the bias is so large that the angles contain almost no information.
    pub fn large_probability(&self) -> f64 {
        self.levels.iter().skip(LARGE).sum()
    }

    /// Returns the jump hypotheses of an angle with the innovation `seen` without bias. `value_rad`
    /// is the mean of the bias, and `known` is the contribution of its variance and covariance to
    /// the variance of the innovation.
    pub fn jump_hypotheses(
        &self,
        dependence: &Dependence,
        seen: &Innovation,
        value_rad: f64,
        known: f64,
    ) -> JumpHypotheses {
        let predicted_levels = self.predicted_levels(dependence.travelled_m);
        let stays = kept(dependence.travelled_m);
        let repetition = share(dependence.travelled_m).recip();
        let (kept_residual, redrawn_residual) =
            (wrap_angle(seen.residual - value_rad), seen.residual);
        let mut weights = [[0.0; LEVELS]; 2];
        // Inverse of the variance of an angle, and the share of a bias that is drawn again in this
        // variance.
        let (mut inverse, mut of_value) = ([[0.0; LEVELS]; 2], [0.0; LEVELS]);
        let mut left = [0.0; LEVELS];
        for (level, value) in VARIANCES.into_iter().enumerate() {
            let [bias, short_lived] = dependence.parts(value);
            for (hypothesis, share, residual, variance) in [
                (0, stays, kept_residual, known),
                (1, 1.0 - stays, redrawn_residual, bias),
            ] {
                let once = Innovation {
                    residual,
                    variance: seen.variance + variance + short_lived,
                    ..*seen
                };
                let (density, information) = if (hypothesis, level) == (1, UNKNOWN) {
                    (TAU.recip(), 0.0)
                } else {
                    let repeated = seen.variance + variance + short_lived * repetition;
                    (once.density(), repeated.recip())
                };
                weights[hypothesis][level] = share * predicted_levels[level] * density;
                inverse[hypothesis][level] = information;
            }
            (of_value[level], left[level]) = if level == UNKNOWN {
                (1.0, seen.variance + short_lived)
            } else {
                let of_value = bias * inverse[1][level];
                (of_value, bias - bias * of_value)
            };
        }
        let [kept, redrawn] = [0, 1].map(|hypothesis| weights[hypothesis].iter().sum::<f64>());
        let density = kept + redrawn;
        let total = density.max(f64::MIN_POSITIVE);
        let hypothesis = |hypothesis: usize, share: f64, residual: f64| {
            let (gain, variance) = moments(&weights[hypothesis], &inverse[hypothesis]);
            JumpHypothesis {
                share: share / total,
                residual,
                gain,
                narrowing: gain - residual * residual * variance,
            }
        };
        let square = redrawn_residual * redrawn_residual;
        let (of_value_mean, of_value_variance) = moments(&weights[1], &of_value);
        let together = covariance(&weights[1], &inverse[1], &of_value).0;
        let mut levels = predicted_levels;
        if density > 0.0 {
            for (level, (kept, redrawn)) in levels.iter_mut().zip(weights[0].iter().zip(weights[1]))
            {
                *level = (kept + redrawn) / total;
            }
        }
        JumpHypotheses {
            density,
            kept: hypothesis(0, kept, kept_residual),
            redrawn: hypothesis(1, redrawn, redrawn_residual),
            levels,
            predicted_levels,
            mean_rad: redrawn_residual * of_value_mean,
            variance: moments(&weights[1], &left).0 + square * of_value_variance,
            narrowing: of_value_mean - square * together,
        }
    }

    /// Updates the probabilities of the levels with an angle and its hypotheses, `travelled_m`
    /// after the previous one.
    pub fn learn(&mut self, travelled_m: f64, hypotheses: &JumpHypotheses) {
        let by_distance_and_angle = hypotheses
            .predicted_levels
            .into_iter()
            .zip(hypotheses.levels);
        for (level, (by_distance, by_angle)) in self.levels.iter_mut().zip(by_distance_and_angle) {
            *level = by_distance + share(travelled_m) * (by_angle - by_distance);
        }
    }

    /// Returns the expected `E 1/S` (1/rad²) of an angle for a retained and for a new bias, each
    /// weighted by its probability. `seen` is the variance of the innovation without bias; `known` as in
    /// [`Self::jump_hypotheses`].
    pub fn expected_gains(&self, dependence: &Dependence, seen: f64, known: f64) -> [f64; 2] {
        let stays = kept(dependence.travelled_m);
        let repetition = share(dependence.travelled_m).recip();
        let levels = self.predicted_levels(dependence.travelled_m).into_iter();
        let gains = levels.zip(VARIANCES).map(|(level, value)| {
            let [bias, short_lived] = dependence.parts(value);
            let once = seen + short_lived * repetition;
            [
                level * stays / (once + known),
                level * (1.0 - stays) / (once + bias),
            ]
        });
        gains.fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the hypotheses of an angle with the innovation `residual` for a bias that was last
    /// `value_rad`, if its direction is almost unknown.
    fn of_reflection(residual: f64, value_rad: f64, travelled_m: f64) -> JumpHypotheses {
        let process = JumpProcess {
            levels: [0.0, 0.0, 0.0, 1.0],
            ..JumpProcess::new(0.75)
        };
        let seen = Innovation {
            residual,
            variance: 0.01,
            measurement_variance: 0.01,
        };
        process.jump_hypotheses(&Dependence::of_bias(travelled_m), &seen, value_rad, 0.01)
    }

    #[test]
    fn a_bias_beyond_half_a_turn_is_retained() {
        let (before, after) = (of_reflection(3.1, 3.1, 0.1), of_reflection(-3.1, 3.1, 0.1));
        assert!((after.density / before.density - 1.0).abs() < 0.01);
        assert!((after.kept.residual - (TAU - 6.2)).abs() < 1e-12);
    }

    #[test]
    fn a_new_bias_of_unknown_direction_favours_no_position() {
        // After 5 m, the level is unchanged with a probability of 0.8 and the bias almost certainly new.
        let ratio = of_reflection(1.5, 0.0, 5.0).density / of_reflection(3.0, 0.0, 5.0).density;
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    }

    /// The score of the mixture, `−d ln p / dr`, is the sum of `r / S` over both innovations (Fisher's identity).
    #[test]
    fn the_innovations_have_the_score_of_the_mixture() {
        let process = JumpProcess::new(0.75);
        let hypotheses = |residual: f64| {
            let seen = Innovation {
                residual,
                variance: 0.01,
                measurement_variance: 0.01,
            };
            // Beyond the correlation distance of the short-lived error.
            let jumps = process.jump_hypotheses(&Dependence::of_bias(0.5), &seen, 0.2, 0.01);
            (jumps.innovations(&seen), jumps.density.ln())
        };
        for residual in [-1.0, 0.05, 0.3, 2.0] {
            let step = 1e-5;
            let [less, more] = [-step, step].map(|by| hypotheses(residual + by).1);
            let score: f64 = (hypotheses(residual).0.iter())
                .map(|it| it.residual / it.variance)
                .sum();
            let difference = -(more - less) / (2.0 * step);
            assert!((score - difference).abs() < 1e-6, "{score} {difference}");
        }
    }

    #[test]
    fn an_almost_forgotten_bias_has_finite_moments() {
        let weights = [1e-230, 2e-230, 1e-230, 0.0];
        let (mean, variance) = moments(&weights, &[1.0, 2.0, 3.0, 9.0]);
        assert!((mean - 2.0).abs() < 1e-12 && (variance - 0.5).abs() < 1e-12);
    }
}
