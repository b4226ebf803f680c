//! Saved state across restarts of the program: pose, calibration and excluded radio heads.

use serde::{Deserialize, Serialize};

use super::error::LiveError;
use super::feed::Live;
use super::outcome::HeadStatus;
use super::status::State;
use crate::geometry::{Pose, wrap_angle};
use crate::localize::PoseEstimate;
use crate::localize::ekf::{EstimatedConstant, EstimatedConstants};
use crate::observation::OdometrySample;
use crate::road::Road;
use crate::settings::Vehicle;

/// Protection level in standard deviations: at 10⁻⁷ a horizontal error exceeds 5.3 of them.
const SIGMAS_OF_LEVEL: f64 = 5.0;

/// Maximum growth of the position's standard deviation for which a saved pose is resumed, in
/// metres. Above it, a search over the site is more reliable than a search around the pose.
pub const MAX_GROWTH_M: f64 = 10.0;

/// Relative standard deviation of a distance measured by the odometer's counter, including slip and
/// an unknown calibration.
const COUNTER_STD: f64 = 0.05;

/// Standard deviation of the position of a vehicle whose distance counter did not change (m): it
/// may have been pushed.
const STANDING_STD_M: f64 = 0.05;
/// Standard deviation of the heading of a vehicle whose distance counter did not change (rad): it
/// may have been turned on the spot.
const STANDING_STD_RAD: f64 = 0.02;

/// Standard deviation of the yaw change per distance, in rad/m: half the curvature of a bend with a
/// radius of 3 m.
const TURN_STD_RAD_PER_M: f64 = 0.17;

/// Maximum angle in radians between the heading of a vehicle and the road that it follows, and standard deviation of
/// this angle after the motion.
const MAX_FROM_ROAD_RAD: f64 = 0.3;
const FROM_ROAD_STD_RAD: f64 = 0.05;

/// Factor for the estimated standard deviations of a calibration, because it ages and is correlated
/// with the pose.
const CALIBRATION_FACTOR: f64 = 2.0;

/// Estimated constant: value and standard deviation.
pub type Calibration = [f64; 2];

/// Pose, calibration and excluded radio heads at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedState {
    /// Time of the pose by the odometry's clock, in seconds.
    pub time_s: f64,
    /// Pose in metres and radians.
    pub pose: Pose,
    /// Standard deviation of the position along its worst axis, in metres.
    pub position_std_m: f64,
    /// Standard deviation of the heading, in radians.
    pub heading_std_rad: f64,
    /// Distance counter of the odometer, in metres; `None` if the odometry contains speeds only.
    pub distance_m: Option<f64>,
    /// Speed in m/s.
    pub speed_mps: f64,
    /// Yaw rate in rad/s, if it is measured.
    pub yaw_rate_radps: Option<f64>,
    /// Odometer scale: distance measured per distance driven, and its standard deviation.
    pub odometer_scale: Option<Calibration>,
    /// Bias of the yaw rate in rad/s, and its standard deviation.
    pub yaw_rate_bias_radps: Option<Calibration>,
    /// Mounting angle of the array in radians, and its standard deviation.
    pub mounting_rad: Option<Calibration>,
    /// Phase of the array in radians per element, and its standard deviation.
    pub phase_rad: Option<Calibration>,
    /// PCIs of the radio heads that the user has excluded.
    pub excluded: Vec<u16>,
    /// PCIs of the radio heads that the integrity monitor has found faulty.
    pub faulty: Vec<u16>,
}

/// Motion of the vehicle between a saved state and the first odometry after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resumption {
    /// Elapsed time in seconds.
    pub elapsed_s: f64,
    /// Distance driven according to the odometer's counter, in metres; `None` if it is unknown.
    pub driven_m: Option<f64>,
    /// Standard deviation of the position after the motion, in metres.
    pub position_std_m: f64,
    /// Standard deviation of the heading after the motion, in radians.
    pub heading_std_rad: f64,
}

