//! Status of the vehicle at a time, with its reason.

use super::{Live, finite};
use crate::geometry::{Pose, wrap_angle};
use crate::live::{LiveError, Reason, SampleStream, State, Status};
use crate::localize::{IntegrityState, PoseEstimate};

/// Maximum odometry age for a valid pose (s).
const SILENT_S: f64 = 0.5;

/// Time without an accepted angle above which this is the reported reason (s).
const NO_ANGLE_S: f64 = 5.0;

impl Live {
    /// Returns the status of the vehicle at `now_s`. The pose is extrapolated for at most half a
    /// second after the newest odometry.
    ///
    /// # Errors
    /// [`LiveError::Value`] for a time that is not finite, [`LiveError::Custom`].
    pub fn status(&self, now_s: f64) -> Result<Status, LiveError> {
        finite("the time of a status", now_s)?;
        let now_s = self.clocks.odometry.inside(now_s);
        let mut status = self.status_inside(now_s)?;
        let clock = &self.clocks.odometry;
        status.time_s = clock.outside(status.time_s);
        status.last_angle_s = status.last_angle_s.map(|it| clock.outside(it));
        Ok(status)
    }

    /// Returns the status at a time of the pipeline, with times of the pipeline.
    fn status_inside(&self, now_s: f64) -> Result<Status, LiveError> {
        let newest = self.onboard.newest_odometry();
        let age_s = newest.map(|it| now_s - it.time_s);
        let end_s = self.stream.as_ref().and_then(SampleStream::next_s);
        let mut status = Status {
            time_s: now_s,
            pose: None,
            covariance: None,
            speed_mps: newest.map_or(0.0, |it| it.speed_mps),
            yaw_rate_radps: newest.and_then(|it| it.yaw_rate_radps),
            state: State::Waiting,
            reason: Reason::NoOdometry,
            protection_level_m: None,
            selected_hypothesis: None,
            faulty: 0,
            last_angle_s: self.last_angle_s,
            odometry_age_s: age_s,
            samples_age_s: end_s.map(|end_s| now_s - self.clocks.angles.inside(end_s)),
            tracked: self.stream.as_ref().map_or(0, SampleStream::tracked),
            tones: std::array::from_fn(|index| self.stream.as_ref()?.tone(index)),
            faults: *self.onboard.faults(),
        };
        let (Some(newest), Some(age_s)) = (newest, age_s) else {
            return Ok(status);
        };
        status.time_s = newest.time_s + age_s.clamp(0.0, SILENT_S);
        if (0.0..=SILENT_S).contains(&age_s) {
            status.time_s = now_s;
        }
        let estimate = self
            .onboard
            .pose(status.time_s)
            .map_err(LiveError::Custom)?;
        // The heading of the filter is continuous over several turns.
        status.pose = Some(Pose {
            heading_rad: wrap_angle(estimate.pose.heading_rad),
            ..estimate.pose
        });
        status.covariance = estimate.covariance;
        let integrity = estimate.integrity;
        status.protection_level_m = integrity.map(|it| it.protection_level_m);
        status.selected_hypothesis = integrity.map(|it| it.hypothesis);
        status.faulty = integrity.map_or(0, |it| it.faulty);
        (status.state, status.reason) = if age_s > SILENT_S {
            (State::Unavailable, Reason::OdometrySilent { age_s })
        } else if let Some(offset_s) = self.clocks.disagreement_s(newest) {
            (State::Unavailable, Reason::ClocksDisagree { offset_s })
        } else {
            self.state_and_reason(&estimate, now_s)
        };
        Ok(status)
    }

    /// Returns state and reason of a pose with valid odometry.
    fn state_and_reason(&self, estimate: &PoseEstimate, now_s: f64) -> (State, Reason) {
        if let Some(places) = self.onboard.searching() {
            let reason = match self.last_angle_s {
                None => Reason::NoAngle,
                Some(_) => Reason::SeveralPlaces { places },
            };
            return (State::Searching, reason);
        }
        let faults = self.onboard.faults();
        if let Some(fault) = faults.of_odometry().or_else(|| faults.of_angles()) {
            return (State::Unavailable, Reason::SensorFault(fault));
        }
        if self.onboard.is_lost() {
            return (State::Lost, Reason::AnglesElsewhere);
        }
        let Some(integrity) = estimate.integrity else {
            return (State::Unmonitored, Reason::NotMonitored);
        };
        let faulty = integrity.faulty;
        match integrity.state {
            IntegrityState::Ok | IntegrityState::Degraded if !self.confirmation.is_confirmed() => {
                (State::Unavailable, Reason::Unconfirmed)
            }
            IntegrityState::Ok if faulty > 0 => (State::Ok, Reason::FaultyHeads { heads: faulty }),
            IntegrityState::Ok => (State::Ok, Reason::Nominal),
            IntegrityState::Unavailable => (State::Unavailable, Reason::SourcesDisagree),
            IntegrityState::Degraded => {
                let level_m = integrity.protection_level_m;
                let monitor = self.vehicle.integrity_monitor().unwrap_or_default();
                let limit_m = monitor.alert_limit_m;
                let silent_s = self.last_angle_s.map(|last_s| now_s - last_s);
                let reason = match silent_s {
                    _ if level_m <= limit_m && faulty > 0 => Reason::FaultyHeads { heads: faulty },
                    _ if level_m <= limit_m => Reason::FaultSuspected,
                    None => Reason::NoAngle,
                    Some(age_s) if age_s > NO_ANGLE_S => Reason::AnglesSilent { age_s },
                    Some(_) => Reason::LevelAboveLimit { level_m, limit_m },
                };
                (State::Degraded, reason)
            }
        }
    }
}
