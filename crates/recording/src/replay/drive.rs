//! Replay of a drive.

use onboard::burst::{Burst, HasSsb, first_burst};
use onboard::geometry::Pose;
use onboard::localize::OdometryResult;
use onboard::localize::Recovered;
use onboard::localize::ekf::{EstimatedConstants, RangeState};
use onboard::monitor::ActiveFaults;
use onboard::observation::OdometrySample;
use onboard::settings::{Platform, Site, Vehicle};
use onboard::{AngleResult, Custom, Pipeline};

use super::clock::MIN_ANGLE_TIME_OFFSET_S;
use super::error::ReplayError;
use super::located::{Diagnosis, LocatedDrive, LocatedPose, LocatedRange, Remark, gathered};
use crate::library::load;
use crate::odometry::{OdometryLog, number};
use crate::range_log::LoggedRange;

/// Minimum deviation of the odometer's scale that is reported.
const MIN_SCALE: f64 = 0.03;
/// Minimum deviation of the array's mounting that is reported (rad).
const MIN_MOUNTING_RAD: f64 = 0.05;

/// Checks that the odometry has two usable samples.
///
/// # Errors
/// [`ReplayError::NoOdometry`].
pub(super) fn check_odometry(odometry: &OdometryLog) -> Result<(), ReplayError> {
    if odometry.samples.len() >= 2 {
        return Ok(());
    }
    let mut unused = odometry.remarks.iter().filter(|it| !it.issue.used());
    let why = unused.next().map(ToString::to_string);
    Err(ReplayError::NoOdometry { why })
}

/// Drive that is being located.
pub struct Replay<'a> {
    onboard: Pipeline,
    odometry: std::iter::Peekable<std::slice::Iter<'a, OdometrySample>>,
    ranges: &'a [LoggedRange],
    drive: LocatedDrive,
    /// Whether the localizer was lost at the previous pose.
    was_lost: bool,
    /// Last recovery of the localizer.
    recovered: Option<Recovered>,
    /// Active faults of the sensors that were reported.
    faults: ActiveFaults,
    /// Whether the previous odometry was beyond the end of the road.
    beyond_map: bool,
    /// Start positions of the reported gaps of the road (m).
    gaps_m: Vec<f64>,
    /// Correction of the angles' times (s).
    set_back_s: f64,
}

impl<'a> Replay<'a> {
    /// Creates the replay of a drive of a vehicle at a site, from `start`.
    ///
    /// # Errors
    /// [`ReplayError::Settings`], [`ReplayError::NoOdometry`].
    pub fn new(
        site: &Site,
        vehicle: &Vehicle,
        start: Pose,
        custom: Custom,
        odometry: &'a OdometryLog,
    ) -> Result<Self, ReplayError> {
        check_odometry(odometry)?;
        let platform: Platform = load(&vehicle.platform.name)?;
        let onboard = Pipeline::new(site, vehicle, &platform, start, custom)?;
        Ok(Self {
            onboard,
            was_lost: false,
            recovered: None,
            faults: ActiveFaults::default(),
            beyond_map: false,
            gaps_m: Vec::new(),
            set_back_s: 0.0,
            odometry: odometry.samples.iter().peekable(),
            ranges: &[],
            drive: LocatedDrive {
                remarks: odometry
                    .remarks
                    .iter()
                    .map(|remark| Remark {
                        time_s: remark.time_s,
                        text: remark.to_string(),
                    })
                    .collect(),
                ..LocatedDrive::default()
            },
        })
    }

    /// Sets the time offset (s) that was already subtracted from the angles' times.
    pub const fn set_back(&mut self, angle_time_offset_s: f64) {
        self.set_back_s = angle_time_offset_s;
    }

    /// Adds ranges in order of time, which are processed between the odometry samples.
    pub const fn with_ranges(&mut self, ranges: &'a [LoggedRange]) {
        self.ranges = ranges;
    }

    /// Processes the ranges before `time_s`.
    fn ranges_before(&mut self, time_s: f64) -> Result<(), ReplayError> {
        while let Some((&range, later)) = self.ranges.split_first() {
            if range.measured.time_s >= time_s {
                return Ok(());
            }
            self.ranges = later;
            let verdict = (self.onboard).range(range.pci, range.ssb_index, &range.measured);
            let verdict = verdict.map_err(ReplayError::Custom)?;
            self.drive.ranges.push(LocatedRange { range, verdict });
            self.remark_on_loss("ranges", range.measured.time_s);
        }
        Ok(())
    }