impl SavedState {
    /// Returns the motion since this state was saved `elapsed_s` seconds ago; `sample` is the first
    /// odometry after the restart. Returns `None` if the position's standard deviation would grow
    /// by more than [`MAX_GROWTH_M`].
    pub fn resumption(
        &self,
        elapsed_s: f64,
        sample: &OdometrySample,
        top_speed_mps: f64,
    ) -> Option<Resumption> {
        let reach_m = top_speed_mps * elapsed_s;
        let counted_m = self.distance_m.map(|before_m| sample.distance_m - before_m);
        // A counter that was reset in the meantime contains no information.
        let driven_m = counted_m.filter(|it| it.abs() <= reach_m + STANDING_STD_M);
        let (growth_m, distance_m) = match driven_m {
            Some(driven_m) => {
                let distance_m = driven_m.abs();
                let turn_std_rad = (TURN_STD_RAD_PER_M * distance_m).min(1.0);
                let across_m = 0.5 * distance_m * turn_std_rad;
                let along_m = COUNTER_STD * distance_m;
                (STANDING_STD_M.hypot(along_m).hypot(across_m), distance_m)
            }
            // The position is anywhere within reach: the standard deviation of a disc along each
            // axis is half its radius.
            None => (STANDING_STD_M.hypot(0.5 * reach_m), reach_m),
        };
        let turn_rad = STANDING_STD_RAD.hypot(TURN_STD_RAD_PER_M * distance_m);
        let heading_std_rad = self.heading_std_rad.hypot(turn_rad);
        (growth_m <= MAX_GROWTH_M).then(|| Resumption {
            elapsed_s,
            driven_m,
            position_std_m: self.position_std_m.hypot(growth_m),
            heading_std_rad: heading_std_rad.min(std::f64::consts::PI),
        })
    }

    /// Returns pose and motion if the vehicle has followed the road by the counted distance; `None` if it was not on the
    /// road, or if the distance is unknown. On the road, the position across the road remains known.
    fn along_road(&self, by: &Resumption, road: &Road) -> Option<(Pose, Resumption)> {
        let driven_m = by.driven_m?;
        let before = road.project(self.pose.point());
        let is_on_road = before.lateral_m.abs() <= 0.5 * road.width_m() + self.position_std_m;
        let from_road_rad =
            wrap_angle(self.pose.heading_rad - road.pose(before.along_m).heading_rad);
        // The road is driven in both directions.
        let direction = from_road_rad.cos().signum();
        if !(is_on_road && from_road_rad.sin().abs() <= MAX_FROM_ROAD_RAD.sin()) {
            return None;
        }
        let after = road.pose(before.along_m + direction * driven_m);
        let pose = Pose {
            heading_rad: after.heading_rad + from_road_rad,
            ..after.offset_left(before.lateral_m)
        };
        let growth_m = STANDING_STD_M.hypot(COUNTER_STD * driven_m);
        let motion = Resumption {
            position_std_m: self.position_std_m.hypot(growth_m).min(by.position_std_m),
            heading_std_rad: self
                .heading_std_rad
                .hypot(FROM_ROAD_STD_RAD)
                .min(by.heading_std_rad),
            ..*by
        };
        Some((pose, motion))
    }

    /// Returns the pose after the motion: along an arc of the last yaw rate, by the counted
    /// distance. Without a counted distance, half the distance at the last speed is assumed.
    fn moved(&self, by: &Resumption) -> Pose {
        let distance_m = by.driven_m.unwrap_or(0.5 * self.speed_mps * by.elapsed_s);
        let turn_rad = self.yaw_rate_radps.unwrap_or(0.0) * by.elapsed_s;
        let is_plausible = turn_rad.abs() <= 2.0 * by.heading_std_rad && distance_m != 0.0;
        self.pose
            .along_chord(distance_m, if is_plausible { turn_rad } else { 0.0 })
    }
}

