//! Update with a range: prediction, Jacobian, noise, gate.
//!
//! A range is `(1 + s) R + c + b` with the distance R to the radio head, the scale error s, the
//! vehicle clock c (one-way delays only) and the offset b of the radio head. The range states are
//! part of [`MultipathBias`](crate::localize::bias::MultipathBias).

use super::angle_model::{ArrayModel, LineOfSight, locate};
use super::filter::Ekf;
use super::state::{ALONG, DATUM, STATES};
use crate::gaussian::Innovation;
use crate::localize::bias::{CLOCK, DRIFT, FIRST_OFFSET, RANGE_SCALE, RangeTerms};
use crate::localize::output::{UpdateReason, UpdateVerdict};
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Prediction and innovation of a range.
#[derive(Clone, Copy, Debug)]
pub(in crate::localize) struct PredictedRange {
    pub excluded: bool,
    row: [f64; STATES],
    terms: RangeTerms,
    /// Innovation in metres.
    pub innovation: Innovation,
}

/// Estimated range states, each with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeState {
    /// Estimated value.
    pub mean: f64,
    /// Standard deviation.
    pub std: f64,
}

impl Ekf {
    /// Predicts a range to a radio head.
    pub(in crate::localize) fn predict_range(
        &self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> Result<PredictedRange, UpdateReason> {
        let model = self.config.ranging.as_ref();
        let model = model.ok_or(UpdateReason::Unusable)?;
        let sigma_m = measured.sigma_m.or(model.sigma_m).unwrap_or(f64::NAN);
        let usable = measured.time_s.is_finite()
            && measured.range_m.is_finite()
            && sigma_m.is_finite()
            && sigma_m > 0.0
            && self.journal.is_none();
        if !usable {
            return Err(UpdateReason::Unusable);
        }
        let (index, head) = self.head_of(head, measured.time_s)?;
        // Predict to the time of the range.
        let (_, ahead_variance, ahead) = self.coast(measured.time_s);
        let mean = (ahead.as_ref()).map_or(&self.belief.mean, |ahead| &ahead.mean);
        let (pose, frame) = locate(mean, 0.0, self.map.as_deref());
        let antenna = ArrayModel {
            position_m: model.position_m,
            ..self.config.array
        };
        let sight = LineOfSight::new(&head.known, pose, &frame, mean, &antenna)
            .ok_or(UpdateReason::Unusable)?;
        let [scale_error, _] = self.bias.range_state(RANGE_SCALE);
        let scale = 1.0 + scale_error;
        // A step towards the radio head reduces the range.
        let level = scale * sight.level();
        let mut row = sight.steps[0].map(|step| -level * step);
        let (north, east) = sight.bearing_rad.sin_cos();
        (row[DATUM[0]], row[DATUM[1]]) = (level * east, level * north);
        // Second-order terms: a deviation to the side lengthens the range.
        let aside = self.belief.variance_along(&sight.steps[1]) / sight.range_m;
        let bend_m = 0.5 * scale * aside;
        let coasted = row[ALONG].powi(2) * ahead_variance;
        let (row, strayed) = (ahead.as_ref()).map_or((row, 0.0), |ahead| ahead.seen_before(&row));
        // Clock and offset.
        let lag_s = if self.odometry.is_some() {
            (measured.time_s - self.time_s()).max(0.0)
        } else {
            0.0
        };
        let terms = [
            (RANGE_SCALE, sight.range_m),
            (CLOCK, 1.0),
            (DRIFT, lag_s),
            (FIRST_OFFSET + index, 1.0),
        ];
        let state_m = |number: usize| self.bias.range_state(number)[0];
        let shift_m = state_m(CLOCK) + lag_s * state_m(DRIFT) + state_m(FIRST_OFFSET + index);
        let [_, head_wander] = model.head_clock(&head.known.clock);
        let wander = model.clock_wander_m_per_sqrt_s.powi(2) + head_wander.powi(2);
        // A drift that walks during the lag.
        let drifted = model.drift_walk_mps_per_sqrt_s.powi(2) * lag_s.powi(3) / 3.0;
        let measurement_variance = sigma_m * sigma_m
            + coasted
            + strayed
            + 0.5 * (scale * aside).powi(2)
            + wander * lag_s
            + drifted;
        let residual = measured.range_m - (scale * sight.range_m + bend_m + shift_m);
        let known = self.belief.variance_along(&row) + self.bias.range_variance(&row, &terms);
        Ok(PredictedRange {
            excluded: head.excluded,
            row,
            terms,
            innovation: Innovation {
                residual,
                variance: known.max(0.0) + measurement_variance,
                measurement_variance,
            },
        })
    }

    /// Updates state and range states with a range.
    pub fn update_range(&mut self, head: &RadioHead, measured: &RangeMeasurement) -> UpdateVerdict {
        self.update_predicted_range(self.predict_range(head, measured))
    }

    /// Updates with a predicted range.
    pub(in crate::localize) fn update_predicted_range(
        &mut self,
        predicted: Result<PredictedRange, UpdateReason>,
    ) -> UpdateVerdict {
        let predicted = match predicted {
            Ok(predicted) if predicted.excluded => {
                return self.verdict(UpdateReason::Excluded, None);
            }
            Ok(predicted) => predicted,
            Err(reason) => return self.verdict(reason, None),
        };
        let seen = predicted.innovation;
        let mahalanobis2 = seen.mahalanobis2();
        if mahalanobis2 > self.config.gate {
            return self.verdict(UpdateReason::Outlier, Some(mahalanobis2));
        }
        self.bias.take_range(
            &mut self.belief,
            &predicted.row,
            &predicted.terms,
            seen.residual,
            seen.measurement_variance,
        );
        self.keep_bounds();
        self.verdict(UpdateReason::Consistent, Some(mahalanobis2))
    }

    /// Predicts the range states with an odometry sample.
    pub(super) fn advance_ranges(&mut self, travelled_m: f64, duration_s: f64) {
        if let Some(model) = &self.config.ranging {
            let heads = self.heads.iter().map(|head| head.known);
            self.bias
                .advance_ranges(model, &heads, travelled_m, duration_s);
        }
    }

    /// Returns the estimated relative scale error of the ranges; `None` without ranges.
    pub fn range_scale(&self) -> Option<RangeState> {
        self.config.ranging.map(|_| self.range_state(RANGE_SCALE))
    }

    /// Returns the estimated offset of a radio head's ranges (m); `None` without ranges.
    pub fn range_offset(&self, head: &RadioHead) -> Option<RangeState> {
        let index = self.heads.iter().position(|mine| mine.is(head))?;
        let number = FIRST_OFFSET + index;
        self.config.ranging.map(|_| self.range_state(number))
    }

    fn range_state(&self, number: usize) -> RangeState {
        let [mean, variance] = self.bias.range_state(number);
        let std = variance.max(0.0).sqrt();
        RangeState { mean, std }
    }
}
