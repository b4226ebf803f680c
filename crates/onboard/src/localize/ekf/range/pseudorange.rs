//! Prediction that ranges, carrier phases and range rates share: the line of sight at the time of
//! the measurement, and the distance with its second-order terms.

use super::blocked_path::BlockedPath;
use super::late_path::LatePath;
use crate::gaussian::Innovation;
use crate::geometry::Pose;
use crate::localize::bias::{HeadState, RangeTerms};
use crate::localize::ekf::angle_model::{ArrayModel, LineOfSight, RoadFrame, locate};
use crate::localize::ekf::filter::Ekf;
use crate::localize::ekf::motion::Step;
use crate::localize::ekf::state::{ALONG, DATUM, STATES};
use crate::localize::output::UpdateReason;
use crate::radio_head::RadioHead;
use crate::range::{RangeMeasurement, RangeModel, RangeQuantity};

/// Prediction and innovation of a measurement.
#[derive(Clone, Copy, Debug)]
pub(in crate::localize) struct PredictedRange {
    pub excluded: bool,
    pub quantity: RangeQuantity,
    /// Index of the radio head.
    pub(super) index: usize,
    pub(super) row: [f64; STATES],
    pub(super) terms: RangeTerms,
    /// Specified variance of the measurement's own noise.
    pub(super) stated_variance: f64,
    /// Time of the measurement (s).
    pub(super) time_s: f64,
    /// Fraction of the measurement that is independent of the previous one of its radio head.
    pub information_fraction: f64,
    /// Distance driven at the measurement (m).
    pub(super) place_m: f64,
    /// Whether a carrier phase starts a new sequence, because its number of wavelengths is unknown.
    pub is_new_sequence: bool,
    /// State that the carrier phase then determines: phase offset of the radio head or of all.
    pub(super) phase_state: usize,
    /// Innovation in metres; of a range rate in m/s.
    pub innovation: Innovation,
    /// First path before a range, according to the ranges before it.
    pub(super) path: LatePath,
    /// First path after a range, and probability that the range has a clear path and is no outlier.
    pub(super) path_after: LatePath,
    pub(super) clear_probability: f64,
    /// Additional distance of a blocked path that the ranges do not show.
    pub(super) unnoticed: BlockedPath,
}

/// Line of sight to a radio head at the time of a measurement.
pub(super) struct Sighted<'a> {
    pub model: &'a RangeModel,
    pub index: usize,
    pub excluded: bool,
    pub head: &'a RadioHead,
    pub mean: [f64; STATES],
    pub pose: Pose,
    pub frame: RoadFrame,
    pub sight: LineOfSight,
    pub blocked: BlockedPath,
    /// Time of the measurement (s).
    pub time_s: f64,
    /// Time since the newest odometry (s).
    pub lag_s: f64,
    /// Distance driven at the measurement (m), and since the last used range of the radio head.
    pub place_m: f64,
    pub travelled_m: f64,
    /// Variance of the clocks' random walk relative to the specified one.
    clock_ratio: f64,
    ahead_variance: f64,
    ahead: Option<Step>,
}

/// Distance to a radio head.
pub(super) struct Distance {
    /// Expected distance (m), and its derivative by the state at the newest odometry.
    pub range_m: f64,
    pub row: [f64; STATES],
    /// Variance of the prediction in addition to that of the state (m²).
    pub variance: f64,
    /// Part of the variance that is due to the curvature of the distance.
    pub curvature_variance: f64,
}

