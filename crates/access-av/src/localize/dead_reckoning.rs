//! The paper's localizer: angle of arrival → angle of heading → dead reckoning (section "Track,
//! Infrastructure, and Vehicle Trajectory Model").

use super::{AngleMeasurement, OdometryStep, PoseEstimate, UpdateReason, UpdateVerdict};
use crate::geometry::{Point, Pose, wrap_angle};
use crate::scenario::HeadingBetween;
use crate::world::RadioHead;

/// Adds up odometer distances along the heading that the last angle of arrival gave.
///
/// Nothing corrects the position itself: errors of the heading add up in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadReckoning {
    time_s: f64,
    pose: Pose,
    /// Where the last angle was taken.
    anchor: Point,
    heading_between: HeadingBetween,
    mounting_angle_rad: f64,
}

impl DeadReckoning {
    /// Begins at a known pose, with an array whose axis points `mounting_angle_rad` from forward.
    pub const fn new(
        start: Pose,
        heading_between: HeadingBetween,
        mounting_angle_rad: f64,
    ) -> Self {
        Self {
            time_s: 0.0,
            pose: start,
            anchor: start.point(),
            heading_between,
            mounting_angle_rad,
        }
    }

    /// Moves on by what odometry says, along the heading held since the last angle.
    pub fn predict(&mut self, step: &OdometryStep) {
        let turn_rad = step.turn_rad.unwrap_or(0.0);
        let curvature_per_m = if step.distance_m > 0.0 {
            turn_rad / step.distance_m
        } else {
            0.0
        };
        self.pose = self.pose.along_arc(step.distance_m, curvature_per_m);
        self.time_s = step.time_s;
    }

    /// Takes over the heading that an angle of arrival gives.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateVerdict {
        // Equation 3: AoIS = tan⁻¹(Δy/Δx), from the estimated position to the radio head.
        let aois_rad = self.pose.point().bearing_rad(head.position);
        // A linear array does not tell left from right; the estimated pose does.
        let axis_rad = self.pose.heading_rad + self.mounting_angle_rad;
        let side = 1f64.copysign(wrap_angle(aois_rad - axis_rad));
        let aoa_rad = side * measured.angle_rad;
        // Equation 4: AoH = AoIS − AoA.
        let aoh_rad = wrap_angle(aois_rad - aoa_rad - self.mounting_angle_rad);