impl Live {
    /// Returns the state to save; `None` before the first pose and during a search.
    ///
    /// # Errors
    /// [`LiveError::Custom`].
    pub fn saved_state(&self) -> Result<Option<SavedState>, LiveError> {
        let Some(newest) = self.onboard().newest_odometry() else {
            return Ok(None);
        };
        let time_s = self.newest_odometry_s().unwrap_or(newest.time_s);
        let status = self.status(time_s)?;
        let is_found = !matches!(
            status.state,
            State::Waiting | State::Searching | State::Lost
        );
        let (Some(pose), Some(covariance), true) = (status.pose, status.covariance, is_found)
        else {
            return Ok(None);
        };
        let estimate = PoseEstimate {
            time_s,
            pose,
            covariance: Some(covariance),
            integrity: None,
        };
        let [largest, _] = estimate.principal_variances();
        let [.., [.., heading]] = covariance;
        // The protection level covers faults that the filter's own covariance does not.
        let level_m = status.protection_level_m.unwrap_or(0.0);
        let constants = self.onboard().constants();
        let learned = |of: fn(&EstimatedConstants) -> EstimatedConstant| {
            let it = of(constants.as_ref()?);
            (it.stated_std > 0.0 && it.std < it.stated_std).then_some([it.found, it.std])
        };
        let pcis = |is: fn(&HeadStatus) -> bool| {
            let mut pcis: Vec<u16> = (self.heads().iter())
                .filter(|it| is(it))
                .map(|it| it.head.pci)
                .collect();
            pcis.dedup();
            pcis
        };
        Ok(Some(SavedState {
            time_s,
            pose,
            position_std_m: largest.max(0.0).sqrt().max(level_m / SIGMAS_OF_LEVEL),
            heading_std_rad: heading.max(0.0).sqrt(),
            distance_m: self.has_distance().then_some(newest.distance_m),
            speed_mps: status.speed_mps,
            yaw_rate_radps: status.yaw_rate_radps,
            odometer_scale: learned(|it| it.odometer_scale),
            yaw_rate_bias_radps: learned(|it| it.yaw_rate_bias_radps),
            mounting_rad: learned(|it| it.mounting_rad),
            phase_rad: learned(|it| it.phase_rad),
            excluded: pcis(|it| it.is_excluded),
            faulty: pcis(|it| it.is_faulty),
        }))
    }

    /// Resumes a state that was saved `elapsed_s` seconds ago, before its first odometry, `sample`,
    /// is processed. Returns the assumed motion, or `None` if the vehicle may have moved too far;
    /// nothing is changed in this case. Excluded radio heads are excluded again. Faulty radio heads
    /// must be identified again.
    ///
    /// # Errors
    /// Those of [`set_pose`](Self::set_pose).
    pub fn resume(
        &mut self,
        saved: &SavedState,
        elapsed_s: f64,
        sample: &OdometrySample,
    ) -> Result<Option<Resumption>, LiveError> {
        let top_speed_mps = self.vehicle().top_speed_mps();
        let Some(by) = saved.resumption(elapsed_s.max(0.0), sample, top_speed_mps) else {
            return Ok(None);
        };
        let road = (self.site().build_road()?).filter(|_| self.vehicle().follows_road());
        let (pose, by) = (road.and_then(|road| saved.along_road(&by, &road)))
            .unwrap_or_else(|| (saved.moved(&by), by));
        let mut vehicle = calibrated(self.vehicle(), saved);
        vehicle.start.known = true;
        vehicle.start.position_std_m = by.position_std_m;
        vehicle.start.heading_std_rad = by.heading_std_rad;
        self.begin_at(&vehicle, pose)?;
        for &pci in &saved.excluded {
            // The radio head may have been removed from the site.
            if let Err(error) = self.exclude(pci)
                && !matches!(error, LiveError::UnknownCell { .. })
            {
                return Err(error);
            }
        }
        Ok(Some(by))
    }
}