impl Ekf {
    /// Returns the line of sight for a measurement, or the reason why it is unusable.
    pub(super) fn sight<'a>(
        &'a self,
        head: &RadioHead,
        measured: &RangeMeasurement,
        sigma: f64,
    ) -> Result<Sighted<'a>, UpdateReason> {
        let model = self.config.ranging.as_ref();
        let model = model.ok_or(UpdateReason::Unusable)?;
        let usable = measured.time_s.is_finite()
            && measured.value.is_finite()
            && sigma.is_finite()
            && sigma > 0.0
            && self.journal.is_none();
        if !usable {
            return Err(UpdateReason::Unusable);
        }
        let (index, head) = self.head_of(head, measured.time_s)?;
        // Predict to the time of the measurement.
        let (ahead_m, ahead_variance, ahead) = self.coast(measured.time_s);
        let place_m = self.driven_m + ahead_m;
        let mean = *(ahead.as_ref()).map_or(&self.belief.mean, |ahead| &ahead.mean);
        let (pose, frame) = locate(&mean, 0.0, self.map.as_deref());
        let position_m = if measured.quantity == RangeQuantity::CarrierPhase {
            model.phase_position_m
        } else {
            model.position_m
        };
        let antenna = ArrayModel {
            position_m,
            ..self.config.array
        };
        let sight = LineOfSight::new(&head.known, pose, &frame, &mean, &antenna)
            .ok_or(UpdateReason::Unusable)?;
        let lag_s = if self.odometry.is_some() {
            (measured.time_s - self.time_s()).max(0.0)
        } else {
            0.0
        };
        Ok(Sighted {
            model,
            index,
            excluded: head.excluded,
            head: &head.known,
            mean,
            pose,
            frame,
            sight,
            blocked: head.blocked,
            time_s: measured.time_s,
            lag_s,
            clock_ratio: self.clock_noise.ratio(),
            place_m,
            travelled_m: (place_m - head.last_range_m).abs(),
            ahead_variance,
            ahead,
        })
    }

    /// Returns the expected distance times `scale`.
    pub(super) fn distance(&self, seen: &Sighted<'_>, scale: f64) -> Distance {
        let sight = &seen.sight;
        // A displacement towards the radio head reduces the distance.
        let cos_elevation = scale * sight.cos_elevation();
        let mut row = sight.position_rows[0].map(|entry| -cos_elevation * entry);
        let (north, east) = sight.bearing_rad.sin_cos();
        (row[DATUM[0]], row[DATUM[1]]) = (cos_elevation * east, cos_elevation * north);
        // Second-order term: a lateral deviation increases the distance.
        let second_order_m =
            scale * self.belief.variance_along(&sight.position_rows[1]) / sight.range_m;
        let coasted = row[ALONG].powi(2) * seen.ahead_variance;
        let (row, odometry_variance) = seen.to_newest(row);
        Distance {
            range_m: scale * sight.range_m + 0.5 * second_order_m,
            row,
            variance: coasted + odometry_variance + 0.5 * second_order_m * second_order_m,
            curvature_variance: 0.5 * second_order_m * second_order_m,
        }
    }

    /// Returns the prediction of a measurement with this residual, whose own noise has the specified
    /// variance times `ratio`.
    #[expect(clippy::too_many_arguments, reason = "members of the prediction")]
    pub(super) fn predicted(
        &self,
        seen: &Sighted<'_>,
        quantity: RangeQuantity,
        residual: f64,
        row: [f64; STATES],
        terms: RangeTerms,
        stated_variance: f64,
        [ratio, model_variance]: [f64; 2],
    ) -> PredictedRange {
        let known = self.belief.variance_along(&row) + self.bias.range_variance(&row, &terms);
        let measurement_variance = ratio * stated_variance + model_variance;
        PredictedRange {
            excluded: seen.excluded,
            quantity,
            index: seen.index,
            row,
            terms,
            stated_variance,
            time_s: seen.time_s,
            information_fraction: 1.0,
            place_m: seen.place_m,
            is_new_sequence: false,
            phase_state: HeadState::PhaseOffset.number(seen.index, self.heads.len(), seen.model),
            innovation: Innovation {
                residual,
                variance: known.max(0.0) + measurement_variance,
                measurement_variance,
            },
            path: LatePath::CLEAR,
            path_after: LatePath::CLEAR,
            clear_probability: 1.0,
            unnoticed: BlockedPath::NEVER,
        }
    }
}

impl PredictedRange {
    /// Returns the innovation of a path that is certainly clear.
    pub fn clear_innovation(&self) -> Innovation {
        let unnoticed_variance = self.unnoticed.variance();
        Innovation {
            residual: self.innovation.residual + self.unnoticed.late_m(),
            variance: self.innovation.variance - unnoticed_variance,
            measurement_variance: self.innovation.measurement_variance - unnoticed_variance,
        }
    }

    /// Returns the probability that a range is late, according to the ranges before it; at least the prior one, because late
    /// ranges of a path that was clear are no evidence about the position. 0 for other measurements.
    pub fn late_probability(&self) -> f64 {
        if self.quantity == RangeQuantity::Range {
            self.path.probability().max(LatePath::PRIOR.probability())
        } else {
            0.0
        }
    }

    /// Whether a range is probably late because its path is blocked, so that it must not be used.
    pub fn is_late(&self) -> bool {
        self.path_after.is_blocked()
    }

    /// Returns the innovation with the variance of the independent part of the measurement.
    pub fn independent_innovation(&self) -> Innovation {
        let Innovation {
            residual,
            variance,
            measurement_variance,
        } = self.innovation;
        let independent_variance = measurement_variance / self.information_fraction;
        Innovation {
            residual,
            variance: variance - measurement_variance + independent_variance,
            measurement_variance: independent_variance,
        }
    }
}

impl Sighted<'_> {
    /// Converts a row to the state at the newest odometry. Returns the row, and the variance of the
    /// step since then.
    pub fn to_newest(&self, row: [f64; STATES]) -> ([f64; STATES], f64) {
        (self.ahead.as_ref()).map_or((row, 0.0), |ahead| ahead.seen_before(&row))
    }

    /// Returns the variance of the random walk of both clocks, of vehicle and radio head (m²/s).
    pub fn clock_walk(&self) -> f64 {
        let [_, head_wander] = self.model.head_clock(&self.head.clock);
        let wander = self.model.clock_wander_m_per_sqrt_s.powi(2) + head_wander.powi(2);
        self.clock_ratio * wander
    }

    /// Returns the variance of the clocks of vehicle and radio head since the newest odometry (m²).
    pub fn clock_variance(&self) -> f64 {
        // The clock drift has a random walk during the lag.
        let drift_walk = self.model.drift_walk_mps_per_sqrt_s.powi(2);
        self.clock_walk() * self.lag_s + drift_walk * self.lag_s.powi(3) / 3.0
    }
}
