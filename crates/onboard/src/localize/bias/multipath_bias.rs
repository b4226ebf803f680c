//! Time-correlated biases of all radio heads' angles, estimated together with the state.
//!
//! State and biases remain one Gaussian, with the mean and covariance of the mixture over the jump
//! hypotheses of an angle (generalised pseudo-Bayes of first order, Bar-Shalom, Li and Kirubarajan
//! 2001, 11.6). Let P be the joint covariance of state and biases, and H the row of the angle. If
//! the bias is retained, the correction is proportional to the vector `P Hᵀ`. If the bias is drawn
//! again, the angle measures the state only, and the correction is proportional to the part of
//! `P Hᵀ` that the state contributes. The change of the covariance by an angle is therefore a
//! bilinear form of these two vectors.

use super::jump_process::{Dependence, JumpHypotheses, JumpProcess, MAX_VARIANCE};
use super::mixture_update::{CrossCovariance, MixtureUpdate};
use crate::clone_in_place::clone_in_place;
use crate::gaussian::smoother::Journal;
use crate::gaussian::{Innovation, Matrix, dot};
use crate::localize::ekf::state::{Belief, STATES};

/// Bias of one radio head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeadBias {
    size: JumpProcess,
    /// Mean of the bias (rad), and its covariance with the state.
    pub(super) mean_rad: f64,
    pub(super) state_covariance: [f64; STATES],
    /// Covariance with the newest measurement.
    pub(super) cross_with_angle: CrossCovariance,
}

impl HeadBias {
    /// Returns a state of the ranges, which no angle contains.
    pub(super) fn unused() -> Self {
        Self {
            size: JumpProcess::new(0.0),
            mean_rad: 0.0,
            state_covariance: [0.0; STATES],
            cross_with_angle: CrossCovariance::default(),
        }
    }

    pub(super) fn along(&self, row: &[f64; STATES]) -> f64 {
        dot(&self.state_covariance, row)
    }
}

/// Part of a radio head's persistent bias in its angles.
#[derive(Clone, Copy, Debug, Default)]
struct PersistentPart {
    /// Mean (rad) and variance (rad²).
    mean_rad: f64,
    variance: f64,
    /// Covariance with the part of the state, and with the multipath bias (rad²).
    state_covariance: f64,
    bias_covariance: f64,
}

clone_in_place! {
    /// Biases of all radio heads; empty if they are not estimated.
    #[derive(Debug, PartialEq)]
    pub struct MultipathBias {
        /// Biases, the states of the ranges (see [`range_states`](super::range_states)), and persistent biases.
        pub(super) heads: Vec<HeadBias>,
        /// Number of biases.
        pub(super) biases: usize,
        /// Number of the first persistent bias, if they are estimated.
        pub(super) persistent: Option<usize>,
        /// Covariance matrix of all these, row by row.
        pub(super) among: Vec<f64>,
    }
}

impl MultipathBias {
    /// Creates the biases of a number of radio heads with a prior probability; empty if it is 0.
    pub fn new(radio_heads: usize, probability: f64) -> Self {
        let count = if probability > 0.0 { radio_heads } else { 0 };
        let unknown = HeadBias {
            size: JumpProcess::new(probability),
            ..HeadBias::unused()
        };
        Self {
            heads: vec![unknown; count],
            biases: count,
            persistent: None,
            among: vec![0.0; count * count],
        }
    }

    /// Adds exactly known states, `count` in total.
    pub(super) fn grow(&mut self, count: usize) {
        let old = self.heads.len();
        let mut among = vec![0.0; count * count];
        for (place, &covariance) in self.among.iter().enumerate() {
            if let Some(value) = among.get_mut((place / old) * count + place % old) {
                *value = covariance;
            }
        }
        self.among = among;
        self.heads.resize(count, HeadBias::unused());
    }

