//! What the pose comes from: one filter, or a bank of them with integrity monitoring.

use crate::localize::ekf::Ekf;
use crate::localize::integrity::IntegrityMonitor;
use crate::localize::measurement::{AngleMeasurement, OdometryVerdict, UpdateVerdict};
use crate::localize::modes::may_mislead;
use crate::localize::pose_estimate::PoseEstimate;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::settings::IntegritySettings;

/// A filter, guarded or not.
#[derive(Debug)]
pub(super) enum Solution {
    /// It trusts its sources.
    Bare(Box<Ekf>),
    /// It does not.
    Guarded(Box<IntegrityMonitor>),
}

impl Clone for Solution {
    fn clone(&self) -> Self {
        match self {
            Self::Bare(ekf) => Self::Bare(ekf.clone()),
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

impl Solution {
    /// A filter, guarded or not, that was given its place or found it at a time.
    pub fn new(
        ekf: Ekf,
        heads: &[RadioHead],
        integrity: Option<IntegritySettings>,
        found_s: Option<f64>,
    ) -> Self {
        match integrity {
            Some(config) => Self::Guarded(Box::new(IntegrityMonitor::new(
                &ekf, heads, config, found_s,
            ))),
            None => Self::Bare(Box::new(ekf)),
        }
    }

    /// The filter that uses every sound source.
    pub fn ekf(&self) -> &Ekf {
        match self {
            Self::Bare(ekf) => ekf,
            Self::Guarded(guard) => guard.ekf(),
        }
    }

    /// The filter by whose uncertainty to listen.
    pub fn worst_case(&self) -> &Ekf {
        match self {
            Self::Bare(ekf) => ekf,
            Self::Guarded(guard) => guard.worst_case(),
        }
    }

    /// When it began anew last by itself (s), if ever.
    pub const fn begun_s(&self) -> f64 {
        match self {
            Self::Bare(_) => f64::NEG_INFINITY,
            Self::Guarded(guard) => guard.begun_s(),
        }
    }

    /// Whether angles may be off as if the vehicle were lost.
    pub fn may_mislead(&self) -> bool {
        match self {
            Self::Bare(ekf) => may_mislead(ekf.config()),
            Self::Guarded(monitor) => monitor.may_mislead(),
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
            Self::Bare(ekf) => ekf.odometry(sample),
            Self::Guarded(guard) => guard.odometry(sample),
        }
    }

    /// Takes in an angle to a radio head.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateVerdict {
        match self {
            Self::Bare(ekf) => ekf.update(head, measured),
            Self::Guarded(guard) => guard.update(head, measured),
        }
    }

    /// The pose at `time_s`.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        match self {
            Self::Bare(ekf) => ekf.pose(time_s),
            Self::Guarded(guard) => guard.pose(time_s),
        }
    }

    /// Keeps a journal, where there is no guard, whose filters take each other's place.
    pub fn keep_journal(&mut self) {
        if let Self::Bare(ekf) = self {
            ekf.keep_journal();
        }
    }
}