    /// Processes SSBs or angles in the given order, with the odometry up to each burst first.
    ///
    /// # Errors
    /// [`ReplayError::Custom`].
    pub fn process<T: HasSsb>(&mut self, mut ssbs: &[T]) -> Result<(), ReplayError> {
        while !ssbs.is_empty() {
            let (burst, later) = ssbs.split_at(first_burst(ssbs));
            let time_s = burst.first().map_or(f64::NAN, |first| first.ssb().time_s);
            self.odometry_until(time_s)?;
            let mut source = Burst(burst);
            let result = self.onboard.process_burst(time_s, &mut source);
            let result = result.map_err(ReplayError::Custom)?;
            self.drive
                .aoa_estimates
                .extend_from_slice(result.aoa_estimates);
            let ranges = self.onboard.ranges().iter().map(|it| LocatedRange {
                range: LoggedRange {
                    pci: it.head.pci,
                    ssb_index: it.head.ssb_index,
                    measured: it.measured,
                },
                verdict: it.verdict,
            });
            self.drive.ranges.extend(ranges);
            self.remark_on_loss("angles", time_s);
            self.remark_on_faults(time_s);
            ssbs = later;
        }
        Ok(())
    }

    /// Adds remarks on constants of the vehicle that deviate from the settings.
    fn remark_on_constants(&mut self) {
        let Some(constants) = self.drive.constants else {
            return;
        };
        if self.drive.suspicions().next().is_some() {
            return; // the estimates belong to a wrong position
        }
        let time_s = self
            .drive
            .poses
            .last()
            .map_or(0.0, |last| last.estimate.time_s);
        let EstimatedConstants {
            odometer_scale,
            angle_time_offset_s,
            mounting_rad,
            ..
        } = constants;
        if odometer_scale.certainly_differs_by(MIN_SCALE) {
            let text = format!(
                "the odometer reads {:.3} ± {:.3} m per metre driven; check odometer.scale",
                odometer_scale.found, odometer_scale.std
            );
            self.remark(time_s, text);
        }
        if mounting_rad.certainly_differs_by(MIN_MOUNTING_RAD) {
            let text = format!(
                "the array's axis is at {:.3} ± {:.3} rad, not at {:.3}; check array.mounting_rad",
                mounting_rad.found, mounting_rad.std, mounting_rad.stated
            );
            self.remark(time_s, text);
        }
        if angle_time_offset_s.certainly_differs_by(MIN_ANGLE_TIME_OFFSET_S) {
            let text = format!(
                "by the odometry's clock, the angles are {:.0} ± {:.0} ms later than configured; \
                 this is compensated; check the clocks, receiver.angle_time_offset_s, and whether \
                 the odometry contains commands instead of measurements",
                1e3 * (angle_time_offset_s.found - angle_time_offset_s.stated),
                1e3 * angle_time_offset_s.std
            );
            self.remark(time_s, text);
        }
    }

    fn remark_on_loss(&mut self, what: &str, time_s: f64) {
        let (is_lost, recovered) = (self.onboard.is_lost(), self.onboard.recovered());
        if is_lost && !self.was_lost {
            let text = format!(
                "{what} at {time_s:.1} s: they contradict the position, which is unavailable; a \
                 search has started"
            );
            self.remark(time_s, text);
        }
        if let Some(how) = recovered.filter(|_| recovered != self.recovered) {
            let text = format!(
                "{what} at {time_s:.1} s: position found again, {:.2} m and {:.2} rad from the \
                 previous estimate",
                how.moved_m, how.turned_rad
            );
            self.remark(time_s, text);
        } else if self.was_lost && !is_lost {
            let text = format!("{what} at {time_s:.1} s: they agree with the position again");
            self.remark(time_s, text);
        }
        (self.was_lost, self.recovered) = (is_lost, recovered);
    }

    /// Adds remarks on faults of odometry and receive channels that begin or end.
    fn remark_on_faults(&mut self, time_s: f64) {
        let before = std::mem::replace(&mut self.faults, *self.onboard.faults());
        let now = self.faults;
        for begun in now.iter().filter(|it| !before.contains(it.fault)) {
            let text = format!(
                "fault {} at {time_s:.1} s: {}; {}",
                begun.fault.name(),
                begun.fault,
                begun.fault.what_to_do()
            );
            self.remark(time_s, text);
        }
        for ended in before.iter().filter(|it| !now.contains(it.fault)) {
            let text = format!(
                "fault {} at {time_s:.1} s: it has ended",
                ended.fault.name()
            );
            self.remark(time_s, text);
        }
    }

    /// Diagnoses the faults of the sensors that are active at the end of the drive, unless a
    /// diagnosis of the input explains why the angles contradict the odometry.
    fn diagnose_faults(&mut self) {
        if !self.drive.diagnoses.is_empty() {
            return;
        }
        let active = self.faults;
        for it in active.iter() {
            self.drive.diagnoses.push(Diagnosis {
                text: format!(
                    "since {:.1} s {}; {}",
                    it.since_s,
                    it.fault,
                    it.fault.what_to_do()
                ),
                is_of_start: false,
                is_harmless: false,
            });
        }
    }

    /// Processes the remaining odometry.
    ///
    /// # Errors
    /// [`ReplayError::Custom`].
    pub fn process_remaining_odometry(&mut self) -> Result<(), ReplayError> {
        self.odometry_until(f64::INFINITY)
    }

    /// Returns the estimated offset of the ranges of a radio head (m) at the end of the drive.
    pub(super) fn range_offset(&self, pci: u16, ssb_index: u8) -> Option<RangeState> {
        self.onboard.range_offset(pci, ssb_index)
    }

