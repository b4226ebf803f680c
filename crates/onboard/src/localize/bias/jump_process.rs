//! The time-correlated bias of a radio head's angles, and how large it is: a jump process.
//!
//! What reflections add to an angle stays much the same for about a metre and is another one then; how
//! large it is differs from radio head to radio head and along the way. So it is a jump process: a value
//! that is kept, or drawn anew from one of a few levels, and the level is another one after some way (a
//! hidden Markov model). Besides, each angle has an error of the same size that is soon forgotten. By way and not by
//! time: a vehicle that stands sees the same error again. The value is estimated with the state, see
//! [`CorrelatedBias`](super::correlated_bias::CorrelatedBias); here it is weighed which of the jump hypotheses an angle
//! speaks for, by Bayes.

use crate::gaussian::Innovation;

/// How many levels there are, and their variances (rad²): from what calibration leaves to no more than a side.
pub(super) const LEVELS: usize = 4;
pub(super) const VARIANCES: [f64; LEVELS] = [0.02 * 0.02, 0.1 * 0.1, 0.3 * 0.3, 1.0];

/// From this level on a radio head says next to nothing, and an angle beyond it is an outlier.
const LARGE: usize = 2;
pub const MOST_VARIANCE: f64 = VARIANCES[LARGE];

/// Way over which the value, and the level, is kept (m).
pub(super) const VALUE_M: f64 = 1.0;
pub(super) const LEVEL_M: f64 = 20.0;

/// Way that the other part of it stays (m).
pub(super) const SOON_M: f64 = 0.3;

/// The least way between two angles, as a share of that in which they repeat each other: a vehicle that stands learns
/// nothing, but a variance must stay a number.
const LEAST_SHARE: f64 = 1e-5;

/// Share of an angle that is independent of the last one, `travelled_m` after it: independent is one in twice
/// the way that a value is kept.
pub fn independent(travelled_m: f64) -> f64 {
    (0.5 * travelled_m / VALUE_M).clamp(0.0, 1.0)
}

/// Probability that the value is the same one so much further on.
pub(super) fn kept(travelled_m: f64) -> f64 {
    (-travelled_m / VALUE_M).exp()
}

/// Whether the value is rather the same one so much further on than another.
pub fn repeats(travelled_m: f64) -> bool {
    kept(travelled_m) > 0.5
}

/// The share that is independent of what is soon forgotten.
pub(super) fn share(travelled_m: f64) -> f64 {
    (travelled_m / SOON_M).clamp(LEAST_SHARE, 1.0)
}

/// How large a radio head's bias is: the probability of each level, now and before anything is heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpProcess {
    pub(super) levels: [f64; LEVELS],
    first: [f64; LEVELS],
}

/// A hypothesis of how an angle came about: with the value kept, or drawn anew (a jump).
#[derive(Clone, Copy, Debug)]
pub struct JumpHypothesis {
    /// Its probability.
    pub share: f64,
    /// Residual `r` (rad), and over the levels `E 1/S` and `E 1/S − r² Var 1/S` of the variance of that
    /// (1/rad²): the gain is `P Hᵀ E 1/S`, and `P − P Hᵀ (E 1/S − r² Var 1/S) H P` is the covariance.
    pub residual: f64,
    pub gain: f64,
    pub narrowing: f64,
}

/// Both hypotheses of how an angle's bias came about.
pub struct JumpHypotheses {
    /// Probability density of the angle (1/rad).
    pub density: f64,
    pub kept: JumpHypothesis,
    pub anew: JumpHypothesis,
    /// Probability of each level by this angle, and by the way alone.
    levels: [f64; LEVELS],
    predicted_levels: [f64; LEVELS],
    /// A value drawn anew: its mean (rad), its variance (rad²), and how it varies with the state by the
    /// state's covariance with the angle.
    pub mean_rad: f64,
    pub variance: f64,
    pub narrowing: f64,
}

/// Mean and variance over the levels.
fn moments(weights: &[f64; LEVELS], values: &[f64; LEVELS]) -> (f64, f64) {
    let mean = covariance(weights, values, &[1.0; LEVELS]).1;
    (mean, covariance(weights, values, values).0)
}

/// Covariance of two values over the levels, and the mean of their product.
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
    // However little they weigh together, as a value does that was kept for long.
    product /= total;
    (product - means[0] / total * (means[1] / total), product)
}

impl JumpProcess {
    /// One of which nothing is known but how probable it is; where there is one, any size is as likely as
    /// another.
    pub fn new(probability: f64) -> Self {
        let mut first = [probability / (LEVELS - 1) as f64; LEVELS];
        first[0] = 1.0 - probability;
        Self {
            levels: first,
            first,
        }
    }

