//! The tracker, guarded or not, as a localizer.

use super::integrity::{Guard, IntegrityConfig};
use super::localizer::{Localizer, copy_into};
use super::measurement::{AngleMeasurement, UpdateVerdict};
use super::pose_estimate::PoseEstimate;
use super::tracker::{OdometryVerdict, Tracker};
use crate::BoxError;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// A tracker, guarded or not.
pub fn tracking(
    tracker: Tracker,
    heads: &[RadioHead],
    integrity: Option<IntegrityConfig>,
) -> Box<dyn Localizer> {
    match integrity {
        Some(config) => Box::new(Guard::new(tracker, heads, config)),
        None => Box::new(tracker),
    }
}

impl Localizer for Tracker {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, BoxError> {
        Ok(Self::odometry(self, sample))
    }

    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateVerdict, BoxError> {
        Ok(Self::update(self, head, measured))
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        Ok(Self::pose(self, time_s))
    }

    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        copy_into(self, slot)
    }

    fn tracker(&self) -> Option<&Tracker> {
        Some(self)
    }

    fn keep_journal(&mut self) {
        Self::keep_journal(self);
    }
}

impl Localizer for Guard {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, BoxError> {
        Ok(Self::odometry(self, sample))
    }

    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateVerdict, BoxError> {
        Ok(Self::update(self, head, measured))
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        Ok(Self::pose(self, time_s))
    }

    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        copy_into(self, slot)
    }

    fn tracker(&self) -> Option<&Tracker> {
        Some(Self::tracker(self))
    }
}