    /// Whether no bias is estimated.
    pub const fn is_empty(&self) -> bool {
        self.biases == 0
    }

    /// Returns the bias of a radio head's angles, if it is estimated.
    fn bias(&self, head: usize) -> Option<&HeadBias> {
        self.heads.get(..self.biases)?.get(head)
    }

    /// Returns the state of a radio head's persistent bias and its number, if it is estimated.
    pub(super) fn persistent(&self, head: usize) -> Option<(usize, &HeadBias)> {
        let number = self.persistent? + head;
        Some((number, self.heads.get(number)?))
    }

    /// Returns the part of a radio head's persistent bias in its angles, for the state row of an angle; zero if it is not
    /// estimated.
    fn persistent_part(&self, head: usize, row: &[f64; STATES]) -> PersistentPart {
        let Some((number, bias)) = self.persistent(head) else {
            return PersistentPart::default();
        };
        PersistentPart {
            mean_rad: bias.mean_rad,
            variance: self.covariance(number, number),
            state_covariance: bias.along(row),
            bias_covariance: self.covariance(head, number),
        }
    }

    /// Removes the covariances with the state, which was replaced.
    pub fn decorrelate(&mut self) {
        for head in &mut self.heads {
            head.state_covariance = [0.0; STATES];
        }
    }

    /// Removes the covariances with some states, which were replaced.
    pub fn decorrelate_states(&mut self, states: &[usize]) {
        for head in &mut self.heads {
            for &state in states {
                head.state_covariance[state] = 0.0;
            }
        }
    }

    /// Whether the bias of a radio head is probably so large that its angles contain almost no
    /// information.
    pub fn is_large(&self, head: usize) -> bool {
        self.bias(head).is_some_and(|error| {
            error.size.large_probability() > 0.5 || error.mean_rad * error.mean_rad > MAX_VARIANCE
        })
    }

    /// Returns the probability that the level of a radio head's bias is large; 0 if its bias is not estimated.
    pub fn large_probability(&self, head: usize) -> f64 {
        self.bias(head)
            .map_or(0.0, |error| error.size.large_probability())
    }

    /// Returns the variance (rad²) of an angle without bias that is expected to reduce the state's
    /// variance along `row` as much as an angle of this radio head with the noise `variance`;
    /// infinite if the angle would only repeat the bias.
    pub fn equivalent_variance(
        &self,
        belief: &Belief,
        head: usize,
        dependence: &Dependence,
        row: &[f64; STATES],
        variance: f64,
    ) -> f64 {
        let Some(error) = self.bias(head) else {
            return variance;
        };
        let (state, persistent) = (belief.variance_along(row), self.persistent_part(head, row));
        // Covariance of the state with the angle, and variance of the angle, without the multipath bias.
        let alone = state + persistent.state_covariance;
        let total = alone + persistent.state_covariance + persistent.variance;
        let known = self.known(head, row, error, &persistent);
        let with_bias = alone + error.along(row);
        let [kept, redrawn] =
            (error.size).expected_gains(dependence, total + variance, known.max(-total));
        let reduction = kept * with_bias * with_bias + redrawn * alone * alone;
        (state * state / reduction - state).max(variance)
    }

    /// Returns the variance that the retained multipath bias adds to an angle.
    fn known(
        &self,
        head: usize,
        row: &[f64; STATES],
        error: &HeadBias,
        persistent: &PersistentPart,
    ) -> f64 {
        2.0 * (error.along(row) + persistent.bias_covariance) + self.covariance(head, head)
    }

    pub(super) fn covariance(&self, one: usize, other: usize) -> f64 {
        let place = one * self.heads.len() + other;
        self.among.get(place).copied().unwrap_or_default()
    }

    /// Predicts the covariances of biases and state with the Jacobian of the state's motion.
    pub fn moved(&mut self, jacobian: &Matrix<STATES>) {
        for head in &mut self.heads {
            let before = head.state_covariance;
            for (after, row) in head.state_covariance.iter_mut().zip(jacobian) {
                *after = dot(row, &before);
            }
        }
    }

