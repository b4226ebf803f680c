//! Localization without odometry during an odometry fault.
//!
//! A filter follows the angles. Its odometry input is its own estimated speed, with process noise
//! that covers any motion of the vehicle. Its pose must not be used, but is near the vehicle when
//! the odometry becomes valid again.

use std::sync::Arc;

use crate::geometry::Pose;
use crate::localize::ekf::EkfConfig;
use crate::localize::{self, Ekf, InitialPose, Localizer, PoseEstimate};
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::settings::{SettingsError, Site, Vehicle};

/// Duration in seconds for which the vehicle may have driven at top speed before the fault was
/// detected.
const UNDETECTED_S: f64 = 1.0;
/// Standard deviation of the heading when the fault is detected, in radians.
const HEADING_STD_RAD: f64 = 0.2;
/// Noise of the distance in m/√m, and minimum speed of the prediction in m/s; the noise is at least
/// 0.8 m/√s.
const NOISE_M_PER_SQRT_M: f64 = 1.5;
const MIN_MPS: f64 = 0.3;
/// Noise of the heading in rad/√s, because the yaw rate may also be faulty.
const NOISE_RAD_PER_SQRT_S: f64 = 0.3;
/// Interval over which the speed is measured, in seconds.
const SPEED_S: f64 = 0.5;
/// Number of standard deviations in the protection level during a fault.
const LEVEL_SIGMAS: f64 = 5.0;
/// Ratio of the localizer's initial standard deviations after the fault to those of the filter
/// without odometry.
const MARGIN: f64 = 1.0;
/// Minimum initial standard deviations after the fault, in metres and radians.
const MIN_STD_M: f64 = 0.3;
const MIN_STD_RAD: f64 = 0.05;

/// Factory of filters without odometry, and of localizers after the fault.
#[derive(Debug)]
pub struct Fallback {
    site: Site,
    vehicle: Vehicle,
    speed_mps: f64,
    distance_m: f64,
    last_s: Option<f64>,
    /// Time and pose from which the speed is measured.
    measured_from: Option<(f64, Pose)>,
}

impl Fallback {
    /// Creates the filter for a vehicle at a site.
    pub fn new(site: &Site, vehicle: &Vehicle) -> Self {
        Self {
            site: site.clone(),
            vehicle: vehicle.clone(),
            speed_mps: 0.0,
            distance_m: 0.0,
            last_s: None,
            measured_from: None,
        }
    }

    /// Starts a filter without odometry at the pose when the fault was detected.
    ///
    /// # Errors
    /// [`SettingsError`] when the site's road cannot be built.
    pub fn begin(&mut self, pose: Pose) -> Result<Box<dyn Localizer>, SettingsError> {
        (self.speed_mps, self.distance_m) = (0.0, 0.0);
        (self.last_s, self.measured_from) = (None, None);
        let mut config = EkfConfig::new(&self.site, &self.vehicle);
        config.noise.odometer_m_per_sqrt_m = NOISE_M_PER_SQRT_M;
        config.noise.odometer_m_per_sqrt_s = NOISE_M_PER_SQRT_M;
        config.yaw_noise_rad_per_sqrt_s = NOISE_RAD_PER_SQRT_S;
        let follows_road = self.vehicle.follows_road();
        let road = self.site.build_road()?.filter(|_| follows_road);
        let heads = RadioHead::received_by(&self.site, &self.vehicle);
        let start = InitialPose {
            pose,
            position_std_m: UNDETECTED_S * self.vehicle.top_speed_mps(),
            heading_std_rad: HEADING_STD_RAD,
        };
        Ok(Box::new(Ekf::new(
            config,
            road.map(Arc::new),
            &heads,
            &start,
        )))
    }

    /// Returns the motion that predicts the filter, at the time of an odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometrySample {
        let duration_s =
            sample.time_s - self.last_s.replace(sample.time_s).unwrap_or(sample.time_s);
        let speed_mps = self.speed_mps.abs().max(MIN_MPS).copysign(self.speed_mps);
        self.distance_m += speed_mps * duration_s;
        OdometrySample {
            distance_m: self.distance_m,
            speed_mps,
            ..*sample
        }
    }

    /// Updates the measured speed with the filter's pose after a burst.
    pub fn received(&mut self, estimate: &PoseEstimate) {
        let (time_s, pose) = (estimate.time_s, estimate.pose);
        let (from_s, from) = *self.measured_from.get_or_insert((time_s, pose));
        if time_s - from_s < SPEED_S {
            return;
        }
        let middle_rad = from.heading_rad + 0.5 * (pose.heading_rad - from.heading_rad);
        let (sin, cos) = middle_rad.sin_cos();
        let along_m = cos * (pose.x_m - from.x_m) + sin * (pose.y_m - from.y_m);
        let top_mps = self.vehicle.top_speed_mps();
        let measured_mps = (along_m / (time_s - from_s)).clamp(-top_mps, top_mps);
        self.speed_mps = 0.5 * (self.speed_mps + measured_mps);
        self.measured_from = Some((time_s, pose));
    }

    /// Returns the protection level of a pose without odometry, in metres.
    pub fn level_m(estimate: &PoseEstimate) -> f64 {
        let [largest, _] = estimate.principal_variances();
        LEVEL_SIGMAS * largest.sqrt()
    }

    /// Creates the vehicle's localizer after the fault, at the position of the filter without
    /// odometry.
    ///
    /// # Errors
    /// [`SettingsError`] when the site's road cannot be built.
    pub fn end(&self, estimate: &PoseEstimate) -> Result<Box<dyn Localizer>, SettingsError> {
        let mut vehicle = self.vehicle.clone();
        let [largest, _] = estimate.principal_variances();
        let heading = estimate
            .covariance
            .map_or(0.0, |[.., [.., heading]]| heading);
        vehicle.start.known = true;
        vehicle.start.position_std_m = (MARGIN * largest.sqrt()).max(MIN_STD_M);
        vehicle.start.heading_std_rad = (MARGIN * heading.sqrt()).max(MIN_STD_RAD);
        localize::built_in(&self.site, &vehicle, estimate.pose)
    }
}
