//! What the pose comes from: one filter, or a bank of them with integrity monitoring.

use crate::localize::ekf::Ekf;
use crate::localize::integrity::IntegrityMonitor;
use crate::localize::measurement::{AngleMeasurement, OdometryVerdict, UpdateVerdict};
use crate::localize::modes::may_mislead;
use crate::localize::pose_estimate::PoseEstimate;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::settings::IntegritySettings;

/// One filter, or a monitored bank of them.
#[derive(Debug)]
pub(super) enum Solution {
    /// Its sources are taken at their word.
    Bare(Box<Ekf>),
    /// They are not.
    Monitored(Box<IntegrityMonitor>),
}

impl Clone for Solution {
    fn clone(&self) -> Self {
        match self {
            Self::Bare(ekf) => Self::Bare(ekf.clone()),
            Self::Monitored(monitor) => Self::Monitored(monitor.clone()),
        }
    }

    fn clone_from(&mut self, source: &Self) {
        match (self, source) {
            (Self::Bare(mine), Self::Bare(theirs)) => (**mine).clone_from(theirs),
            (Self::Monitored(mine), Self::Monitored(theirs)) => (**mine).clone_from(theirs),
            (mine, theirs) => *mine = theirs.clone(),
        }
    }
}

impl Solution {
    /// Of a filter that was given its place, or found it at a time (s).
    pub fn new(
        ekf: Ekf,
        heads: &[RadioHead],
        integrity: Option<IntegritySettings>,
        found_s: Option<f64>,
    ) -> Self {
        match integrity {
            Some(config) => Self::Monitored(Box::new(IntegrityMonitor::new(
                &ekf, heads, config, found_s,
            ))),
            None => Self::Bare(Box::new(ekf)),
        }
    }

    /// The filter that uses every sound source.
    pub fn ekf(&self) -> &Ekf {
        match self {
            Self::Bare(ekf) => ekf,
            Self::Monitored(monitor) => monitor.ekf(),
        }
    }

    /// The filter by whose uncertainty to listen.
    pub fn worst_case(&self) -> &Ekf {
        match self {
            Self::Bare(ekf) => ekf,
            Self::Monitored(monitor) => monitor.worst_case(),
        }
    }

    /// When it began anew last by itself (s), if ever.
    pub const fn begun_s(&self) -> f64 {
        match self {
            Self::Bare(_) => f64::NEG_INFINITY,
            Self::Monitored(monitor) => monitor.begun_s(),
        }
    }

    /// Whether angles may be off as if the vehicle were lost.
    pub fn may_mislead(&self) -> bool {
        match self {
            Self::Bare(ekf) => may_mislead(ekf.config()),
            Self::Monitored(monitor) => monitor.may_mislead(),
        }
    }

    /// How much more the angles vary than stated, as far as anybody listens to that.
    pub const fn noise_ratio(&self) -> f64 {
        match self {
            Self::Bare(_) => 1.0,
            Self::Monitored(monitor) => monitor.noise_ratio(),
        }
    }

    /// Moves on by an odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryVerdict {
        match self {
            Self::Bare(ekf) => ekf.odometry(sample),
            Self::Monitored(monitor) => monitor.odometry(sample),
        }
    }

    /// Takes in an angle to a radio head.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateVerdict {
        match self {
            Self::Bare(ekf) => ekf.update(head, measured),
            Self::Monitored(monitor) => monitor.update(head, measured),
        }
    }

    /// The pose at `time_s`.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        match self {
            Self::Bare(ekf) => ekf.pose(time_s),
            Self::Monitored(monitor) => monitor.pose(time_s),
        }
    }

    /// Keeps a journal, where there is no bank, whose filters take each other's place.
    pub fn keep_journal(&mut self) {
        if let Self::Bare(ekf) = self {
            ekf.keep_journal();
        }
    }
}