    /// Returns the estimated relative scale error of the ranges at the end of the drive.
    pub(super) fn range_scale(&self) -> Option<RangeState> {
        self.onboard.range_scale()
    }

    /// Processes the remaining odometry and returns the located drive.
    ///
    /// # Errors
    /// [`ReplayError::Custom`].
    pub fn finish(mut self) -> Result<LocatedDrive, ReplayError> {
        self.odometry_until(f64::INFINITY)?;
        self.drive.constants = self.onboard.constants();
        if let Some(constants) = &mut self.drive.constants {
            constants.angle_time_offset_s.found += self.set_back_s;
        }
        self.remark_on_constants();
        self.diagnose_faults();
        self.drive.remarks = gathered(self.drive.remarks);
        Ok(self.drive)
    }

    /// Records the drive for smoothing; from now on, late angles are rejected.
    pub fn keep_journal(&mut self) {
        self.onboard.keep_journal();
    }

    /// Returns the smoothed poses at the odometry samples, from the first known pose on. They use
    /// the measurements of the whole drive.
    ///
    /// # Errors
    /// [`ReplayError::Custom`].
    pub fn smoothed(mut self) -> Result<Vec<LocatedPose>, ReplayError> {
        self.odometry_until(f64::INFINITY)?;
        let smoothed = self.onboard.smoothed();
        let poses = &self.drive.poses;
        let known = poses
            .iter()
            .skip(poses.len().saturating_sub(smoothed.len()));
        Ok(known
            .zip(smoothed)
            .map(|(pose, estimate)| LocatedPose { estimate, ..*pose })
            .collect())
    }

    /// Adds a remark on something that the pipeline does not detect itself.
    pub fn remark(&mut self, time_s: f64, text: String) {
        self.drive.remarks.push(Remark { time_s, text });
    }

    /// Returns the angles processed so far, each with its result (used or rejected).
    pub fn aoa_estimates(&self) -> &[AngleResult] {
        &self.drive.aoa_estimates
    }

    /// Returns the drive located so far.
    pub const fn located(&self) -> &LocatedDrive {
        &self.drive
    }

    /// Adds a diagnosis of the input, also as a remark. A wrong start is harmless if the vehicle
    /// was found again.
    pub fn diagnose(&mut self, mut diagnosis: Diagnosis) {
        let first = self.drive.poses.first();
        let time_s = first.map_or(f64::NEG_INFINITY, |first| first.estimate.time_s);
        let is_found = self.onboard.recovered().is_some() && !self.onboard.is_lost();
        diagnosis.is_harmless |= diagnosis.is_of_start && is_found;
        self.remark(time_s, diagnosis.text.clone());
        self.drive.diagnoses.push(diagnosis);
    }

    fn odometry_until(&mut self, time_s: f64) -> Result<(), ReplayError> {
        while let Some(sample) = self.odometry.next_if(|sample| sample.time_s <= time_s) {
            let at_s = sample.time_s;
            self.ranges_before(at_s)?;
            let verdict = self.onboard.odometry(sample);
            match verdict.map_err(ReplayError::Custom)? {
                Ok(OdometryResult::DistanceJump { jump_m }) => self.remark(
                    at_s,
                    format!(
                        "odometry at {at_s} s: the distance jumps by {} m, the speed was \
                         used instead",
                        number(jump_m)
                    ),
                ),
                Ok(OdometryResult::YawRateRefused { radps }) => self.remark(
                    at_s,
                    format!(
                        "odometry at {at_s} s: a yaw rate of {} rad/s is impossible, it was not \
                         used; check its unit",
                        number(radps)
                    ),
                ),
                Ok(OdometryResult::BeyondMap { by_m }) => {
                    if !self.beyond_map {
                        let text = format!(
                            "odometry at {at_s} s: {by_m:.1} m beyond the end of the road, \
                             continued without road"
                        );
                        self.remark(at_s, text);
                    }
                    self.beyond_map = true;
                }
                Ok(OdometryResult::InMapGap { from_m, to_m }) => {
                    self.beyond_map = false;
                    if !self.gaps_m.contains(&from_m) {
                        let text = format!(
                            "odometry at {at_s} s: the road was not surveyed from {from_m:.1} to \
                             {to_m:.1} m, continued without road"
                        );
                        self.remark(at_s, text);
                        self.gaps_m.push(from_m);
                    }
                }
                Ok(_) => self.beyond_map = false,
                // A rejected sample contains no information about the vehicle's position.
                Err(defect) => {
                    self.remark(at_s, format!("odometry at {at_s} s: left out, {defect}"));
                    continue;
                }
            }
            self.remark_on_faults(at_s);
            self.drive.poses.push(LocatedPose {
                estimate: self.onboard.pose(at_s).map_err(ReplayError::Custom)?,
                speed_mps: sample.speed_mps,
                yaw_rate_radps: sample.yaw_rate_radps,
                searching: self.onboard.searching(),
                is_lost: self.onboard.is_lost(),
                constants: self.onboard.constants(),
            });
        }
        self.ranges_before(time_s)
    }
}