    /// Returns the jump hypotheses of an angle to a radio head; see [`JumpProcess::jump_hypotheses`]. `None`
    /// if its bias is not estimated.
    pub fn jump_hypotheses(
        &self,
        head: usize,
        dependence: &Dependence,
        seen: &Innovation,
        row: &[f64; STATES],
    ) -> Option<JumpHypotheses> {
        let error = self.bias(head)?;
        let persistent = self.persistent_part(head, row);
        let seen = Innovation {
            residual: seen.residual - persistent.mean_rad,
            variance: seen.variance + 2.0 * persistent.state_covariance + persistent.variance,
            ..*seen
        };
        let known = self.known(head, row, error, &persistent);
        Some((error.size).jump_hypotheses(dependence, &seen, error.mean_rad, known))
    }

    /// Updates state and biases with an angle to a radio head and its jump hypotheses.
    pub fn update_with_angle(
        &mut self,
        belief: &mut Belief,
        head: usize,
        dependence: &Dependence,
        row: &[f64; STATES],
        hypotheses: &JumpHypotheses,
        journal: Option<&mut Journal<STATES>>,
    ) {
        self.set_cross_covariances(row, Some(head));
        let own = self.covariance(head, head);
        let mut without_bias = belief.cross(row);
        if let Some((_, persistent)) = self.persistent(head) {
            for (value, by) in without_bias.iter_mut().zip(persistent.state_covariance) {
                *value += by;
            }
        }
        let Some(error) = self.heads.get_mut(head) else {
            return;
        };
        error.size.learn(dependence.travelled_m, hypotheses);
        if hypotheses.density <= 0.0 {
            return; // the angle has no likelihood under either hypothesis
        }
        let cross_with_angle: [CrossCovariance; STATES] =
            std::array::from_fn(|i| [without_bias[i] + error.state_covariance[i], without_bias[i]]);
        let change = MixtureUpdate::new(hypotheses, error.mean_rad, error.cross_with_angle[0]);
        error.mean_rad = change.value_mean();
        for (covariance, cross_with_angle) in
            error.state_covariance.iter_mut().zip(cross_with_angle)
        {
            *covariance = change.value_covariance(*covariance, cross_with_angle);
        }
        if let Some(journal) = journal {
            self.note(journal, head, row, &cross_with_angle, hypotheses);
        }
        for i in 0..STATES {
            belief.mean[i] += change.step(cross_with_angle[i]);
            for j in i..STATES {
                belief.covariance[i][j] += change.more(cross_with_angle[i], cross_with_angle[j]);
                belief.covariance[j][i] = belief.covariance[i][j];
            }
        }
        let count = self.heads.len();
        let with_each = |heads: &[HeadBias], at: usize| heads.get(at).map(|it| it.cross_with_angle);
        for (place, covariance) in self.among.iter_mut().enumerate() {
            let (one, other) = (place / count, place % count);
            let (Some(with_one), Some(with_other)) =
                (with_each(&self.heads, one), with_each(&self.heads, other))
            else {
                continue;
            };
            *covariance = match (one == head, other == head) {
                (true, true) => change.value_variance(own),
                (true, false) => change.value_covariance(*covariance, with_other),
                (false, true) => change.value_covariance(*covariance, with_one),
                (false, false) => *covariance + change.more(with_one, with_other),
            };
        }
        for (other, error) in self.heads.iter_mut().enumerate() {
            if other == head {
                continue;
            }
            error.mean_rad += change.step(error.cross_with_angle);
            for (covariance, cross_with_angle) in
                error.state_covariance.iter_mut().zip(cross_with_angle)
            {
                *covariance += change.more(error.cross_with_angle, cross_with_angle);
            }
        }
    }

