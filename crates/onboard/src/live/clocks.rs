//! The clocks of odometry and of angles or samples, and their agreement.

use super::error::LiveError;
use super::time_base::{ClockStep, TimeBase};
use super::time_check::{MAX_ANGLE_LEAD_S, TimeCheck, TimeDefect};
use crate::localize::HISTORY_S;
use crate::observation::{BURST_S, OdometrySample};
use crate::time_unit::StreamTimes;

/// Maximum time by which an angle may be ahead of the odometry if arrival times are unknown, in
/// seconds. It exceeds the usual gaps of the odometry.
const MAX_LEAD_WITHOUT_ARRIVALS_S: f64 = 10.0;

/// Number of consecutive bursts with times that contradict those of the odometry, after which the
/// clocks are considered different.
const DISAGREEING_BURSTS: u32 = 3;

/// Duration after the last contradicting burst, in seconds, after which the contradiction is
/// forgotten.
const EXPIRY_S: f64 = 5.0;

/// Maximum age of an angle relative to the previous burst for a comparison of the clocks, in
/// seconds. The localizer rejects older angles.
const MAX_ANGLE_DELAY_S: f64 = 1.0;

/// Clocks of all sources.
#[derive(Debug, Clone, Default)]
pub struct Clocks {
    /// Arrival time of the next inputs by a monotonic clock, in seconds.
    pub arrival_s: Option<f64>,
    /// Clock of the odometry.
    pub odometry: TimeBase,
    /// Clock of samples and angles.
    pub angles: TimeBase,
    last_odometry: Option<OdometrySample>,
    /// Unit of the odometry's times, detected without arrival times.
    times: StreamTimes,
    disagreement: Option<Disagreement>,
    step: Option<ClockStep>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Disagreement {
    bursts: u32,
    /// Time of the angles minus that of the odometry, in seconds.
    offset_s: f64,
    /// Time of the newest odometry when the last contradicting burst arrived, in seconds.
    odometry_s: f64,
}

impl Clocks {
    /// Validates the time of odometry. Returns the sample with the time of the pipeline, and the
    /// clock step that it completes.
    ///
    /// # Errors
    /// Cause of a rejection.
    pub fn odometry(
        &mut self,
        sample: &OdometrySample,
    ) -> Result<(OdometrySample, Option<ClockStep>), TimeDefect> {
        let is_copy = self
            .last_odometry
            .is_some_and(|last| is_copy(&last, sample));
        let step = self.odometry.next(sample.time_s, self.arrival_s, is_copy)?;
        if self.arrival_s.is_none()
            && let Some(unit) = self.times.add(sample)
        {
            let ratio = unit.per_second();
            return Err(TimeDefect::WrongUnit { unit, ratio });
        }
        self.last_odometry = Some(*sample);
        if let (Some(_), None) = (step, self.arrival_s) {
            // Without arrival times, all sources are assumed to share one clock.
            self.angles = TimeBase::with_offset(self.odometry.offset_s);
        }
        let time_s = self.odometry.inside(sample.time_s);
        Ok((OdometrySample { time_s, ..*sample }, step))
    }

    /// Validates the time of a burst by the clock of angles or samples, and returns the time of the
    /// pipeline.
    ///
    /// # Errors
    /// Cause of a rejection.
    fn burst(&mut self, time_s: f64) -> Result<f64, TimeDefect> {
        let last_s = self.angles.last_s();
        let is_late = |last_s: f64| (0.0..=MAX_ANGLE_DELAY_S).contains(&(last_s - time_s));
        let is_of_burst = |last_s: f64| (time_s - last_s).abs() < BURST_S;
        if self.arrival_s.is_none() || last_s.is_some_and(is_of_burst) {
            TimeCheck::range(time_s)?;
        } else if last_s.is_some_and(is_late) {
            self.step = self.angles.late(time_s, self.arrival_s)?.or(self.step);
        } else if let Some(step) = self.angles.next(time_s, self.arrival_s, false)? {
            self.step = Some(step);
        }
        Ok(self.angles.inside(time_s))
    }

    /// Validates the time of a burst and its agreement with the newest odometry, and returns the
    /// time of the pipeline.
    ///
    /// # Errors
    /// [`LiveError::Time`] or [`LiveError::AngleAhead`].
    pub fn accept_burst(
        &mut self,
        what: &'static str,
        time_s: f64,
        newest: Option<&OdometrySample>,
    ) -> Result<f64, LiveError> {
        let inside_s = (self.burst(time_s)).map_err(|defect| LiveError::Time { what, defect })?;
        match self.compare(inside_s, newest) {
            None => Ok(inside_s),
            Some(by_s) => Err(LiveError::AngleAhead { by_s }),
        }
    }

    /// Returns the step of the angles' or samples' clock since the previous call.
    pub const fn take_angle_step(&mut self) -> Option<ClockStep> {
        self.step.take()
    }

    /// Compares the time of a burst with that of the newest odometry, both in the time of the
    /// pipeline. Returns the lead of the burst in seconds if it exceeds the maximum.
    fn compare(&mut self, time_s: f64, newest: Option<&OdometrySample>) -> Option<f64> {
        let odometry_s = newest?.time_s;
        let waited_s = self.odometry.waited_s(self.arrival_s);
        let lead_s = waited_s.map_or(MAX_LEAD_WITHOUT_ARRIVALS_S, |it| it + MAX_ANGLE_LEAD_S);
        let offset_s = time_s - odometry_s;
        if (-HISTORY_S..=lead_s).contains(&offset_s) {
            self.disagreement = None;
            return None;
        }
        let is_same = |it: &Disagreement| {
            it.odometry_s == odometry_s && (it.offset_s - offset_s).abs() < BURST_S
        };
        let bursts = self
            .disagreement
            .map_or(1, |it| it.bursts.saturating_add(u32::from(!is_same(&it))));
        self.disagreement = Some(Disagreement {
            bursts,
            offset_s,
            odometry_s,
        });
        (offset_s > lead_s && waited_s.is_some()).then_some(offset_s)
    }

    /// Whether the last burst had a time that agrees with that of the odometry.
    pub const fn agree(&self) -> bool {
        self.disagreement.is_none()
    }

    /// Returns the time of angles minus that of odometry in seconds, if the last bursts show
    /// different clocks.
    pub fn disagreement_s(&self, newest: &OdometrySample) -> Option<f64> {
        let found = self.disagreement?;
        let is_recent = newest.time_s - found.odometry_s <= EXPIRY_S;
        (found.bursts >= DISAGREEING_BURSTS && is_recent).then_some(found.offset_s)
    }

    /// Whether the last odometry contained a distance.
    pub fn has_distance(&self) -> bool {
        (self.last_odometry).is_some_and(|it| !it.distance_m.is_nan())
    }

    /// Removes all times except the arrival time.
    pub fn reset(&mut self) {
        *self = Self {
            arrival_s: self.arrival_s,
            ..Self::default()
        };
    }
}

/// Whether two messages have equal values; unknown distances are equal.
fn is_copy(a: &OdometrySample, b: &OdometrySample) -> bool {
    let bits = |it: &OdometrySample| [it.time_s, it.distance_m, it.speed_mps].map(f64::to_bits);
    bits(a) == bits(b) && a.yaw_rate_radps == b.yaw_rate_radps
}
