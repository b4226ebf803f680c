//! A tracker, guarded or not.

use super::integrity::{Guard, IntegrityConfig};
use super::localizer::{Localizer, copy_into};
use super::measurement::{AngleMeasurement, UpdateVerdict};
use super::pose_estimate::PoseEstimate;
use super::tracker::{OdometryVerdict, Tracker};
use crate::BoxError;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// A tracker, guarded or not.
#[derive(Debug)]
pub enum Tracked {
    /// It trusts its sources.
    Bare(Box<Tracker>),
    /// It does not.
    Guarded(Box<Guard>),
}

impl Clone for Tracked {
    fn clone(&self) -> Self {
        match self {
            Self::Bare(tracker) => Self::Bare(tracker.clone()),
            Self::Guarded(guard) => Self::Guarded(guard.clone()),
        }
    }

    fn clone_from(&mut self, source: &Self) {
        match (self, source) {
            (Self::Bare(mine), Self::Bare(theirs)) => (**mine).clone_from(theirs),
            (Self::Guarded(mine), Self::Guarded(theirs)) => (**mine).clone_from(theirs),
            (mine, theirs) => *mine = theirs.clone(),
        }
    }
}

impl Tracked {
    /// A tracker, guarded or not, that was given its place or found it at a time.
    pub fn new(
        tracker: Tracker,
        heads: &[RadioHead],
        integrity: Option<IntegrityConfig>,
        found_s: Option<f64>,
    ) -> Self {
        match integrity {
            Some(config) => Self::Guarded(Box::new(Guard::new(&tracker, heads, config, found_s))),
            None => Self::Bare(Box::new(tracker)),
        }
    }

    /// The tracker that uses every sound source.
    pub fn tracker(&self) -> &Tracker {
        match self {
            Self::Bare(tracker) => tracker,
            Self::Guarded(guard) => guard.tracker(),
        }
    }

    /// The tracker by whose uncertainty to listen.
    pub fn doubtful(&self) -> &Tracker {
        match self {
            Self::Bare(tracker) => tracker,
            Self::Guarded(guard) => guard.doubtful(),
        }
    }

    /// When it began anew last by itself (s), if ever.
    pub const fn begun_s(&self) -> f64 {
        match self {
            Self::Bare(_) => f64::NEG_INFINITY,
            Self::Guarded(guard) => guard.begun_s(),
        }
    }

    /// How much more the angles vary than stated, as far as anybody listens to that.
    pub const fn noise_ratio(&self) -> f64 {
        match self {
            Self::Bare(_) => 1.0,
            Self::Guarded(guard) => guard.noise_ratio(),
        }
    }

    /// Moves on by an odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryVerdict {
        match self {
            Self::Bare(tracker) => tracker.odometry(sample),
            Self::Guarded(guard) => guard.odometry(sample),
        }
    }

    /// Takes in an angle to a radio head.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateVerdict {
        match self {
            Self::Bare(tracker) => tracker.update(head, measured),
            Self::Guarded(guard) => guard.update(head, measured),
        }
    }

    /// The pose at `time_s`.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        match self {
            Self::Bare(tracker) => tracker.pose(time_s),
            Self::Guarded(guard) => guard.pose(time_s),
        }
    }

    /// Keeps a journal, where there is no guard, whose trackers take each other's place.
    pub fn keep_journal(&mut self) {
        if let Self::Bare(tracker) = self {
            tracker.keep_journal();
        }
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
