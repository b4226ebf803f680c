//! Localization without odometry during an odometry fault.
//!
//! The localizer follows the angles. It is driven by its own speed, with a noise that covers any motion of the vehicle.
//! Its pose is not valid for use, but it is near the vehicle when the odometry is right again.
//!
//! Constants of the array, the clock and the site plan, sizes of biases, and the evidence of fault hypotheses other than
//! those of the odometry do not depend on the odometry. They are retained from a copy of the localizer that was made some
//! seconds before the fault was detected. Without them, the state in the yard was `ok` only 30 to 65 s after a fault.

use std::any::Any;

use crate::geometry::Pose;
use crate::localize::acquire::Relocalizer;
use crate::localize::ekf::{EkfConfig, FreeMotion};
use crate::localize::{self, InitialPose, Localizer, PoseEstimate};
use crate::observation::OdometrySample;
use crate::settings::{SettingsError, Site, Vehicle};

/// Duration in seconds for which the vehicle may have driven at top speed before the fault was
/// detected.
const UNDETECTED_S: f64 = 1.0;
/// Standard deviation of the heading when the fault is detected, in radians.
const HEADING_STD_RAD: f64 = 0.2;
/// Noise of the distance in m/√m and m/√s. Half of it does not shorten the recovery in the yard.
const DISTANCE_NOISE: f64 = 1.5;
/// Minimum speed in m/s that the filter is driven with: a noise of 0.8 m/√s at the least.
const MIN_MPS: f64 = 0.3;
/// Interval over which the speed is measured, in seconds.
const SPEED_S: f64 = 0.5;
/// Number of standard deviations in the protection level during a fault.
const LEVEL_SIGMAS: f64 = 5.0;
/// Time between two copies of the localizer in seconds. The older one is at least of this age; a fault is detected
/// earlier.
const RETAINED_S: f64 = 2.5;

/// Starts localizers without odometry, and those after the fault.
#[derive(Debug)]
pub struct Fallback {
    site: Site,
    vehicle: Vehicle,
    /// Older copy of the localizer, one interval [`RETAINED_S`] before the newer one.
    older: Option<Box<Relocalizer>>,
    /// Newer copy of the localizer.
    newer: Option<Box<Relocalizer>>,
    /// Time of the newer copy in seconds.
    newer_s: f64,
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
            older: None,
            newer: None,
            newer_s: f64::NEG_INFINITY,
            speed_mps: 0.0,
            distance_m: 0.0,
            last_s: None,
            measured_from: None,
        }
    }

    /// Keeps a copy of the localizer at a time (s), if it is due.
    pub fn retain(&mut self, time_s: f64, localizer: &dyn Localizer) {
        if time_s - self.newer_s < RETAINED_S {
            return;
        }
        let Some(localizer) = (localizer as &dyn Any).downcast_ref::<Relocalizer>() else {
            return;
        };
        self.newer_s = time_s;
        std::mem::swap(&mut self.older, &mut self.newer);
        if let (Some(_), Some(newer)) = (&self.older, &mut self.newer) {
            (**newer).clone_from(localizer);
        } else {
            // Both are created at once, so that nothing is allocated later.
            self.older = Some(Box::new(localizer.clone()));
            self.newer = Some(Box::new(localizer.clone()));
        }
    }

    /// Forgets the copies, because the localizer starts again.
    pub fn forget(&mut self) {
        (self.older, self.newer, self.newer_s) = (None, None, f64::NEG_INFINITY);
    }

    /// Starts a localizer without odometry at the pose when the fault was detected; `along_m` is the distance along the
    /// road.
    ///
    /// # Errors
    /// [`SettingsError`] when the site's road cannot be built.
    pub fn begin(
        &mut self,
        pose: Pose,
        along_m: Option<f64>,
    ) -> Result<Box<dyn Localizer>, SettingsError> {
        (self.speed_mps, self.distance_m) = (0.0, 0.0);
        (self.last_s, self.measured_from) = (None, None);
        (self.newer, self.newer_s) = (None, f64::NEG_INFINITY);
        let start = InitialPose {
            pose,
            position_std_m: UNDETECTED_S * self.vehicle.top_speed_mps(),
            heading_std_rad: HEADING_STD_RAD,
        };
        let motion = FreeMotion {
            start,
            along_m,
            distance_noise: DISTANCE_NOISE,
        };
        if self.older.is_none() {
            let mut vehicle = self.vehicle.clone();
            vehicle.start.known = true;
            let specified = localize::built_in(&self.site, &vehicle, pose)?;
            self.older = relocalizer(specified.as_ref());
        }
        let Some(before) = &self.older else {
            return localize::built_in(&self.site, &self.vehicle, pose);
        };
        let mut localizer = before.clone();
        localizer.begin_free_motion(&motion);
        Ok(localizer)
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

    /// Returns the localizer after the fault, at the state of the localizer without odometry; `None` if that is a custom
    /// one.
    pub fn end(&mut self, localizer: &dyn Localizer) -> Option<Box<dyn Localizer>> {
        let mut localizer = relocalizer(localizer)?;
        let specified = EkfConfig::new(&self.site, &self.vehicle);
        let before = self.older.take();
        let before = before
            .as_deref()
            .and_then(Localizer::ekf)
            .or(localizer.ekf())?
            .clone();
        localizer.end_free_motion(&specified, &before);
        Some(localizer)
    }
}

/// Returns a copy of a built-in localizer.
fn relocalizer(localizer: &dyn Localizer) -> Option<Box<Relocalizer>> {
    let localizer = (localizer as &dyn Any).downcast_ref::<Relocalizer>()?;
    Some(Box::new(localizer.clone()))
}