    /// Records the mixture update for the smoother as three Gaussian steps:
    ///
    /// 1. A measurement of state and bias, weighted with the probability of a retained bias.
    /// 2. A measurement of the state only, weighted with the probability of a bias drawn again.
    /// 3. A transition of the bias to its posterior.
    ///
    /// The covariance of the mixture is at least that after these steps, because `T M⁻¹ Tᵀ` is
    /// jointly convex in `T` and `M` (Boyd and Vandenberghe, Convex Optimization, 3.1.7). The
    /// smoother treats the difference as process noise.
    fn note(
        &self,
        journal: &mut Journal<STATES>,
        head: usize,
        row: &[f64; STATES],
        cross_with_angle: &[CrossCovariance; STATES],
        hypotheses: &JumpHypotheses,
    ) {
        let [with_measured, known] = [0, 1].map(|of| {
            row.iter()
                .zip(cross_with_angle)
                .map(|(by, with)| by * with[of])
                .sum::<f64>()
        });
        let Some(error) = self.heads.get(head) else {
            return;
        };
        let all = || {
            (cross_with_angle.iter().copied())
                .chain(self.heads.iter().map(|it| it.cross_with_angle))
        };
        let (kept, redrawn) = (&hypotheses.kept, &hypotheses.redrawn);
        // Effect of the first measurement on the second: correction of its residual and reduction
        // of its variance.
        let (mut less, mut corrected) = (0.0, 0.0);
        if kept.share > 0.0 && kept.narrowing > 0.0 {
            let once = with_measured + error.cross_with_angle[0];
            let total = once + (kept.narrowing.recip() - once).max(0.0) / kept.share;
            let residual = kept.residual * kept.gain / kept.narrowing;
            let gain = all().map(|[measured, _]| measured / total);
            journal.measured(row, Some(head), gain, residual, total);
            less = with_measured / total;
            corrected = less * residual;
        }
        if redrawn.share > 0.0 && redrawn.narrowing > 0.0 {
            let total = known - less * with_measured
                + (redrawn.narrowing.recip() - known).max(0.0) / redrawn.share;
            let residual = redrawn.residual * redrawn.gain / redrawn.narrowing - corrected;
            let gain = all().map(|[measured, alone]| (alone - less * measured) / total);
            if total > 0.0 {
                journal.measured(row, None, gain, residual, total);
            }
        }
        let scale = hypotheses.narrowing / (1.0 - known * redrawn.narrowing);
        let by_state = row.map(|by| -redrawn.share * scale * by);
        journal.redrawn(head, kept.share, &by_state);
    }

    /// Computes the covariance of each bias with a measurement of the state (`row`) and, for `of`,
    /// of this radio head's biases.
    fn set_cross_covariances(&mut self, row: &[f64; STATES], of: Option<usize>) {
        let persistent = of.and_then(|of| self.persistent(of).map(|(number, _)| number));
        for head in 0..self.heads.len() {
            let value_covariance = of.map_or(0.0, |of| self.covariance(head, of));
            let with_persistent = persistent.map_or(0.0, |number| self.covariance(head, number));
            if let Some(error) = self.heads.get_mut(head) {
                let alone = error.along(row) + with_persistent;
                error.cross_with_angle = [alone + value_covariance, alone];
            }
        }
    }

    /// Updates the biases with a scalar measurement of the state, before the state itself is
    /// updated: the bias part of a Kalman update.
    pub fn update(&mut self, belief: &Belief, residual: f64, row: &[f64; STATES], variance: f64) {
        if self.heads.is_empty() {
            return;
        }
        let cross = belief.cross(row);
        let total = dot(row, &cross).max(0.0) + variance;
        self.set_cross_covariances(row, None);
        if total <= 0.0 {
            return; // state and measurement are exact
        }
        for head in &mut self.heads {
            let gain = head.cross_with_angle[1] / total;
            head.mean_rad += gain * residual;
            for (covariance, cross) in head.state_covariance.iter_mut().zip(cross) {
                *covariance -= gain * cross;
            }
        }
        let heads = &self.heads;
        let pairs = (heads.iter()).flat_map(|one| {
            heads
                .iter()
                .map(|other| one.cross_with_angle[1] * other.cross_with_angle[1])
        });
        for (covariance, product) in self.among.iter_mut().zip(pairs) {
            *covariance -= product / total;
        }
    }

