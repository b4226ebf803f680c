//! Who told the position until another took over.
//!
//! Where a radio head is excluded, something else than what is stated leads, or trackers that have begun anew take
//! over, the position may be another at one angle. Who told it until then may still have been right: as long as a
//! change of mind may yet be taken back, the covariance covers both.

use crate::geometry::{Pose, wrap_angle};
use crate::localize::pose_estimate::PoseEstimate;

/// Squared deviations by which two positions are apart that are not both right.
const APART2: f64 = 9.0;

/// The pose of the one who told it until another took over, as seen from that one's. Both move on alike.
#[derive(Clone, Copy, Debug)]
pub(super) struct Former {
    since_s: f64,
    apart: [f64; 3],
    covariance: [[f64; 3]; 3],
}

impl Former {
    /// That somebody tells `now` who was not asked until then, when it was `before`; `None` where the two agree.
    pub fn new(before: &PoseEstimate, now: &PoseEstimate) -> Option<Self> {
        let covariance = before.covariance?;
        let [[xx, xy, _], [_, yy, _], _] = covariance;
        let [[own_xx, own_xy, _], [_, own_yy, _], _] = now.covariance?;
        let (xx, xy, yy) = (xx + own_xx, xy + own_xy, yy + own_yy);
        let (x_m, y_m) = (
            before.pose.x_m - now.pose.x_m,
            before.pose.y_m - now.pose.y_m,
        );
        let apart2 = yy * x_m * x_m - 2.0 * xy * x_m * y_m + xx * y_m * y_m;
        (apart2 > APART2 * (xx * yy - xy * xy)).then(|| Self {
            since_s: now.time_s,
            apart: [
                x_m,
                y_m,
                wrap_angle(before.pose.heading_rad - now.pose.heading_rad),
            ],
            covariance,
        })
    }

    /// Where it would be now, if it is not so long ago (s) that nothing was taken back.
    pub fn beside(&self, told: &PoseEstimate, patience_s: f64) -> Option<PoseEstimate> {
        let [x_m, y_m, heading_rad] = self.apart;
        (told.time_s - self.since_s <= patience_s).then_some(PoseEstimate {
            pose: Pose {
                x_m: told.pose.x_m + x_m,
                y_m: told.pose.y_m + y_m,
                heading_rad: told.pose.heading_rad + heading_rad,
            },
            covariance: Some(self.covariance),
            ..*told
        })
    }
}
