//! Whether the vehicle is in a lane of the map: beyond its ends and in its gaps it is not.

use super::filter::{Ekf, OffMap};
use super::state::{ACROSS, ALONG, CURVATURE, HEADING, STATES};
use crate::gaussian::{CERTAIN_SIGMAS, identity};

/// Least deviation from the lane, in metres or radians, of a vehicle said to keep it exactly.
const LEAST_LANE_STD: f64 = 1e-6;

impl Ekf {
    /// Where the vehicle is now. Beyond an end the map goes on straight, and so may the road; in a
    /// gap it surely does not follow the guess: there the doubt is on the gap's side.
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

    /// Off the map the path bends as it does without one; along, across and heading stay what they
    /// are. Back on it the vehicle keeps to its lane again.
    pub(super) fn update_off_map(&mut self) {
        let off_map = self.off_map();
        let (was_off, is_off) = (self.off_map.is_some(), off_map.is_some());
        if was_off && !is_off && !self.is_in_lane() {
            return; // a lane that it is certainly not in tells nothing of where it is
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
            self.take_the_lane();
        }
    }

    /// Whether it may be in its lane, as sure as an angle must be to be used.
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

    /// Takes in that the vehicle is in its lane. What the belief knows already may come from the
    /// same lane, a short way back: together they count no more than the better of the two, in each
    /// of the directions, in units of the lane's own deviations, in which the belief is independent.
    fn take_the_lane(&mut self) {
        let lane = self.config.lane_keeping.stationary();
        let [offset_m, heading_rad] = lane.map(|variance| variance.sqrt().max(LEAST_LANE_STD));
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
                // 1/R = 1 − 1/P leaves a variance of one.
                self.measure(-found, &row, known / (known - 1.0));
            }
        }
    }
}
