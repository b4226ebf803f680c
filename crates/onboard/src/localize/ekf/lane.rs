//! Lane constraint of the map, which does not apply beyond the ends of the road and in its gaps.

use super::filter::{Ekf, OffMap};
use super::state::{ACROSS, ALONG, CURVATURE, HEADING, STATES};
use crate::gaussian::{CERTAIN_SIGMAS, identity};

/// Minimum standard deviation of the lane position, in metres or radians, for an exactly kept lane.
const MIN_LANE_STD: f64 = 1e-6;

impl Ekf {
    /// Returns the current position off the map. Beyond an end of the road, the road probably
    /// continues straight, as in the map. In a gap it does not follow the interpolated road, so
    /// that an uncertain position counts as inside the gap.
    fn off_map(&self) -> Option<OffMap> {
        let map = self.map.as_deref()?;
        let along_m = self.belief.mean[ALONG];
        let margin_m = CERTAIN_SIGMAS * self.belief.covariance[ALONG][ALONG].sqrt();
        let by_m = (along_m - map.length_m()).max(-along_m);
        if by_m > margin_m {
            return Some(OffMap::Beyond { by_m });
        }
        map.gap_between(along_m - margin_m, along_m + margin_m)
            .map(OffMap::Gap)
    }

    /// Updates whether the vehicle is off the map. Off the map, the curvature model without a map
    /// applies; along, across and heading are unchanged. Back on the map, the lane constraint
    /// applies again.
    pub(super) fn update_off_map(&mut self) {
        let off_map = self.off_map();
        let (was_off, is_off) = (self.off_map.is_some(), off_map.is_some());
        if was_off && !is_off && !self.is_in_lane() {
            return; // no information: the vehicle is certainly not in this lane
        }
        self.off_map = off_map;
        if is_off && !was_off {
            self.forget_curvature();
            let along_m = self.belief.mean[ALONG];
            let map = self.map.as_ref();
            self.belief.mean[CURVATURE] = map.map_or(0.0, |map| map.curvature_per_m(along_m));
            self.belief.covariance[CURVATURE][CURVATURE] = self.config.curvature_variance();
        } else if was_off && !is_off {
            self.forget_curvature();
            self.apply_lane_constraint();
        }
    }

    /// Whether the vehicle has left its lane on a known road: it turned off, or its yaw rate is wrong.
    pub(crate) fn has_left_lane(&self) -> bool {
        self.map.is_some() && self.off_map.is_none() && !self.is_in_lane()
    }

    /// Whether the vehicle may be in its lane, with the probability that is required for the use of
    /// an angle.
    fn is_in_lane(&self) -> bool {
        let lane = self.config.lane_keeping.stationary();
        ([ACROSS, HEADING].into_iter().zip(lane)).all(|(state, lane_variance)| {
            let variance = self.belief.covariance[state][state] + lane_variance;
            self.belief.mean[state].powi(2) <= self.config.gate * variance
        })
    }

    fn forget_curvature(&mut self) {
        let mut forget = identity();
        forget[CURVATURE][CURVATURE] = 0.0;
        if let Some(journal) = &mut self.journal {
            journal.moved(&forget);
        }
        self.belief.mean[CURVATURE] = 0.0;
        self.belief.spread(&forget, &[[0.0; STATES]; STATES]);
        self.bias.moved(&forget);
    }

    /// Applies the lane constraint as a measurement. The state may already contain the lane
    /// constraint of a position a short distance before. Along each principal axis of the
    /// normalised covariance of lateral offset and heading, the updated variance is therefore the
    /// smaller one of the state's and the lane's.
    fn apply_lane_constraint(&mut self) {
        let lane = self.config.lane_keeping.stationary();
        let [offset_m, heading_rad] = lane.map(|variance| variance.sqrt().max(MIN_LANE_STD));
        let covariance = &self.belief.covariance;
        let (dd, dp, pp) = (
            covariance[ACROSS][ACROSS] / (offset_m * offset_m),
            covariance[ACROSS][HEADING] / (offset_m * heading_rad),
            covariance[HEADING][HEADING] / (heading_rad * heading_rad),
        );
        let (sin, cos) = (0.5 * (2.0 * dp).atan2(dd - pp)).sin_cos();
        for (offset, heading) in [(cos, sin), (-sin, cos)] {
            let mut row = [0.0; STATES];
            row[ACROSS] = offset / offset_m;
            row[HEADING] = heading / heading_rad;
            let known = self.belief.variance_along(&row);
            if known > 1.0 {
                let found = row[ACROSS] * self.belief.mean[ACROSS]
                    + row[HEADING] * self.belief.mean[HEADING];
                // 1/R = 1 − 1/P yields a variance of one.
                self.measure(-found, &row, known / (known - 1.0));
            }
        }
    }
}
