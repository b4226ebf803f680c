//! From the state to a pose and the road under it.

use super::sighting::Footing;
use super::state::{ACROSS, ALONG, CURVATURE, HEADING, STATES};
use crate::geometry::Pose;
use crate::road::Road;

/// The pose `ahead_m` further on than the state says, and the road under it.
pub fn locate(mean: &[f64; STATES], ahead_m: f64, map: Option<&Road>) -> (Pose, Footing) {
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