    /// The probabilities of the levels, so much further on.
    fn predicted_levels(&self, travelled_m: f64) -> [f64; LEVELS] {
        let changes = -(-travelled_m / LEVEL_M).exp_m1();
        let levels = self.levels.into_iter().zip(self.first);
        let mut predicted_levels = [0.0; LEVELS];
        for (predicted_levels, (level, first)) in predicted_levels.iter_mut().zip(levels) {
            *predicted_levels = level + changes * (first - level);
        }
        predicted_levels
    }

    /// Whether it is probably so large that the radio head says next to nothing.
    pub fn is_large(&self) -> bool {
        self.levels.iter().skip(LARGE).sum::<f64>() > 0.5
    }

    /// How an angle may have come about, `travelled_m` after the one before, whose innovation would be
    /// `seen` without the error. The value's mean was `value_rad`, and `known` is what its variance and its
    /// covariance with the rest add to the innovation's.
    pub fn weigh(
        &self,
        travelled_m: f64,
        seen: &Innovation,
        value_rad: f64,
        known: f64,
    ) -> JumpHypotheses {
        let predicted_levels = self.predicted_levels(travelled_m);
        let stays = kept(travelled_m);
        let repetition = share(travelled_m).recip();
        let (kept_residual, anew_residual) = (seen.residual - value_rad, seen.residual);
        let mut weights = [[0.0; LEVELS]; 2];
        // One over the variance of an angle, and what of that is of a value drawn anew.
        let (mut inverse, mut of_value) = ([[0.0; LEVELS]; 2], [0.0; LEVELS]);
        let mut left = [0.0; LEVELS];
        for (level, value) in VARIANCES.into_iter().enumerate() {
            for (hypothesis, share, residual, variance) in [
                (0, stays, kept_residual, known),
                (1, 1.0 - stays, anew_residual, value),
            ] {
                let once = Innovation {
                    residual,
                    variance: seen.variance + variance + value,
                    ..*seen
                };
                weights[hypothesis][level] = share * predicted_levels[level] * once.density();
                inverse[hypothesis][level] =
                    (seen.variance + variance + value * repetition).recip();
            }
            of_value[level] = value * inverse[1][level];
            left[level] = value - value * of_value[level];
        }
        let [kept, anew] = [0, 1].map(|hypothesis| weights[hypothesis].iter().sum::<f64>());
        let density = kept + anew;
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
        let square = anew_residual * anew_residual;
        let (of_value_mean, of_value_variance) = moments(&weights[1], &of_value);
        let together = covariance(&weights[1], &inverse[1], &of_value).0;
        let mut levels = predicted_levels;
        if density > 0.0 {
            for (level, (kept, anew)) in levels.iter_mut().zip(weights[0].iter().zip(weights[1])) {
                *level = (kept + anew) / total;
            }
        }
        JumpHypotheses {
            density,
            kept: hypothesis(0, kept, kept_residual),
            anew: hypothesis(1, anew, anew_residual),
            levels,
            predicted_levels,
            mean_rad: anew_residual * of_value_mean,
            variance: moments(&weights[1], &left).0 + square * of_value_variance,
            narrowing: of_value_mean - square * together,
        }
    }

    /// Learns from an angle that may have come about so, `travelled_m` after the one before.
    pub fn learn(&mut self, travelled_m: f64, hypotheses: &JumpHypotheses) {
        let by_way_and_angle = hypotheses
            .predicted_levels
            .into_iter()
            .zip(hypotheses.levels);
        for (level, (by_way, by_angle)) in self.levels.iter_mut().zip(by_way_and_angle) {
            *level = by_way + share(travelled_m) * (by_angle - by_way);
        }
    }

    /// Variance of an angle so far after the radio head's last one (rad²), which it does not repeat, that
    /// tells as much of the state as is to be expected, where the state predicts it with a variance.
    pub fn variance(&self, travelled_m: f64, predicted_levels: f64) -> f64 {
        let levels = self
            .predicted_levels(travelled_m)
            .into_iter()
            .zip(VARIANCES);
        let told: f64 = levels
            .map(|(level, variance)| level / (predicted_levels + 2.0 * variance))
            .sum();
        (told.recip() - predicted_levels).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_as_good_as_forgotten_has_moments() {
        let weights = [1e-230, 2e-230, 1e-230, 0.0];
        let (mean, variance) = moments(&weights, &[1.0, 2.0, 3.0, 9.0]);
        assert!((mean - 2.0).abs() < 1e-12 && (variance - 0.5).abs() < 1e-12);
    }
}