/// Returns the vehicle with the saved calibration of all constants for which the vehicle file
/// specifies a standard deviation.
fn calibrated(vehicle: &Vehicle, saved: &SavedState) -> Vehicle {
    let mut vehicle = vehicle.clone();
    let take = |value: &mut f64, std: &mut f64, found: Option<Calibration>| {
        if let Some([found, found_std]) = found
            && *std > 0.0
            && found.is_finite()
            && found_std >= 0.0
        {
            *value = found;
            *std = std
                .min(CALIBRATION_FACTOR * found_std)
                .max(f64::MIN_POSITIVE);
        }
    };
    let odometer = &mut vehicle.odometer;
    take(
        &mut odometer.scale,
        &mut odometer.scale_std,
        saved.odometer_scale,
    );
    if let Some(gyroscope) = &mut vehicle.gyroscope {
        take(
            &mut gyroscope.bias_radps,
            &mut gyroscope.bias_std_radps,
            saved.yaw_rate_bias_radps,
        );
    }
    let array = &mut vehicle.array;
    if let Some(std_rad) = &mut array.mounting_std_rad {
        take(&mut array.mounting_rad, std_rad, saved.mounting_rad);
    }
    if let Some(std_rad) = &mut array.phase_std_rad {
        take(&mut array.phase_rad, std_rad, saved.phase_rad);
    }
    vehicle
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn saved(distance_m: Option<f64>) -> SavedState {
        SavedState {
            time_s: 100.0,
            pose: Pose {
                x_m: 1.0,
                y_m: 2.0,
                heading_rad: 0.0,
            },
            position_std_m: 0.2,
            heading_std_rad: 0.01,
            distance_m,
            speed_mps: 1.5,
            yaw_rate_radps: Some(0.1),
            odometer_scale: Some([1.01, 0.001]),
            yaw_rate_bias_radps: None,
            mounting_rad: None,
            phase_rad: None,
            excluded: Vec::new(),
            faulty: Vec::new(),
        }
    }

    fn odometry(distance_m: f64) -> OdometrySample {
        OdometrySample {
            time_s: 0.0,
            distance_m,
            speed_mps: 1.5,
            yaw_rate_radps: None,
        }
    }

    #[test]
    fn the_covariance_increases_by_the_counted_distance_or_the_reachable_distance() {
        let by = |state: SavedState, elapsed_s, distance_m| {
            state.resumption(elapsed_s, &odometry(distance_m), 2.0)
        };
        let stood = by(saved(Some(50.0)), 300.0, 50.0).unwrap();
        assert_eq!(stood.driven_m, Some(0.0));
        assert!(stood.position_std_m < 0.21, "{stood:?}");
        let drove = by(saved(Some(50.0)), 3.0, 54.5).unwrap();
        // A bend with a radius of 6 m displaces the vehicle laterally by 4.5²/(2·6) = 1.7 m.
        assert!((1.5..2.0).contains(&drove.position_std_m), "{drove:?}");
        // The counter was reset to zero.
        let unknown = by(saved(Some(50.0)), 3.0, 0.0).unwrap();
        assert_eq!(unknown.driven_m, None);
        assert_eq!(unknown, by(saved(None), 3.0, f64::NAN).unwrap());
        assert!((3.0..3.1).contains(&unknown.position_std_m), "{unknown:?}");
        assert_eq!(by(saved(None), 30.0, 0.0), None);
    }

    #[test]
    fn the_pose_moves_on_by_the_counted_distance() {
        let state = saved(Some(50.0));
        let by = state.resumption(2.0, &odometry(53.0), 2.0).unwrap();
        let moved = state.moved(&by);
        let chord_m = moved.point().distance_m(state.pose.point());
        assert!((chord_m - 3.0).abs() < 0.02, "{chord_m}");
        assert!((moved.heading_rad - 0.2).abs() < 1e-12);
    }

    /// The vehicle enters a bend of 8 m radius at 20 m after the state was saved.
    #[test]
    fn the_pose_follows_the_road_by_the_counted_distance() {
        let corners =
            [(0.0, 0.0), (28.0, 0.0), (28.0, 40.0)].map(|(x_m, y_m)| Point::new(x_m, y_m));
        let road = Road::from_polyline(&corners, 8.0, 4.0).unwrap();
        let state = SavedState {
            pose: Pose {
                x_m: 19.0,
                y_m: 0.3,
                heading_rad: 0.02,
            },
            ..saved(Some(50.0))
        };
        let by = state.resumption(2.0, &odometry(55.0), 4.0).unwrap();
        let (pose, on_road) = state.along_road(&by, &road).unwrap();
        let expected = road.pose(24.0);
        let aside_m = pose.point().distance_m(expected.point());
        assert!((aside_m - 0.3).abs() < 0.01, "{aside_m}");
        assert!((pose.heading_rad - expected.heading_rad - 0.02).abs() < 1e-9);
        // 5 % of 5 m in addition to 0.2 m, instead of a bend of 3 m radius in either direction.
        assert!(
            on_road.position_std_m < 0.35 && by.position_std_m > 2.0,
            "{on_road:?}"
        );
        // The vehicle may drive on the road in the opposite direction, but not across it.
        let turned = |by_rad: f64| SavedState {
            pose: Pose {
                heading_rad: state.pose.heading_rad + by_rad,
                ..state.pose
            },
            ..state.clone()
        };
        let (back, _) = turned(std::f64::consts::PI).along_road(&by, &road).unwrap();
        assert!((back.x_m - 14.0).abs() < 0.01, "{back:?}");
        assert_eq!(turned(1.0).along_road(&by, &road), None);
    }

    #[test]
    fn a_saved_state_round_trips_through_a_file() {
        let state = saved(None);
        let text = serde_json::to_string(&state).unwrap();
        assert_eq!(serde_json::from_str::<SavedState>(&text).unwrap(), state);
    }
}
