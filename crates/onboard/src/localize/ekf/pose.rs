//! What comes out: the pose in the map frame, at any time, and smoothed after the drive.

use super::angle_model::locate;
use super::filter::Ekf;
use super::smoother::Journal;
use super::state::{Belief, SCALE};
use crate::localize::gaussian::transformed;
use crate::localize::pose_estimate::PoseEstimate;

/// Nothing is known better than to a nanometre and a nanoradian: so much the covariance says at
/// least, though a belief that began exactly has no width.
const LEAST_VARIANCE: f64 = 1e-18;

impl Ekf {
    /// The pose at `time_s`, carried on from the newest odometry at its speed.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        let (_, lag_variance) = self.coasting(time_s);
        self.pose_of(&self.forecast(time_s), time_s, lag_variance)
    }

    /// Distance driven since the newest odometry, and its variance.
    pub(super) fn coasting(&self, time_s: f64) -> (f64, f64) {
        let Some(sample) = self.odometry else {
            return (0.0, 0.0);
        };
        let lag_s = (time_s - sample.time_s).max(0.0);
        (
            self.speed_mps() * lag_s,
            self.config.coasting_variance(lag_s),
        )
    }

    /// Speed along the heading (m/s).
    pub fn speed_mps(&self) -> f64 {
        let reading = self.odometry.map_or(0.0, |sample| sample.speed_mps);
        reading / (1.0 + self.belief.mean[SCALE])
    }

    /// The pose of a belief whose place along the way has so much more variance than it says.
    pub(super) fn pose_of(&self, belief: &Belief, time_s: f64, lag_variance: f64) -> PoseEstimate {
        let map = self.map.as_deref();
        let (pose, frame) = locate(&belief.mean, 0.0, map);
        let (sin, cos) = frame.direction_rad.sin_cos();
        // (x, y, heading) by (along, across, heading).
        let jacobian = [
            [cos * frame.stretch, -sin, 0.0],
            [sin * frame.stretch, cos, 0.0],
            [frame.curvature_per_m, 0.0, 1.0],
        ];
        let mut inner = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                inner[i][j] = belief.covariance[i][j];
            }
        }
        inner[0][0] += lag_variance;
        let mut covariance = transformed(&jacobian, &inner);
        for i in 0..3 {
            covariance[i][i] += LEAST_VARIANCE;
        }
        PoseEstimate {
            time_s,
            pose,
            covariance: Some(covariance),
            integrity: None,
        }
    }
}

impl Ekf {
    /// Keeps a journal from now on, from which the drive can be smoothed; it grows by about 2 kB
    /// with each odometry sample.
    pub fn keep_journal(&mut self) {
        self.journal.get_or_insert_default();
    }

    /// The poses at the odometry samples since the journal was begun, by everything that is known
    /// now; none without a journal.
    pub fn smoothed(&self) -> Vec<PoseEstimate> {
        let journal = self.journal.iter();
        let beliefs = journal.flat_map(Journal::smoothed);
        beliefs
            .map(|(time_s, belief)| self.pose_of(&belief, time_s, 0.0))
            .collect()
    }

    pub(super) fn ask(&mut self, time_s: f64) {
        if let Some(journal) = &mut self.journal {
            journal.asked(time_s, &self.belief, self.bias.state_covariance());
        }
    }
}
