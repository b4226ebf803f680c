//! A drive being replayed.

use onboard::burst::{Burst, OfSsb, first_burst};
use onboard::geometry::Pose;
use onboard::localize::OdometryVerdict;
use onboard::localize::Recovered;
use onboard::localize::ekf::EstimatedConstants;
use onboard::observation::OdometrySample;
use onboard::settings::{Platform, Site, Vehicle};
use onboard::{Custom, Execution, Onboard};

use super::clock::LEAST_LATENESS_S;
use super::error::ReplayError;
use super::located::{Diagnosis, LocatedDrive, LocatedPose, Remark, gathered};
use crate::library::load;
use crate::odometry::OdometryLog;

/// Departures of the odometer's scale and of the array's mounting (rad) below which nobody minds.
const LEAST_SCALE: f64 = 0.03;
const LEAST_MOUNTING_RAD: f64 = 0.05;

/// A drive being located.
pub struct Replay<'a> {
    onboard: Onboard,
    odometry: std::iter::Peekable<std::slice::Iter<'a, OdometrySample>>,
    drive: LocatedDrive,
    /// Whether the localizer was lost, and how it came back last.
    was_lost: bool,
    recovered: Option<Recovered>,
    /// Whether the odometry before told of the end of the road.
    beyond_map: bool,
    /// Where the gaps of the road begin that were remarked on (m).
    gaps_m: Vec<f64>,
    /// What was taken off the angles' times (s).
    set_back_s: f64,
}