        let usable = aoh_rad.is_finite();
        if usable {
            if self.heading_between == HeadingBetween::Mean {
                let half_turn_rad = 0.5 * wrap_angle(aoh_rad - self.pose.heading_rad);
                self.turn_about_anchor(half_turn_rad);
            }
            self.pose.heading_rad = aoh_rad;
            self.anchor = self.pose.point();
        }
        UpdateVerdict {
            accepted: usable,
            reason: if usable {
                UpdateReason::Consistent
            } else {
                UpdateReason::Unusable
            },
            mahalanobis_squared: None,
            threshold: None,
        }
    }

    /// Lays the stretch driven since the last angle along a heading turned by `turn_rad`.
    fn turn_about_anchor(&mut self, turn_rad: f64) {
        let (sin, cos) = turn_rad.sin_cos();
        let (dx_m, dy_m) = (
            self.pose.x_m - self.anchor.x_m,
            self.pose.y_m - self.anchor.y_m,
        );
        self.pose.x_m = self.anchor.x_m + cos * dx_m - sin * dy_m;
        self.pose.y_m = self.anchor.y_m + sin * dx_m + cos * dy_m;
    }

    /// Where it believes the vehicle to be; it does not know how well.
    pub const fn pose(&self) -> PoseEstimate {
        PoseEstimate {
            time_s: self.time_s,
            pose: self.pose,
            covariance: None,
            integrity: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::MotionSettings;
    use crate::world::{MotionProfile, Segment, Track};

    /// Worst distance from the truth on the paper's trip with perfect angles every `period_s`.
    fn worst_error_m(
        between: HeadingBetween,
        turn_rad: f64,
        head: Point,
        period_s: f64,
        mounting_angle_rad: f64,
    ) -> f64 {
        let bend = [Segment {
            length_m: 300.0,
            turn_rad,
            surveyed: true,
        }];
        let track = Track::from_segments(Pose::default(), &bend, 5.0).unwrap();
        let motion = MotionProfile::new(&MotionSettings::default(), 300.0);
        let head = RadioHead {
            pci: 1,
            ssb_index: 0,
            position: head,
            eirp_dbm: 0.0,
        };
        let mut localizer = DeadReckoning::new(Pose::default(), between, mounting_angle_rad);
        let (mut last_m, mut worst_m) = (0.0, 0f64);
        for step in 0..=(motion.duration_s() / period_s) as u32 {
            let time_s = f64::from(step) * period_s;
            let along_m = motion.at(time_s).along_m;
            let truth = track.pose(along_m);
            localizer.predict(&OdometryStep {
                time_s,
                duration_s: period_s,
                distance_m: along_m - last_m,
                turn_rad: None,
            });
            last_m = along_m;
            let to_axis_rad =
                truth.point().bearing_rad(head.position) - truth.heading_rad - mounting_angle_rad;
            localizer.update(
                &head,
                &AngleMeasurement {
                    time_s,
                    phase_rad: std::f64::consts::PI * to_axis_rad.cos(),
                    phase_sigma_rad: 0.0,
                    angle_rad: to_axis_rad.cos().acos(),
                    snr_db: 99.0,
                    resolved: true,
                },
            );
            worst_m = worst_m.max(localizer.pose().pose.point().distance_m(truth.point()));
        }
        worst_m
    }

    #[test]
    fn perfect_angles_are_exact_on_a_straight_road() {
        assert!(
            worst_error_m(
                HeadingBetween::Held,
                0.0,
                Point::new(205.0, 100.0),
                0.02,
                0.0
            ) < 1e-9
        );
    }

    #[test]
    fn in_a_bend_only_the_held_heading_remains() {
        let head = Point::new(205.0, 100.0);
        // Held over a step, the heading lags by half of the step's turn: first order in the step.
        let coarse_m = worst_error_m(HeadingBetween::Held, 0.25, head, 0.02, 0.0);
        let fine_m = worst_error_m(HeadingBetween::Held, 0.25, head, 0.002, 0.0);
        assert!(coarse_m < 0.011, "{coarse_m}");
        assert!(
            (coarse_m / fine_m - 10.0).abs() < 0.1,
            "{coarse_m} {fine_m}"
        );
    }

    #[test]
    fn mean_heading_between_two_angles_follows_the_bend() {
        let head = Point::new(205.0, 100.0);
        let mean_m = worst_error_m(HeadingBetween::Mean, 0.25, head, 0.24, 0.0);
        let held_m = worst_error_m(HeadingBetween::Held, 0.25, head, 0.24, 0.0);
        assert!(held_m > 0.1 && mean_m < 0.01, "{held_m} {mean_m}");
    }

    #[test]
    fn radio_head_on_the_right_and_a_turned_array() {
        assert!(
            worst_error_m(
                HeadingBetween::Held,
                0.0,
                Point::new(60.0, -80.0),
                0.02,
                0.0
            ) < 1e-9
        );
        assert!(
            worst_error_m(
                HeadingBetween::Held,
                0.0,
                Point::new(205.0, 100.0),
                0.02,
                0.3
            ) < 1e-9
        );
    }

    #[test]
    fn angle_that_is_no_number_changes_nothing() {
        let mut localizer = DeadReckoning::new(Pose::default(), HeadingBetween::Held, 0.0);
        let head = RadioHead {
            pci: 1,
            ssb_index: 0,
            position: Point::new(9.0, 9.0),
            eirp_dbm: 0.0,
        };
        let verdict = localizer.update(
            &head,
            &AngleMeasurement {
                time_s: 0.0,
                phase_rad: f64::NAN,
                phase_sigma_rad: f64::NAN,
                angle_rad: f64::NAN,
                snr_db: 0.0,
                resolved: false,
            },
        );
        assert!(!verdict.accepted);
        assert_eq!(localizer.pose().pose, Pose::default());
    }
}
