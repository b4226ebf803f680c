//! States of the ranges, estimated together with the vehicle's state: scale error, offset and drift
//! of the vehicle's clock, per radio head an offset, a rate offset and a phase offset, and the phase
//! offset that all radio heads share. They follow the angles' biases in [`MultipathBias`], so that vehicle, biases and range states remain
//! one Gaussian.

use super::multipath_bias::{HeadBias, MultipathBias};
use crate::gaussian::dot;
use crate::localize::ekf::state::{Belief, STATES};
use crate::radio_head::RadioHead;
use crate::range::RangeModel;

/// Numbers of the states: scale error, vehicle clock (m), its drift (m/s), first offset (m).
pub(in crate::localize) const RANGE_SCALE: usize = 0;
pub(in crate::localize) const CLOCK: usize = 1;
pub(in crate::localize) const DRIFT: usize = 2;
pub(in crate::localize) const FIRST_OFFSET: usize = 3;

/// Random walk of the phase offset over the distance driven (m/√m): multipath and the phase centres
/// of both antennas change with position and direction by centimetres within metres.
pub const PHASE_OFFSET_WALK_M_PER_SQRT_M: f64 = 0.005;

/// Derivative of a measurement by its range states: number of the state, and factor.
pub(in crate::localize) type RangeTerms = [(usize, f64); 4];

/// State of one radio head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::localize) enum HeadState {
    /// Offset of the ranges of a radio head (m).
    Offset,
    /// Offset of the range rates of a radio head (m/s), caused by its frequency error.
    RateOffset,
    /// Offset of the carrier phases of a radio head (m): the unknown number of wavelengths.
    PhaseOffset,
}

impl HeadState {
    /// Returns the number of the state of radio head `index` of `heads`.
    pub const fn number(self, index: usize, heads: usize, model: &RangeModel) -> usize {
        let block = match self {
            Self::Offset => 0,
            Self::RateOffset => 1,
            Self::PhaseOffset => 1 + model.uses_range_rate as usize,
        };
        FIRST_OFFSET + block * heads + index
    }
}

/// Returns the number of radio-head states per radio head.
const fn blocks(model: &RangeModel) -> usize {
    1 + model.uses_range_rate as usize + model.uses_carrier_phase as usize
}

/// Returns the number of the phase offset that all radio heads share (m): unknown number of
/// wavelengths by which the vehicle clock has changed.
pub(in crate::localize) const fn common_phase(heads: usize, model: &RangeModel) -> usize {
    FIRST_OFFSET + blocks(model) * heads
}

impl MultipathBias {
    /// Adds the states of the ranges of these radio heads.
    pub fn add_ranges(&mut self, model: &RangeModel, heads: &[RadioHead]) {
        let count = self.heads.len()
            + FIRST_OFFSET
            + blocks(model) * heads.len()
            + usize::from(model.uses_carrier_phase);
        self.grow(count);
        self.add_to(RANGE_SCALE, RANGE_SCALE, model.scale_std.powi(2));
        self.add_to(CLOCK, CLOCK, model.clock_std_m.powi(2));
        self.add_to(DRIFT, DRIFT, model.drift_std_mps.powi(2));
        let offset_variance = |head: &RadioHead| {
            // A surveyed position that is off shifts the ranges of the radio head.
            let std_m = head.range_offset.std_m.unwrap_or(model.offset_std_m);
            std_m.powi(2) + head.position_std_m.powi(2)
        };
        for (number, head) in heads.iter().enumerate() {
            let state = FIRST_OFFSET + number;
            if let Some(it) = self.heads.get_mut(self.biases + state) {
                it.mean_rad = head.range_offset.mean_m;
            }
            self.add_to(state, state, offset_variance(head));
        }
        let each = heads.iter().copied();
        // A surveyed offset contains that of the clock.
        let offset = |head: &RadioHead| match head.range_offset.std_m {
            Some(_) => 0.0,
            None => model.head_clock(&head.clock)[0],
        };
        self.add_of_clocks(&each, offset, |one, other, covariance| {
            (FIRST_OFFSET + one, FIRST_OFFSET + other, covariance)
        });
        if model.uses_range_rate {
            let number = |index| HeadState::RateOffset.number(index, heads.len(), model);
            let rate = |head: &RadioHead| model.frequency_std_mps(&head.clock);
            self.add_of_clocks(&each, rate, |one, other, covariance| {
                (number(one), number(other), covariance)
            });
        }
        // The first carrier phase determines the phase offset, so that no prior is needed.
    }

    /// Adds the covariance of a property of the radio heads' clocks with the standard deviation
    /// `std`, to the pair of states and with the covariance that `to` returns for a pair of radio
    /// heads. Radio heads of a clock group share the clock.
    fn add_of_clocks(
        &mut self,
        heads: &(impl Iterator<Item = RadioHead> + Clone),
        std: impl Fn(&RadioHead) -> f64,
        to: impl Fn(usize, usize, f64) -> (usize, usize, f64),
    ) {
        for (one, head) in heads.clone().enumerate() {
            for (other, second) in heads.clone().enumerate() {
                let group = head.clock.group;
                if one == other || (group.is_some() && group == second.clock.group) {
                    let (row, column, covariance) = to(one, other, std(&head) * std(&second));
                    self.add_to(row, column, covariance);
                }
            }
        }
    }

