//! From the state to the pose in the map frame.

use super::Tracker;
use super::sighting::Footing;
use super::state::{ACROSS, ALONG, Belief, CURVATURE, HEADING, SCALE, STATES};
use crate::geometry::Pose;
use crate::localize::PoseEstimate;
use crate::world::Track;

impl Tracker {
    /// The pose at `time_s`, carried on from the newest odometry at its speed.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        let (lag_m, lag_variance) = self.coasting(time_s);
        self.pose_of(&self.belief, time_s, lag_m, lag_variance)
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

    /// The pose of a belief, `lag_m` further on than it says.
    pub(super) fn pose_of(
        &self,
        belief: &Belief,
        time_s: f64,
        lag_m: f64,
        lag_variance: f64,
    ) -> PoseEstimate {
        let map = self.map.as_deref();
        let (pose, footing) = locate(&belief.mean, lag_m, map);
        let (sin, cos) = footing.direction_rad.sin_cos();
        // (x, y, heading) by (along, across, heading).
        let jacobian = [
            [cos * footing.stretch, -sin, 0.0],
            [sin * footing.stretch, cos, 0.0],
            [footing.curvature_per_m, 0.0, 1.0],
        ];
        let mut inner = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                inner[i][j] = belief.covariance[i][j];
            }
        }
        inner[0][0] += lag_variance;
        let mut covariance = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    for l in 0..3 {
                        covariance[i][j] += jacobian[i][k] * inner[k][l] * jacobian[j][l];
                    }
                }
            }
        }
        PoseEstimate {
            time_s,
            pose,
            covariance: Some(covariance),
            integrity: None,
        }
    }
}

/// The pose `ahead_m` further on than the state says, and the road under it.
pub(super) fn locate(mean: &[f64; STATES], ahead_m: f64, map: Option<&Track>) -> (Pose, Footing) {
    let Some(map) = map else {
        let pose = Pose {
            x_m: mean[ALONG],
            y_m: mean[ACROSS],
            heading_rad: mean[HEADING],
        };
        return (pose.along_arc(ahead_m, mean[CURVATURE]), Footing::PLANE);
    };
    let along_m = mean[ALONG] + ahead_m;
    let road = map.pose(along_m);
    let curvature_per_m = map.curvature_per_m(along_m);
    let footing = Footing {
        direction_rad: road.heading_rad,
        stretch: 1.0 - curvature_per_m * mean[ACROSS],
        curvature_per_m,
    };
    let across_m = mean[ACROSS] + ahead_m * mean[HEADING];
    let heading_rad = road.heading_rad + mean[HEADING];
    let pose = Pose {
        heading_rad,
        ..road.offset_left(across_m)
    };
    (pose, footing)
}
