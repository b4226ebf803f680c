//! Update with a range, range rate or carrier phase: gate, jumps, Kalman update.

use super::distance::SHARED_M;
use super::late_path::LatePath;
use super::pseudorange::{PredictedRange, Sighted};
use crate::localize::bias::{HeadState, RANGE_SCALE, independent};
use crate::localize::ekf::filter::{Ekf, Head};
use crate::localize::output::{UpdateReason, UpdateResult};
use crate::radio_head::RadioHead;
use crate::range::{RangeMeasurement, RangeQuantity};

/// Number of successive ranges of a radio head beyond the gate that are a jump of its offset, not outliers.
const JUMP_RANGES: u16 = 8;

/// Number of independent paths over which blocked ones are averaged. An assumption.
const PATHS: f64 = 10.0;

/// Estimated range states, each with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeState {
    /// Estimated value.
    pub mean: f64,
    /// Standard deviation.
    pub std: f64,
}

impl Ekf {
    /// Predicts a range, range rate or carrier phase to a radio head.
    pub(in crate::localize) fn predict_range(
        &self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> Result<PredictedRange, UpdateReason> {
        match measured.quantity {
            RangeQuantity::Range => self.predict_distance(head, measured),
            RangeQuantity::RangeRate { interval_s } => {
                self.predict_range_rate(head, measured, interval_s)
            }
            RangeQuantity::CarrierPhase => self.predict_carrier_phase(head, measured),
        }
    }

    /// Updates state and range states with a range, range rate or carrier phase.
    pub fn update_range(&mut self, head: &RadioHead, measured: &RangeMeasurement) -> UpdateResult {
        let (predicted, _) = self.predict_with_clock_step(head, measured);
        if let Some(late) = self.reject_late_range(&predicted) {
            return late;
        }
        self.update_predicted_range(&predicted)
    }

    /// Returns the first path of a radio head before a range, if a new state since the previous one has the probability
    /// `changed`. It is clear if the ranges are no evidence for a blocked path:
    /// with angles, which are the better evidence; before the first used range, because an offset beyond its standard
    /// deviation is no blocked path; and while two-way ranges of other radio heads are too short, because the position or the
    /// odometry is then wrong. Delays that are too short also follow from a clock that was estimated with late ones.
    pub(super) fn path_before(&self, seen: &Sighted<'_>, changed: f64) -> LatePath {
        let is_contradicted = || self.heads.iter().any(|it| it.rejected_ranges > 0);
        if self.has_angles()
            || !seen.travelled_m.is_finite()
            || (!seen.model.is_one_way && is_contradicted())
        {
            return LatePath::CLEAR;
        }
        (self.heads.get(seen.index)).map_or(LatePath::CLEAR, |head| head.late.before(changed))
    }

    /// Returns the verdict of a predicted range that is late because its path is probably blocked.
    pub(in crate::localize) fn reject_late_range(
        &mut self,
        predicted: &Result<PredictedRange, UpdateReason>,
    ) -> Option<UpdateResult> {
        let predicted = predicted.as_ref().ok().filter(|it| it.is_late())?;
        self.note_path(predicted);
        self.note_range(predicted);
        Some(self.verdict(
            UpdateReason::Outlier,
            Some(predicted.innovation.mahalanobis2()),
        ))
    }

    /// Stores the first path after a range.
    fn note_path(&mut self, predicted: &PredictedRange) {
        if predicted.path != LatePath::CLEAR
            && let Some(head) = self.heads.get_mut(predicted.index)
        {
            let share = path_changed(head, predicted) / PATHS;
            head.late = predicted.path_after;
            let is_blocked = f64::from(head.late.is_blocked());
            self.blocked_fraction += share * (is_blocked - self.blocked_fraction);
        }
    }

    /// Whether at least half of the paths are blocked, of several radio heads with one-way delays within the last 20 m. The
    /// vehicle's clock may then follow the late delays, so that the other ones seem early.
    pub(in crate::localize) fn most_paths_are_blocked(&self) -> bool {
        if !self.has_one_way_delays() {
            return false;
        }
        let recent = |it: &&Head| self.driven_m - it.last_range_m < SHARED_M;
        let paths = || self.heads.iter().filter(recent).map(|it| it.late);
        let blocked = paths().filter(|it| it.is_blocked()).count();
        blocked > 1 && 2 * blocked >= paths().count()
    }

    /// Updates with a predicted measurement.
    pub(in crate::localize) fn update_predicted_range(
        &mut self,
        predicted: &Result<PredictedRange, UpdateReason>,
    ) -> UpdateResult {
        let predicted = match predicted {
            Ok(predicted) if predicted.excluded => {
                return self.verdict(UpdateReason::Excluded, None);
            }
            Ok(predicted) => predicted,
            Err(reason) => return self.verdict(*reason, None),
        };
        if predicted.is_new_sequence {
            self.begin_sequence(predicted, predicted.phase_state);
            return self.verdict(UpdateReason::Consistent, None);
        }
        let seen = predicted.innovation;
        let mahalanobis2 = seen.mahalanobis2();
        let is_beyond_gate = mahalanobis2 > self.config.gate;
        let weight = match predicted.quantity {
            RangeQuantity::Range => predicted.clear_probability,
            _ => f64::from(!is_beyond_gate),
        };
        let is_outlier = weight < 0.5;
        match predicted.quantity {
            RangeQuantity::Range => {
                self.note_path(predicted);
                self.monitor_range(predicted, is_beyond_gate);
            }
            // A cycle slip: the phase continues with another number of wavelengths.
            RangeQuantity::CarrierPhase if is_outlier => {
                self.begin_sequence(predicted, predicted.phase_state);
            }
            RangeQuantity::CarrierPhase => self.knows_common_phase = true,
            RangeQuantity::RangeRate { .. } => {}
        }
        if !is_outlier {
            self.note_range(predicted);
            if predicted.quantity == RangeQuantity::Range {
                self.last_delay_s = predicted.time_s;
            }
        }
        self.bias.update_with_range(
            &mut self.belief,
            &predicted.row,
            &predicted.terms,
            seen.residual,
            predicted.independent_innovation().measurement_variance,
            weight,
        );
        self.keep_bounds();
        let reason = if is_outlier {
            UpdateReason::Outlier
        } else {
            UpdateReason::Consistent
        };
        self.verdict(reason, Some(mahalanobis2))
    }

    /// Stores where a range was received that contains multipath.
    pub(in crate::localize) fn note_range(&mut self, predicted: &PredictedRange) {
        if predicted.quantity == RangeQuantity::Range
            && let Some(head) = self.heads.get_mut(predicted.index)
        {
            head.last_range_m = predicted.place_m;
        }
    }

    /// Estimates the noise of the ranges with an innovation, and counts successive ranges beyond the gate.
    fn monitor_range(&mut self, predicted: &PredictedRange, is_beyond_gate: bool) {
        self.range_noise
            .see(&predicted.innovation, predicted.stated_variance);
        let model = self.config.ranging.as_ref();
        let wander = model.map_or(0.0, |model| model.clock_wander_m_per_sqrt_s);
        let since_s = (predicted.time_s - self.last_delay_s).max(0.0);
        self.clock_noise
            .see(&predicted.innovation, wander * wander * since_s);
        if is_beyond_gate {
            self.reject_range(predicted);
        } else if let Some(head) = self.heads.get_mut(predicted.index) {
            head.rejected_ranges = 0;
        }
    }

    /// Counts a range beyond the gate. After several successive ones, the offset of the radio head has jumped, and its variance then
    /// includes the jump: its hardware was restarted, or the offset was estimated with a blocked path. Without angles, ranges
    /// that are too long are those of a blocked path.
    fn reject_range(&mut self, predicted: &PredictedRange) {
        let residual = predicted.innovation.residual;
        let (count, has_angles) = (self.heads.len(), self.has_angles());
        let head = self.heads.get_mut(predicted.index);
        let Some(head) = head.filter(|_| has_angles || residual < 0.0) else {
            return;
        };
        head.rejected_ranges += 1;
        if let Some(model) = &self.config.ranging
            && head.rejected_ranges >= JUMP_RANGES
        {
            head.rejected_ranges = 0;
            let offset = HeadState::Offset.number(predicted.index, count, model);
            self.bias.add_jump(offset, 0.0, residual.powi(2));
        }
    }

    /// Whether the ranges contain the vehicle's clock.
    pub(super) fn has_one_way_delays(&self) -> bool {
        self.config.ranging.is_some_and(|model| model.is_one_way)
    }

    /// Whether an angle was used.
    pub(super) fn has_angles(&self) -> bool {
        self.heads.iter().any(|it| it.last_update_s.is_finite())
    }

    /// Predicts the range states with an odometry sample.
    pub(in crate::localize::ekf) fn advance_ranges(&mut self, travelled_m: f64, duration_s: f64) {
        self.knows_common_phase = false;
        if let Some(model) = &self.config.ranging {
            let heads = self.heads.iter().map(|head| head.known);
            let clock_ratio = self.clock_noise.ratio();
            self.bias
                .advance_ranges(model, &heads, travelled_m, duration_s, clock_ratio);
        }
    }

    /// Returns the estimated relative scale error of the ranges; `None` without ranges.
    pub fn range_scale(&self) -> Option<RangeState> {
        self.config.ranging.map(|_| self.range_state(RANGE_SCALE))
    }

    /// Returns the estimated offset of a radio head's ranges (m); `None` without ranges.
    pub fn range_offset(&self, head: &RadioHead) -> Option<RangeState> {
        let index = self.heads.iter().position(|mine| mine.is(head))?;
        let model = self.config.ranging.as_ref()?;
        let number = HeadState::Offset.number(index, self.heads.len(), model);
        Some(self.range_state(number))
    }

    /// Whether a range was used, so that the vehicle's clock is known relative to those of the radio heads.
    pub(in crate::localize) const fn knows_clock(&self) -> bool {
        self.last_delay_s.is_finite()
    }

    fn range_state(&self, number: usize) -> RangeState {
        let [mean, variance] = self.bias.range_state(number);
        let std = variance.max(0.0).sqrt();
        RangeState { mean, std }
    }
}

/// Returns the probability that a path has another state since the previous range of its radio head.
pub(super) fn path_changed(head: &Head, predicted: &PredictedRange) -> f64 {
    independent((predicted.place_m - head.last_range_m).abs(), SHARED_M)
}
