//! User commands: new pose, new start, excluded radio heads.

use super::{Live, finite, plausible};
use crate::geometry::Pose;
use crate::live::LiveError;
use crate::live::start::starting_at;
use crate::localize::{self, HISTORY_S, PoseEstimate};
use crate::monitor::Confirmation;
use crate::settings::Vehicle;

impl Live {
    /// Sets the pose at `time_s`, with a covariance of (x, y, heading), or with the start
    /// uncertainty of the vehicle's settings. Calibration learned while driving is discarded.
    ///
    /// # Errors
    /// [`LiveError`] for invalid values, for a time more than half a second from the newest
    /// odometry, and for a custom localizer.
    pub fn set_pose(
        &mut self,
        time_s: f64,
        pose: Pose,
        covariance: Option<[[f64; 3]; 3]>,
    ) -> Result<(), LiveError> {
        plausible("set-pose", time_s)?;
        let time_s = self.clocks.odometry.inside(time_s);
        for value in [pose.x_m, pose.y_m, pose.heading_rad] {
            finite("a pose", value)?;
        }
        if self.has_own_localizer {
            return Err(LiveError::OwnLocalizer);
        }
        let mut vehicle = self.vehicle.clone();
        vehicle.start.known = true;
        if let Some(covariance) = covariance {
            let (position_std_m, heading_std_rad) = deviations(&covariance)?;
            vehicle.start.position_std_m = position_std_m;
            vehicle.start.heading_std_rad = heading_std_rad;
        }
        let mut now = pose;
        if let Some(newest) = self.onboard.newest_odometry() {
            let elapsed_s = newest.time_s - time_s;
            if elapsed_s.abs() > HISTORY_S {
                return Err(LiveError::Value {
                    what: "the time of a pose minus that of the newest odometry",
                    value: -elapsed_s,
                    allowed: "it must be within 0.5 s",
                });
            }
            let turn_rad = newest.yaw_rate_radps.unwrap_or(0.0) * elapsed_s;
            now = pose.along_chord(newest.speed_mps * elapsed_s, turn_rad);
        }
        self.begin_at(&vehicle, now)
    }

    /// Discards pose, odometry and learned calibration, and searches for the pose as at the start
    /// of a drive. Subsequent times may be earlier than before.
    ///
    /// # Errors
    /// [`LiveError::Settings`] if a search is impossible for the vehicle (use
    /// [`set_pose`](Self::set_pose)), [`LiveError::OwnLocalizer`].
    pub fn reset(&mut self) -> Result<(), LiveError> {
        if self.has_own_localizer {
            return Err(LiveError::OwnLocalizer);
        }
        let mut unknown = self.vehicle.clone();
        unknown.start.pose = None;
        let (unknown, anywhere) = starting_at(&self.site, &unknown, None)?;
        self.onboard.forget_odometry();
        self.clocks.reset();
        self.begin_at(&unknown, anywhere)?;
        (self.last_angle_s, self.last_burst) = (None, None);
        (self.has_samples, self.empty_stretches) = (false, 0);
        self.interval_s = None;
        (self.aoa_estimates, self.bursts_received) = (0, 0);
        Ok(())
    }

    /// Replaces the localizer by that of a vehicle at a start.
    pub(in crate::live) fn begin_at(
        &mut self,
        vehicle: &Vehicle,
        start: Pose,
    ) -> Result<(), LiveError> {
        let localizer = localize::built_in(&self.site, vehicle, start)?;
        self.confirmation = Confirmation::new(!vehicle.start.known, self.heads.len());
        self.angles.clear();
        self.onboard
            .replace_localizer(localizer)
            .map_err(LiveError::Custom)
    }

    /// Excludes a cell from now on.
    ///
    /// # Errors
    /// [`LiveError::UnknownCell`].
    pub fn exclude(&mut self, pci: u16) -> Result<(), LiveError> {
        self.set_excluded(pci, true)
    }

    /// Includes an excluded cell again.
    ///
    /// # Errors
    /// [`LiveError::UnknownCell`].
    pub fn readmit(&mut self, pci: u16) -> Result<(), LiveError> {
        self.set_excluded(pci, false)
    }

    fn set_excluded(&mut self, pci: u16, excluded: bool) -> Result<(), LiveError> {
        if !self.onboard.exclude(pci, excluded) {
            return Err(LiveError::UnknownCell { pci });
        }
        for status in self.heads.iter_mut().filter(|it| it.head.pci == pci) {
            status.is_excluded = excluded;
        }
        Ok(())
    }
}

/// Returns the standard deviations of the position, along its major axis (m), and of the heading
/// (rad).
fn deviations(covariance: &[[f64; 3]; 3]) -> Result<(f64, f64), LiveError> {
    let variances = PoseEstimate {
        time_s: 0.0,
        pose: Pose::default(),
        covariance: Some(*covariance),
        integrity: None,
    }
    .principal_variances();
    let [.., [.., heading]] = *covariance;
    let [largest, least] = variances;
    for (what, value) in [
        ("the variance of a position in m²", largest),
        ("the variance of a position in m²", least),
        ("the variance of a heading in rad²", heading),
    ] {
        if !(0.0..=1e8).contains(&value) {
            let allowed = "it must be from 0 to 1e8";
            return Err(LiveError::Value {
                what,
                value,
                allowed,
            });
        }
    }
    Ok((largest.sqrt(), heading.sqrt().min(std::f64::consts::PI)))
}
