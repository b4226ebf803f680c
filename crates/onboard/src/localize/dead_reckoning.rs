//! Localizer of the paper: angle of arrival → angle of heading → dead reckoning (section "Track,
//! Infrastructure, and Vehicle Trajectory Model").

use super::localizer::{Localizer, copy_into};
use super::output::PoseEstimate;
use super::output::{OdometryResult, UpdateReason, UpdateResult};
use crate::BoxError;
use crate::geometry::{Point, Pose, wrap_angle};
use crate::observation::{AngleMeasurement, MeasurementKind, OdometrySample};
use crate::radio_head::RadioHead;
use crate::settings::HeadingBetween;

/// Integrates odometer distances along the heading of the last angle of arrival.
///
/// No measurement corrects the position, so that heading errors accumulate in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadReckoning {
    /// Time of the current pose (s).
    time_s: f64,
    /// Distance of the odometer at the time of the current pose (m).
    distance_m: f64,
    odometry: Option<OdometrySample>,
    pose: Pose,
    /// Position of the last angle.
    anchor: Point,
    heading_between: HeadingBetween,
    mounting_rad: f64,
    in_a_row: bool,
}

impl DeadReckoning {
    /// Creates a localizer at a known pose, with an array axis at `mounting_rad` from the forward
    /// axis.
    pub const fn new(start: Pose, heading_between: HeadingBetween, mounting_rad: f64) -> Self {
        Self {
            time_s: 0.0,
            distance_m: 0.0,
            odometry: None,
            pose: start,
            anchor: start.point(),
            heading_between,
            mounting_rad,
            in_a_row: true,
        }
    }

    /// Sets a non-linear array, whose angles are azimuths.
    #[must_use]
    pub const fn by_azimuth(mut self) -> Self {
        self.in_a_row = false;
        self
    }

    /// Predicts to `time_s`, with the heading of the last angle; after the newest odometry with its
    /// speed.
    fn advance_to(&mut self, time_s: f64) {
        let Some(sample) = self.odometry.filter(|_| time_s > self.time_s) else {
            return;
        };
        let duration_s = time_s - self.time_s;
        let distance_m = sample.distance_m + sample.speed_mps * (time_s - sample.time_s);
        let step_m = distance_m - self.distance_m;
        let turn_rad = sample.yaw_rate_radps.map_or(0.0, |rate| rate * duration_s);
        let curvature_per_m = if step_m > 0.0 { turn_rad / step_m } else { 0.0 };
        self.pose = self.pose.along_arc(step_m, curvature_per_m);
        (self.time_s, self.distance_m) = (time_s, distance_m);
    }

