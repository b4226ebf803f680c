//! The door for localizers.

use std::any::Any;

use super::ekf::Ekf;
use super::output::PoseEstimate;
use super::output::{OdometryVerdict, UpdateVerdict};
use crate::BoxError;
use crate::observation::AngleMeasurement;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// How a localizer that was lost came back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recovered {
    /// When, in seconds.
    pub time_s: f64,
    /// By how far its place changed, in metres ...
    pub moved_m: f64,
    /// ... and its heading, counter-clockwise in radians.
    pub turned_rad: f64,
}

/// What turns odometry and angles into a pose.
///
/// Odometry comes in order of time, with finite values. Angles are no older than the newest
/// odometry: a [`History`](super::History) in front goes back in time for those that come late, if
/// the localizer can be copied.
pub trait Localizer: Any + Send {
    /// Moves on by an odometry sample; the first one is where distances are counted from.
    ///
    /// # Errors
    /// Whatever a user's localizer fails with; it ends the drive.
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, BoxError>;

    /// Takes in an angle to a radio head.
    ///
    /// # Errors
    /// Whatever a user's localizer fails with; it ends the drive.
    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateVerdict, BoxError>;

    /// Where it believes the vehicle to be at `time_s`, not before the newest odometry.
    ///
    /// # Errors
    /// Whatever a user's localizer fails with; it ends the drive.
    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError>;

    /// Copies itself into `slot`, reusing what is there; `false` if it cannot be copied. The usual
    /// body is [`copy_into`].
    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool;

    /// Number of places the vehicle may be at, as long as its first pose is searched for.
    fn hypotheses(&self) -> Option<usize> {
        None
    }

    /// Whether the angles come from elsewhere than expected, so that the pose is not to be relied on
    /// and every further angle helps.
    fn is_lost(&self) -> bool {
        false
    }

    /// How it came back when it was lost last.
    fn recovered(&self) -> Option<Recovered> {
        None
    }

    /// The filter in it, if it is one and knows where it is.
    fn ekf(&self) -> Option<&Ekf> {
        None
    }

    /// The filter by whose uncertainty to listen: that of the fault that nothing speaks against yet, if
    /// there is one.
    fn worst_case(&self) -> Option<&Ekf> {
        self.ekf()
    }

    /// Keeps from now on what smoothing takes, if it can be smoothed.
    fn keep_journal(&mut self) {}
}

/// Copies a localizer into a slot, without allocation where one of its kind is there already and
/// [`Clone::clone_from`] needs none.
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

/// The filter by itself: it neither searches nor monitors its sources.
impl Localizer for Ekf {
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

    fn ekf(&self) -> Option<&Ekf> {
        Some(self)
    }
}