    /// Returns the gains of the biases in the newest [`update`](Self::update), whose innovation
    /// variance is `total`.
    pub fn gains(&self, total: f64) -> impl Iterator<Item = f64> {
        self.heads
            .iter()
            .map(move |head| head.cross_with_angle[1] / total)
    }

    /// Returns the covariance of each bias with the state.
    pub fn state_covariance(&self) -> impl Iterator<Item = [f64; STATES]> {
        self.heads.iter().map(|head| head.state_covariance)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::super::jump_process::{LEVEL_M, LEVELS, SOON_M, VALUE_M, VARIANCES, share};
    use super::*;
    use crate::gaussian::{Gaussian, identity};

    const OWN_VARIANCE: f64 = 1e-4;

    /// With this prior probability, all levels are equally probable.
    const EVEN: f64 = 0.75;

    /// Returns a state with a standard deviation of one radian, whose first component is measured
    /// by angles.
    fn unknown() -> Belief {
        let mut sigma = [0.0; STATES];
        (sigma[0], sigma[1]) = (1.0, 0.5);
        Belief::independent([0.0; STATES], sigma)
    }

    fn row() -> [f64; STATES] {
        let mut row = [0.0; STATES];
        row[0] = 1.0;
        row
    }

    /// Processes an angle of a radio head like the filter.
    fn take(
        errors: &mut MultipathBias,
        belief: &mut Belief,
        head: usize,
        travelled_m: f64,
        rad: f64,
    ) {
        take_with(errors, belief, head, &Dependence::of_bias(travelled_m), rad);
    }

    fn take_with(
        errors: &mut MultipathBias,
        belief: &mut Belief,
        head: usize,
        dependence: &Dependence,
        rad: f64,
    ) {
        let seen = belief.innovation(rad - belief.mean[0], &row(), OWN_VARIANCE);
        let hypotheses = errors
            .jump_hypotheses(head, dependence, &seen, &row())
            .unwrap();
        errors.update_with_angle(belief, head, dependence, &row(), &hypotheses, None);
    }

    /// State, the biases of two radio heads, and their persistent biases.
    const ALL: usize = STATES + 4;

    /// Returns state and biases as one Gaussian.
    fn whole(belief: &Belief, errors: &MultipathBias) -> Gaussian<ALL> {
        let mut whole = Gaussian::<ALL>::independent([0.0; ALL], [0.0; ALL]);
        for i in 0..STATES {
            whole.mean[i] = belief.mean[i];
            whole.covariance[i][..STATES].copy_from_slice(&belief.covariance[i]);
        }
        for (one, error) in errors.heads.iter().enumerate() {
            whole.mean[STATES + one] = error.mean_rad;
            for i in 0..STATES {
                whole.covariance[i][STATES + one] = error.state_covariance[i];
                whole.covariance[STATES + one][i] = error.state_covariance[i];
            }
            for other in 0..errors.heads.len() {
                whole.covariance[STATES + one][STATES + other] = errors.covariance(one, other);
            }
        }
        whole
    }

    fn assert_same(one: &Gaussian<ALL>, other: &Gaussian<ALL>) {
        for i in 0..ALL {
            assert!((one.mean[i] - other.mean[i]).abs() < 1e-12, "{i}");
            for j in 0..ALL {
                let apart = one.covariance[i][j] - other.covariance[i][j];
                assert!(apart.abs() < 1e-12, "{i} {j}: {apart}");
            }
        }
    }

    /// Returns the mixture over all hypotheses of an angle, each updated separately.
    fn mixture(
        before: &Gaussian<ALL>,
        levels: [f64; LEVELS],
        head: usize,
        dependence: &Dependence,
        rad: f64,
    ) -> Gaussian<ALL> {
        let travelled_m = dependence.travelled_m;
        // Without persistent biases, these states are zero.
        let mut row = [0.0; ALL];
        (row[0], row[STATES + 2 + head]) = (1.0, 1.0);
        let mut whole_row = row;
        whole_row[STATES + head] = 1.0;
        let changes = 1.0 - (-travelled_m / LEVEL_M).exp();
        let stays = (-travelled_m / VALUE_M).exp();
        let mut parts = vec![];
        for (level, value) in levels.into_iter().zip(VARIANCES) {
            let probability = level + changes * (1.0 / LEVELS as f64 - level);
            let [bias, short_lived] = dependence.parts(value);
            let mut redrawn = *before;
            redrawn.mean[STATES + head] = 0.0;
            for i in 0..ALL {
                redrawn.covariance[i][STATES + head] = 0.0;
                redrawn.covariance[STATES + head][i] = 0.0;
            }
            redrawn.covariance[STATES + head][STATES + head] = bias;
            let is_unknown = value == VARIANCES[LEVELS - 1];
            for (is_new, mut component) in [(false, *before), (true, redrawn)] {
                let probable = if is_new { 1.0 - stays } else { stays };
                if is_new && is_unknown {
                    // A uniform direction: the angle determines the bias and not the state.
                    let seen =
                        component.innovation(rad - dot(&row, &component.mean), &row, OWN_VARIANCE);
                    let cross = component.cross(&row);
                    component.mean[STATES + head] = seen.residual;
                    for i in 0..ALL {
                        component.covariance[i][STATES + head] = -cross[i];
                        component.covariance[STATES + head][i] = -cross[i];
                    }
                    component.covariance[STATES + head][STATES + head] =
                        seen.variance + short_lived;
                    parts.push((probable * probability / TAU, component));
                    continue;
                }
                let residual = rad - dot(&whole_row, &component.mean);
                let once = component.innovation(residual, &whole_row, OWN_VARIANCE + short_lived);
                let repeated = OWN_VARIANCE + short_lived / share(travelled_m);
                component.update(residual, &whole_row, repeated);
                parts.push((probable * probability * once.density(), component));
            }
        }
        let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
        let mut mixed = Gaussian::<ALL>::independent([0.0; ALL], [0.0; ALL]);
        for (weight, component) in &parts {
            for i in 0..ALL {
                mixed.mean[i] += weight / total * component.mean[i];
            }
        }
        for (weight, component) in &parts {
            for i in 0..ALL {
                for j in 0..ALL {
                    let apart = [i, j].map(|at| component.mean[at] - mixed.mean[at]);
                    mixed.covariance[i][j] +=
                        weight / total * (component.covariance[i][j] + apart[0] * apart[1]);
                }
            }
        }
        mixed
    }

    #[test]
    fn state_and_errors_have_the_moments_of_the_mixture() {
        for white_fraction in [0.0, 0.4, 1.0] {
            have_the_moments_of_the_mixture(MultipathBias::new(2, EVEN), white_fraction);
        }
    }

    #[test]
    fn persistent_biases_have_the_moments_of_the_mixture() {
        let mut errors = MultipathBias::new(2, EVEN);
        errors.expect_persistent();
        have_the_moments_of_the_mixture(errors, 0.0);
    }

    fn have_the_moments_of_the_mixture(mut errors: MultipathBias, white_fraction: f64) {
        let mut belief = unknown();
        let mut motion = identity::<STATES>();
        (motion[0][1], motion[1][1]) = (0.3, 0.9);
        let mut whole_motion = identity::<ALL>();
        (whole_motion[0][1], whole_motion[1][1]) = (0.3, 0.9);
        for (head, travelled_m, rad) in [
            (0, f64::INFINITY, 0.4),
            (1, f64::INFINITY, -0.2),
            (0, 0.08, 0.43),
            (1, 0.5, 0.6),
            (1, 0.0, 0.6),
            (0, 1.7, -1.1),
            (1, 0.3, 0.1),
        ] {
            let levels = errors.heads[head].size.levels;
            let dependence = Dependence {
                white_fraction,
                ..Dependence::of_bias(travelled_m)
            };
            let expected = mixture(&whole(&belief, &errors), levels, head, &dependence, rad);
            take_with(&mut errors, &mut belief, head, &dependence, rad);
            assert_same(&whole(&belief, &errors), &expected);
            // A motion of the state, and a measurement of the state alone.
            let mut expected = whole(&belief, &errors);
            expected.spread(&whole_motion, &[[0.0; ALL]; ALL]);
            belief.spread(&motion, &[[0.0; STATES]; STATES]);
            errors.moved(&motion);
            assert_same(&whole(&belief, &errors), &expected);
            let mut whole_row = [0.0; ALL];
            whole_row[0] = 1.0;
            let whole_gain = expected.update(0.1, &whole_row, 0.3);
            let total = belief.variance_along(&row()) + 0.3;
            errors.update(&belief, 0.1, &row(), 0.3);
            let gain = belief.update(0.1, &row(), 0.3);
            assert_same(&whole(&belief, &errors), &expected);
            for (gain, expected) in gain.into_iter().chain(errors.gains(total)).zip(whole_gain) {
                assert!((gain - expected).abs() < 1e-12);
            }
        }
    }

    /// Angles of a radio head whose bias is drawn from the model.
    struct Drawn {
        level: f64,
        value_rad: f64,
    }

    impl Drawn {
        /// Draws a new bias: a uniform direction for the largest level.
        fn redraw(&mut self, random: &mut ChaCha8Rng) {
            self.value_rad = if self.level == VARIANCES[LEVELS - 1].sqrt() {
                random.random_range(-PI..PI)
            } else {
                self.level * random.sample::<f64, _>(StandardNormal)
            };
        }

        fn after(&mut self, travelled_m: f64, random: &mut ChaCha8Rng) -> f64 {
            let happens = |within_m: f64, random: &mut ChaCha8Rng| {
                random.random::<f64>() > (-travelled_m / within_m).exp()
            };
            if happens(LEVEL_M, random) {
                self.level = VARIANCES[random.random_range(0..LEVELS)].sqrt();
            }
            if happens(VALUE_M, random) {
                self.redraw(random);
            }
            let soon = self.level * random.sample::<f64, _>(StandardNormal);
            let own = OWN_VARIANCE.sqrt() * random.sample::<f64, _>(StandardNormal);
            self.value_rad + soon + own
        }
    }

    #[test]
    fn the_filter_is_consistent_if_errors_agree_with_the_model() {
        const RUNS: u32 = 400;
        // Two radio heads, with an angle of each every 0.3 m: the short-lived error is independent
        // between angles.
        let mut random = ChaCha8Rng::seed_from_u64(5);
        // Both levels are those of an unknown direction during the first 2 m with a probability of
        // 0.05, and during 20 m of 0.01. The error then remains that of the prior, 1 rad, which alone
        // gives an RMS of 0.23 and 0.12. The bounds are twice as large.
        for (travelled_m, bound_m) in [(2.0, 0.5), (20.0, 0.25)] {
            let (mut nees, mut square, mut within) = (0.0, 0.0, 0);
            for _ in 0..RUNS {
                let (mut errors, mut belief) = (MultipathBias::new(2, EVEN), unknown());
                let truth: f64 = random.sample(StandardNormal);
                let mut drawn = [0, 1].map(|_| Drawn {
                    level: VARIANCES[random.random_range(0..LEVELS)].sqrt(),
                    value_rad: 0.0,
                });
                for head in &mut drawn {
                    head.redraw(&mut random);
                }
                for predict_measurement in 0..(travelled_m / SOON_M) as usize {
                    for (head, drawn) in drawn.iter_mut().enumerate() {
                        let since_m = if predict_measurement == 0 {
                            f64::INFINITY
                        } else {
                            SOON_M
                        };
                        let error = drawn.after(SOON_M, &mut random);
                        take(&mut errors, &mut belief, head, since_m, truth + error);
                    }
                }
                let off = belief.mean[0] - truth;
                nees += off * off / belief.covariance[0][0];
                within += u32::from(off * off < 3.84 * belief.covariance[0][0]);
                square += off * off;
            }
            let runs = f64::from(RUNS);
            // A mixture is not Gaussian: its tails are heavier than those of its covariance.
            let within = f64::from(within) / runs;
            assert!(within > 0.87, "{travelled_m} m: {within}");
            assert!(nees / runs < 2.0, "{travelled_m} m: {}", nees / runs);
            assert!((square / runs).sqrt() < bound_m, "{travelled_m} m");
        }
    }

    #[test]
    fn the_bias_size_is_estimated_within_metres_and_again_after_a_change() {
        let (mut errors, mut belief) = (MultipathBias::new(1, EVEN), unknown());
        belief.covariance[0][0] = 1e-6;
        for predict_measurement in 0..300 {
            let error_rad = 0.01 * f64::from(predict_measurement % 7 - 3);
            take(&mut errors, &mut belief, 0, 0.1, error_rad);
        }
        assert!(!errors.is_large(0));
        let small =
            errors.equivalent_variance(&belief, 0, &Dependence::of_bias(2.0), &row(), OWN_VARIANCE);
        assert!(small < 0.05 * 0.05, "{small}");
        for predict_measurement in 0..60 {
            let error_rad = 0.8 + 0.3 * f64::from(predict_measurement % 3 - 1);
            take(&mut errors, &mut belief, 0, 0.1, error_rad);
        }
        assert!(errors.is_large(0));
        // These angles hardly change the state.
        assert!(belief.mean[0].abs() < 3e-3, "{}", belief.mean[0]);
    }

    #[test]
    fn the_expected_reduction_of_the_variance_is_that_of_the_update() {
        // Most angles repeat the bias of the previous one.
        const STEP_M: f64 = 0.08;
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let (mut expected, mut obtained) = (0.0, 0.0);
        for _ in 0..20 {
            let (mut errors, mut belief) = (MultipathBias::new(1, EVEN), unknown());
            let mut drawn = Drawn {
                level: VARIANCES[0].sqrt(),
                value_rad: 0.0,
            };
            for number in 0..300 {
                let error = drawn.after(STEP_M, &mut random);
                let before = belief.covariance[0][0];
                let variance = errors.equivalent_variance(
                    &belief,
                    0,
                    &Dependence::of_bias(STEP_M),
                    &row(),
                    OWN_VARIANCE,
                );
                take(&mut errors, &mut belief, 0, STEP_M, error);
                // The first metres determine the level.
                if number >= 50 {
                    expected += before * before / (before + variance);
                    obtained += before - belief.covariance[0][0];
                }
            }
        }
        let ratio = expected / obtained;
        assert!((0.5..2.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn standstill_contains_no_information() {
        let (mut errors, mut belief) = (MultipathBias::new(1, EVEN), unknown());
        for _ in 0..30 {
            take(&mut errors, &mut belief, 0, 0.1, 0.02);
        }
        let before = belief.covariance[0][0];
        for _ in 0..1000 {
            take(&mut errors, &mut belief, 0, 0.0, 0.02);
        }
        assert!(belief.covariance[0][0] > 0.9 * before);
    }
}