    fn add_to(&mut self, one: usize, other: usize, covariance: f64) {
        let place = (self.biases + one) * self.heads.len() + self.biases + other;
        if let Some(value) = self.among.get_mut(place) {
            *value += covariance;
        }
    }

    /// Returns mean and variance of a range state; zeros if there are none.
    pub fn range_state(&self, number: usize) -> [f64; 2] {
        let place = self.biases + number;
        let mean = self.heads.get(place).map_or(0.0, |it| it.mean_rad);
        [mean, self.covariance(place, place)]
    }

    /// Predicts the range states over a distance and a duration. The variance of the clocks' random
    /// walk is the specified one times `clock_ratio`.
    pub fn advance_ranges(
        &mut self,
        model: &RangeModel,
        heads: &(impl Iterator<Item = RadioHead> + Clone),
        travelled_m: f64,
        duration_s: f64,
        clock_ratio: f64,
    ) {
        let count = self.heads.len();
        let (clock, drift) = (self.biases + CLOCK, self.biases + DRIFT);
        if model.is_one_way {
            // The clock's offset grows by its drift.
            if let Some(&from) = self.heads.get(drift)
                && let Some(to) = self.heads.get_mut(clock)
            {
                to.mean_rad += duration_s * from.mean_rad;
                for (value, by) in to.state_covariance.iter_mut().zip(from.state_covariance) {
                    *value += duration_s * by;
                }
            }
            for other in 0..count {
                let by = duration_s * self.covariance(drift, other);
                if let Some(value) = self.among.get_mut(clock * count + other) {
                    *value += by;
                }
            }
            for other in 0..count {
                let by = duration_s * self.covariance(other, drift);
                if let Some(value) = self.among.get_mut(other * count + clock) {
                    *value += by;
                }
            }
            let walk = model.drift_walk_mps_per_sqrt_s.powi(2) * duration_s;
            let walked_s = clock_ratio * duration_s;
            let wander = model.clock_wander_m_per_sqrt_s.powi(2) * walked_s;
            self.add_to(CLOCK, CLOCK, wander + walk * duration_s * duration_s / 3.0);
            self.add_to(CLOCK, DRIFT, 0.5 * walk * duration_s);
            self.add_to(DRIFT, CLOCK, 0.5 * walk * duration_s);
            self.add_to(DRIFT, DRIFT, walk);
            let number = heads.clone().count();
            let wander = |head: &RadioHead| model.head_clock(&head.clock)[1];
            // Delay and carrier phase of a radio head derive from the same clock.
            let both = [HeadState::Offset, HeadState::PhaseOffset];
            let states = both.iter().take(1 + usize::from(model.uses_carrier_phase));
            for row in states.clone() {
                for column in states.clone() {
                    self.add_of_clocks(heads, wander, |one, other, covariance| {
                        let place = |of: &HeadState, index| of.number(index, number, model);
                        (place(row, one), place(column, other), covariance * walked_s)
                    });
                }
            }
        }
        let count = heads.clone().count();
        let walk = model.offset_walk_m_per_sqrt_m.powi(2) * travelled_m.abs();
        let phase_walk = PHASE_OFFSET_WALK_M_PER_SQRT_M.powi(2) * travelled_m.abs();
        for index in 0..count {
            let number = |state: HeadState| state.number(index, count, model);
            let offset = number(HeadState::Offset);
            self.add_to(offset, offset, walk);
            if model.uses_carrier_phase {
                let offset = number(HeadState::PhaseOffset);
                self.add_to(offset, offset, phase_walk);
            }
        }
    }

    /// Replaces a range state by an unknown value: mean, variance, no covariances.
    pub fn reset_range_state(&mut self, number: usize, mean: f64, variance: f64) {
        let (count, place) = (self.heads.len(), self.biases + number);
        if let Some(state) = self.heads.get_mut(place) {
            *state = HeadBias::unused();
            state.mean_rad = mean;
            for other in 0..count {
                for at in [place * count + other, other * count + place] {
                    if let Some(value) = self.among.get_mut(at) {
                        *value = 0.0;
                    }
                }
            }
            self.add_to(number, number, variance);
        }
    }

    /// Adds a jump with this mean and variance to a range state.
    pub fn add_jump(&mut self, number: usize, mean: f64, variance: f64) {
        if let Some(it) = self.heads.get_mut(self.biases + number) {
            it.mean_rad += mean;
        }
        self.add_to(number, number, variance);
    }

    /// Returns the variance that the range states add to a range with this state row: their own
    /// variance, and twice their covariance with the vehicle's part.
    pub fn range_variance(&self, row: &[f64; STATES], terms: &RangeTerms) -> f64 {
        let mut variance = 0.0;
        for &(number, factor) in terms {
            let place = self.biases + number;
            let with_state = self.heads.get(place).map_or(0.0, |it| it.along(row));
            variance += 2.0 * factor * with_state;
            for &(other, by) in terms {
                variance += factor * by * self.covariance(place, self.biases + other);
            }
        }
        variance
    }