impl<'a> Replay<'a> {
    /// A drive of a vehicle at a site, from `start` on.
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
        if odometry.samples.len() < 2 {
            let mut unused = odometry.remarks.iter().filter(|it| !it.issue.used());
            let why = unused.next().map(ToString::to_string);
            return Err(ReplayError::NoOdometry { why });
        }
        let platform: Platform = load(&vehicle.platform.name)?;
        let onboard = Onboard::new(site, vehicle, &platform, start, custom)?;
        Ok(Self {
            onboard,
            was_lost: false,
            recovered: None,
            beyond_map: false,
            gaps_m: Vec::new(),
            set_back_s: 0.0,
            odometry: odometry.samples.iter().peekable(),
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

    /// The angles' times come with a lateness (s) taken off that their settings do not state.
    pub const fn set_back(&mut self, lateness_s: f64) {
        self.set_back_s = lateness_s;
    }

    /// Takes in SSBs, or angles, in the order they are given, after the odometry up to each burst.
    ///
    /// # Errors
    /// [`ReplayError::Custom`].
    pub fn hear<T: OfSsb>(&mut self, mut ssbs: &[T]) -> Result<(), ReplayError> {
        while !ssbs.is_empty() {
            let (burst, later) = ssbs.split_at(first_burst(ssbs));
            let time_s = burst.first().map_or(f64::NAN, |first| first.ssb().time_s);
            self.odometry_until(time_s)?;
            let mut source = Burst(burst);
            let heard = self.onboard.hear(time_s, &mut source);
            let heard = heard.map_err(ReplayError::Custom)?;
            self.drive.executions.extend_from_slice(heard.executions);
            self.remark_on_loss(time_s);
            ssbs = later;
        }
        Ok(())
    }

    /// Remarks on what the drive showed of the vehicle that its settings do not say.
    fn remark_on_constants(&mut self) {
        let Some(constants) = self.drive.constants else {
            return;
        };
        if self.drive.suspicions().next().is_some() {
            return; // found where the vehicle never was
        }
        let time_s = self
            .drive
            .poses
            .last()
            .map_or(0.0, |last| last.estimate.time_s);
        let EstimatedConstants {
            odometer_scale,
            lateness_s,
            mounting_rad,
            ..
        } = constants;
        if odometer_scale.is_remarkable(LEAST_SCALE) {
            let text = format!(
                "the odometer reads {:.3} ± {:.3} m per metre driven; check odometer.scale",
                odometer_scale.found, odometer_scale.std
            );
            self.remark(time_s, text);
        }
        if mounting_rad.is_remarkable(LEAST_MOUNTING_RAD) {
            let text = format!(
                "the array's axis is at {:.3} ± {:.3} rad, not at {:.3}; check array.mounting_rad",
                mounting_rad.found, mounting_rad.std, mounting_rad.stated
            );
            self.remark(time_s, text);
        }
        if lateness_s.is_remarkable(LEAST_LATENESS_S) {
            let text = format!(
                "angles are {:.0} ± {:.0} ms later than stated, by the odometry's clock, and are \
                 taken as that; check the clocks, receiver.lateness_s, and whether the odometry is \
                 of commands",
                1e3 * (lateness_s.found - lateness_s.stated),
                1e3 * lateness_s.std
            );
            self.remark(time_s, text);
        }
    }

    fn remark_on_loss(&mut self, time_s: f64) {
        let (is_lost, recovered) = (self.onboard.is_lost(), self.onboard.recovered());
        if is_lost && !self.was_lost {
            let text = format!(
                "angles at {time_s:.1} s: they come from elsewhere than expected, the position is \
                 not available; searching"
            );
            self.remark(time_s, text);
        }
        if let Some(how) = recovered.filter(|_| recovered != self.recovered) {
            let text = format!(
                "angles at {time_s:.1} s: found again, {:.2} m from and {:.2} rad against where it \
                 was believed to be",
                how.moved_m, how.turned_rad
            );
            self.remark(time_s, text);
        } else if self.was_lost && !is_lost {
            let text = format!("angles at {time_s:.1} s: they come from where expected again");
            self.remark(time_s, text);
        }
        (self.was_lost, self.recovered) = (is_lost, recovered);
    }

    /// Takes in the rest of the odometry.
    ///
    /// # Errors
    /// [`ReplayError::Custom`].
    pub fn drive_on(&mut self) -> Result<(), ReplayError> {
        self.odometry_until(f64::INFINITY)
    }

    /// Takes in the rest of the odometry, and hands over the drive.
    ///
    /// # Errors
    /// [`ReplayError::Custom`].
    pub fn finish(mut self) -> Result<LocatedDrive, ReplayError> {
        self.odometry_until(f64::INFINITY)?;
        self.drive.constants = self.onboard.constants();
        if let Some(constants) = &mut self.drive.constants {
            constants.lateness_s.found += self.set_back_s;
        }
        self.remark_on_constants();
        self.drive.remarks = gathered(self.drive.remarks);
        Ok(self.drive)
    }

    /// Drives to be smoothed, in order of time from now on.
    pub fn keep_journal(&mut self) {
        self.onboard.keep_journal();
    }

    /// The poses at the odometry samples as seen from the end of the drive, from the first known
    /// one on.
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

    /// Remarks on something that is not the pipeline's to see.
    pub fn remark(&mut self, time_s: f64, text: String) {
        self.drive.remarks.push(Remark { time_s, text });
    }

    /// The angles so far and what became of them.
    pub fn executions(&self) -> &[Execution] {
        &self.drive.executions
    }

    /// The drive so far.
    pub const fn located(&self) -> &LocatedDrive {
        &self.drive
    }

    /// Says what is wrong with the input. A wrong start does no harm once the vehicle was found
    /// again.
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
            let verdict = self.onboard.odometry(sample);
            match verdict.map_err(ReplayError::Custom)? {
                Ok(OdometryVerdict::DistanceJump { jump_m }) => self.remark(
                    at_s,
                    format!(
                        "odometry at {at_s} s: the distance jumps by {jump_m:.3} m, the speed was \
                         used instead"
                    ),
                ),
                Ok(OdometryVerdict::YawRateRefused { radps }) => self.remark(
                    at_s,
                    format!(
                        "odometry at {at_s} s: no vehicle turns by {radps:.1} rad/s, its yaw rate was \
                         refused; check its unit, or vehicle.top_yaw_rate_radps"
                    ),
                ),
                Ok(OdometryVerdict::BeyondMap { by_m }) => {
                    if !self.beyond_map {
                        let text = format!(
                            "odometry at {at_s} s: {by_m:.1} m beyond the end of the road, \
                             driving on without it"
                        );
                        self.remark(at_s, text);
                    }
                    self.beyond_map = true;
                }
                Ok(OdometryVerdict::InMapGap { from_m, to_m }) => {
                    self.beyond_map = false;
                    if !self.gaps_m.contains(&from_m) {
                        let text = format!(
                            "odometry at {at_s} s: the road was not surveyed from {from_m:.1} to \
                             {to_m:.1} m, driving on without it"
                        );
                        self.remark(at_s, text);
                        self.gaps_m.push(from_m);
                    }
                }
                Ok(_) => self.beyond_map = false,
                // Nothing is known of the vehicle's place by a sample that is left out.
                Err(defect) => {
                    self.remark(at_s, format!("odometry at {at_s} s: left out, {defect}"));
                    continue;
                }
            }
            self.drive.poses.push(LocatedPose {
                estimate: self.onboard.pose(at_s).map_err(ReplayError::Custom)?,
                speed_mps: sample.speed_mps,
                yaw_rate_radps: sample.yaw_rate_radps,
                searching: self.onboard.searching(),
                is_lost: self.onboard.is_lost(),
                constants: self.onboard.constants(),
            });
        }
        Ok(())
    }
}