    /// Updates the heading with an angle of arrival.
    fn take_heading(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateResult {
        // Equation 3: AoIS = tan⁻¹(Δy/Δx), from the estimated position to the radio head.
        let aois_rad = self.pose.point().bearing_rad(head.position);
        // A uniform linear array is ambiguous between left and right; the estimated pose resolves
        // the ambiguity.
        let axis_rad = self.pose.heading_rad + self.mounting_rad;
        let side = 1f64.copysign(wrap_angle(aois_rad - axis_rad));
        let aoa_rad = if self.in_a_row {
            side * measured.angle_rad
        } else {
            measured.angle_rad
        };
        // Equation 4: AoH = AoIS − AoA.
        let aoh_rad = wrap_angle(aois_rad - aoa_rad - self.mounting_rad);

        let usable = aoh_rad.is_finite();
        if usable {
            if self.heading_between == HeadingBetween::Mean {
                let half_turn_rad = 0.5 * wrap_angle(aoh_rad - self.pose.heading_rad);
                self.turn_about_anchor(half_turn_rad);
            }
            self.pose.heading_rad = aoh_rad;
            self.anchor = self.pose.point();
        }
        let reason = if usable {
            UpdateReason::Consistent
        } else {
            UpdateReason::Unusable
        };
        UpdateResult {
            accepted: usable,
            ..UpdateResult::unused(reason)
        }
    }

    /// Rotates the stretch driven since the last angle by `turn_rad`.
    fn turn_about_anchor(&mut self, turn_rad: f64) {
        let (sin, cos) = turn_rad.sin_cos();
        let (dx_m, dy_m) = (
            self.pose.x_m - self.anchor.x_m,
            self.pose.y_m - self.anchor.y_m,
        );
        self.pose.x_m = self.anchor.x_m + cos * dx_m - sin * dy_m;
        self.pose.y_m = self.anchor.y_m + sin * dx_m + cos * dy_m;
    }
}

impl Localizer for DeadReckoning {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryResult, BoxError> {
        let verdict = match self.odometry.replace(*sample) {
            None => {
                self.distance_m = sample.distance_m;
                OdometryResult::First
            }
            Some(_) => OdometryResult::Accepted,
        };
        self.advance_to(sample.time_s);
        Ok(verdict)
    }

    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        self.advance_to(measured.time_s);
        // An angle measured at the radio head does not depend on the heading.
        Ok(match measured.kind {
            MeasurementKind::Angle => self.take_heading(head, measured),
            MeasurementKind::AngleAtHead => UpdateResult::unused(UpdateReason::Unusable),
        })
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        let mut there = *self;
        there.advance_to(time_s);
        Ok(PoseEstimate {
            time_s,
            pose: there.pose,
            covariance: None, // it does not know its own error
            integrity: None,
        })
    }

    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        copy_into(self, slot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::range::{HeadClock, RangeOffset};
    use crate::road::{Road, Segment};

    /// Duration of the paper's trip (s): 300 m with 0.5 m/s² up to 15 km/h and down again.
    const TRIP_S: f64 = 80.333;

    /// Returns the position and speed on it.
    fn trip(time_s: f64) -> (f64, f64) {
        let (top_mps, ramp_s) = (15.0 / 3.6, 15.0 / 3.6 / 0.5);
        let left_s = TRIP_S - time_s;
        if time_s < ramp_s {
            (0.25 * time_s * time_s, 0.5 * time_s)
        } else if left_s < ramp_s {
            (300.0 - 0.25 * left_s * left_s, 0.5 * left_s)
        } else {
            (top_mps * (time_s - 0.5 * ramp_s), top_mps)
        }
    }

    /// Returns the maximum error on the paper's trip with exact angles every `period_s`.
    fn worst_error_m(
        between: HeadingBetween,
        turn_rad: f64,
        head: Point,
        period_s: f64,
        mounting_rad: f64,
    ) -> f64 {
        let bend = [Segment {
            length_m: 300.0,
            turn_rad,
            surveyed: true,
        }];
        let road = Road::from_segments(Pose::default(), &bend, 5.0).unwrap();
        let head = RadioHead {
            pci: 1,
            ssb_index: 0,
            position: head,
            height_m: 0.0,
            position_std_m: 0.0,
            eirp_dbm: 0.0,
            array: None,
            clock: HeadClock::default(),
            range_offset: RangeOffset::default(),
        };
        let mut localizer = DeadReckoning::new(Pose::default(), between, mounting_rad);
        let mut worst_m = 0f64;
        for step in 0..=(TRIP_S / period_s) as u32 {
            let time_s = f64::from(step) * period_s;
            let (along_m, speed_mps) = trip(time_s);
            let truth = road.pose(along_m);
            let odometry = OdometrySample {
                time_s,
                distance_m: along_m,
                speed_mps,
                yaw_rate_radps: None,
            };
            localizer.odometry(&odometry).unwrap();
            let to_axis_rad =
                truth.point().bearing_rad(head.position) - truth.heading_rad - mounting_rad;
            let measured = AngleMeasurement {
                kind: MeasurementKind::Angle,
                time_s,
                phase_rad: std::f64::consts::PI * to_axis_rad.cos(),
                phase_sigma_rad: 0.0,
                angle_rad: to_axis_rad.cos().acos(),
                snr_db: 99.0,
                resolved: true,
            };
            localizer.update(&head, &measured).unwrap();
            let found = localizer.pose(time_s).unwrap().pose;
            worst_m = worst_m.max(found.point().distance_m(truth.point()));
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
        // With the heading of the first angle, the heading lags by half of a step's turn: first
        // order in the step.
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
    fn a_nan_angle_changes_nothing() {
        let mut localizer = DeadReckoning::new(Pose::default(), HeadingBetween::Held, 0.0);
        let head = RadioHead {
            pci: 1,
            ssb_index: 0,
            position: Point::new(9.0, 9.0),
            height_m: 0.0,
            position_std_m: 0.0,
            eirp_dbm: 0.0,
            array: None,
            clock: HeadClock::default(),
            range_offset: RangeOffset::default(),
        };
        let measured = AngleMeasurement {
            kind: MeasurementKind::Angle,
            time_s: 0.0,
            phase_rad: f64::NAN,
            phase_sigma_rad: f64::NAN,
            angle_rad: f64::NAN,
            snr_db: 0.0,
            resolved: false,
        };
        assert!(!localizer.update(&head, &measured).unwrap().accepted);
        assert_eq!(localizer.pose(0.0).unwrap().pose, Pose::default());
    }
}