    /// Updates state, biases and range states with a range: the Kalman update of the whole
    /// Gaussian. With the probability 1 − `weight`, the range has another cause and contains no information; mean and
    /// covariance are then those of the mixture (probabilistic data association, Bar-Shalom and Tse 1975).
    pub fn update_with_range(
        &mut self,
        belief: &mut Belief,
        row: &[f64; STATES],
        terms: &RangeTerms,
        residual: f64,
        variance: f64,
        weight: f64,
    ) {
        // Covariance of each state with the predicted range.
        let mut cross = belief.cross(row);
        for &(number, factor) in terms {
            if let Some(state) = self.heads.get(self.biases + number) {
                for (value, by) in cross.iter_mut().zip(state.state_covariance) {
                    *value += factor * by;
                }
            }
        }
        let mut total = variance + dot(row, &cross);
        for place in 0..self.heads.len() {
            let mut with_range = self.heads.get(place).map_or(0.0, |it| it.along(row));
            for &(number, factor) in terms {
                with_range += factor * self.covariance(place, self.biases + number);
            }
            if let Some(state) = self.heads.get_mut(place) {
                state.cross_with_angle = [with_range; 2];
            }
        }
        for &(number, factor) in terms {
            let state = self.heads.get(self.biases + number);
            total += factor * state.map_or(0.0, |it| it.cross_with_angle[0]);
        }
        if total <= 0.0 {
            return; // state and range are exact
        }
        let shift = weight * residual / total;
        let spread = (1.0 - weight) * residual * residual / total;
        let reduction = weight * (1.0 - spread) / total;
        for i in 0..STATES {
            belief.mean[i] += cross[i] * shift;
            for j in i..STATES {
                belief.covariance[i][j] -= cross[i] * cross[j] * reduction;
                belief.covariance[j][i] = belief.covariance[i][j];
            }
        }
        for state in &mut self.heads {
            let with_range = state.cross_with_angle[0];
            state.mean_rad += with_range * shift;
            for (value, by) in state.state_covariance.iter_mut().zip(cross) {
                *value -= reduction * with_range * by;
            }
        }
        let heads = &self.heads;
        let pairs = (heads.iter()).flat_map(|one| {
            (heads.iter()).map(|other| one.cross_with_angle[0] * other.cross_with_angle[0])
        });
        for (value, product) in self.among.iter_mut().zip(pairs) {
            *value -= reduction * product;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::localize::modes::trip::trip;
    use crate::settings::{ArraySettings, RangingSettings};

    /// The update equals the moments of 200,000 draws: of the posterior given the range with the probability `weight`, otherwise
    /// of the prior. The standard deviation of a mean is 0.002 of that of a draw, and that of a variance about 0.5 %.
    #[test]
    fn a_weighted_range_gives_the_moments_of_the_mixture() {
        const DRAWS: u32 = 200_000;
        let settings = RangingSettings::default();
        let model = RangeModel::new(&settings, &ArraySettings::default(), 0.08);
        let heads = trip().0;
        let mut row = [0.0; STATES];
        row[0] = 1.0;
        let terms = [
            (FIRST_OFFSET, 1.0),
            (CLOCK, 0.0),
            (DRIFT, 0.0),
            (RANGE_SCALE, 0.0),
        ];
        let (residual, variance) = (6.0, 1.0);
        let updated = |weight: f64| {
            let mut sigma = [0.0; STATES];
            sigma[0] = 2.0;
            let mut belief = Belief::independent([0.0; STATES], sigma);
            let mut bias = MultipathBias::new(0, 0.0);
            bias.add_ranges(&model, &heads);
            bias.update_with_range(&mut belief, &row, &terms, residual, variance, weight);
            let [offset_m, offset_variance] = bias.range_state(FIRST_OFFSET);
            (
                [belief.mean[0], offset_m],
                [belief.covariance[0][0], offset_variance],
            )
        };
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for weight in [0.0, 0.3, 1.0] {
            let (given_range, prior) = (updated(1.0), updated(0.0));
            let found = updated(weight);
            for state in 0..2 {
                let (mut sum, mut square) = (0.0, 0.0);
                for _ in 0..DRAWS {
                    let (mean, variance) = if random.random::<f64>() < weight {
                        (given_range.0[state], given_range.1[state])
                    } else {
                        (prior.0[state], prior.1[state])
                    };
                    let normal: f64 = random.sample(StandardNormal);
                    let value = mean + variance.sqrt() * normal;
                    sum += value / f64::from(DRAWS);
                    square += value * value / f64::from(DRAWS);
                }
                assert!((found.0[state] - sum).abs() < 0.05, "{weight}: {sum}");
                let spread = square - sum * sum;
                assert!(
                    (found.1[state] / spread - 1.0).abs() < 0.02,
                    "{weight}: {spread}"
                );
            }
        }
    }
}
