//! Interface of localizers.

use std::any::Any;

use super::ekf::Ekf;
use super::output::PoseEstimate;
use super::output::{OdometryResult, UpdateReason, UpdateResult};
use crate::BoxError;
use crate::observation::AngleMeasurement;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;

/// Recovery of a lost localizer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recovered {
    /// Time of the recovery, in seconds.
    pub time_s: f64,
    /// Change of the position by the recovery, in metres.
    pub moved_m: f64,
    /// Change of the heading by the recovery, counter-clockwise in radians.
    pub turned_rad: f64,
}

/// Estimator of a pose from odometry and angles.
///
/// Odometry arrives in order of time, with finite values. Angles are not older than the newest
/// odometry: a [`OutOfSequenceBuffer`](super::OutOfSequenceBuffer) in front of the localizer replays late angles, if the
/// localizer can be copied.
pub trait Localizer: Any + Send {
    /// Predicts with an odometry sample; the first sample defines the origin of the distance.
    ///
    /// # Errors
    /// Errors of the localizer; an error ends the drive.
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryResult, BoxError>;

    /// Updates with an angle to a radio head.
    ///
    /// # Errors
    /// Errors of the localizer; an error ends the drive.
    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateResult, BoxError>;

    /// Updates with a range to a radio head, if ranges are supported.
    ///
    /// # Errors
    /// Errors of the localizer; an error ends the drive.
    fn update_range(
        &mut self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        let _ = (head, measured);
        Ok(UpdateResult::unused(UpdateReason::Unusable))
    }

    /// Returns the estimated pose at `time_s`, which is not before the newest odometry.
    ///
    /// # Errors
    /// Errors of the localizer; an error ends the drive.
    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError>;

    /// Copies the localizer to `slot`, reusing its memory; returns `false` if it cannot be copied.
    /// The usual implementation is [`copy_into`].
    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool;

    /// Returns the number of hypotheses during the search for the initial pose.
    fn hypotheses(&self) -> Option<usize> {
        None
    }

    /// Whether most angles contradict the prediction, so that the pose must not be used and every
    /// further angle helps.
    fn is_lost(&self) -> bool {
        false
    }

    /// Returns the last recovery of a lost localizer.
    fn recovered(&self) -> Option<Recovered> {
        None
    }

    /// Returns the filter, if the localizer has one and its position is known.
    fn ekf(&self) -> Option<&Ekf> {
        None
    }

    /// Returns the filter that determines the wake-ups: that of the fault hypothesis that
    /// contributes most to the protection level, if there is one.
    fn worst_case(&self) -> Option<&Ekf> {
        self.ekf()
    }

    /// Keeps a journal for smoothing from now on, if smoothing is supported.
    fn keep_journal(&mut self) {}
}

/// Copies a localizer to a slot, without allocation if the slot contains one of the same type whose
/// [`Clone::clone_from`] does not allocate.
pub fn copy_into<L: Localizer + Clone>(
    localizer: &L,
    slot: &mut Option<Box<dyn Localizer>>,
) -> bool {
    let there = slot.as_deref_mut().map(|slot| slot as &mut dyn Any);
    match there.and_then(<dyn Any>::downcast_mut::<L>) {
        Some(there) => there.clone_from(localizer),
        None => *slot = Some(Box::new(localizer.clone())),
    }
    true
}

/// Filter without search and monitoring.
impl Localizer for Ekf {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryResult, BoxError> {
        Ok(Self::odometry(self, sample))
    }

    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        Ok(Self::update(self, head, measured))
    }

    fn update_range(
        &mut self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        Ok(Self::update_range(self, head, measured))
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        Ok(Self::pose(self, time_s))
    }

    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        copy_into(self, slot)
    }

    fn ekf(&self) -> Option<&Ekf> {
        Some(self)
    }
}
