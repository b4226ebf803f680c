//! Where the map does not tell how the road goes on.

use super::Tracker;
use super::state::{ACROSS, ALONG, CURVATURE, HEADING, STATES};
use crate::localize::gaussian::identity;

impl Tracker {
    /// How far beyond the nearer end of the map the vehicle is believed to be (m); 0 on it.
    pub(super) fn off_map_m(&self) -> f64 {
        let along_m = self.belief.mean[ALONG];
        (self.map.as_ref()).map_or(0.0, |map| (along_m - map.length_m()).max(-along_m).max(0.0))
    }

    /// Beyond its ends the map goes on straight, but nothing says that the road does. Where the
    /// vehicle is certainly there, the path bends as it does without a map; along and across stay
    /// what they are. Back on the map it keeps to its lane again.
    pub(super) fn watch_the_ends(&mut self) {
        let beyond = self.off_map_m() > 3.0 * self.belief.covariance[ALONG][ALONG].sqrt();
        if beyond == self.beyond_map {
            return;
        }
        self.beyond_map = beyond;
        if beyond {
            let curvature_per_m = self.config.path_bend.curvature_per_m;
            self.belief.covariance[CURVATURE][CURVATURE] = curvature_per_m * curvature_per_m;
            return;
        }
        let mut forget = identity();
        forget[CURVATURE][CURVATURE] = 0.0;
        if let Some(journal) = &mut self.journal {
            journal.moved(&forget);
        }
        self.belief.mean[CURVATURE] = 0.0;
        self.belief.spread(&forget, &[[0.0; STATES]; STATES]);
        let variances = self.config.lane_keeping.stationary();
        for (state, variance) in [ACROSS, HEADING].into_iter().zip(variances) {
            let mut row = [0.0; STATES];
            row[state] = 1.0;
            self.measure(-self.belief.mean[state], &row, variance);
        }
    }
}
