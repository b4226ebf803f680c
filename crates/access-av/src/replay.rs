//! A recorded drive through the pipeline: odometry and SSBs, or angles, in order of time.

use std::collections::BTreeMap;

use crate::BoxError;
use crate::localize::tracker::{Calibration, OdometryVerdict};
use crate::localize::{PoseEstimate, UpdateReason};
use crate::observation::{OdometrySample, SsbObservation};
use crate::onboard::{Custom, Execution, Onboard};
use crate::platform::Platform;
use crate::receive::{ReceiveError, Receiver};
use crate::recording::{AngleLog, LoggedAngle, OdometryLog, Recording, RecordingError, Site};
use crate::scenario::{LocalizerSettings, ScenarioError};
use thiserror::Error;

/// Why a drive cannot be located.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The site cannot be used.
    #[error(transparent)]
    Site(#[from] ScenarioError),
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The receiver refuses the samples.
    #[error("{file}: {source}")]
    Receive {
        /// The recording.
        file: String,
        /// Why.
        source: ReceiveError,
    },
    /// The recording's rate or band does not suit the site.
    #[error("{file}: {source}")]
    FrontEnd {
        /// The recording.
        file: String,
        /// Why.
        source: nr_ssb::front_end::FrontEndError,
    },
    /// Not as many channels as the vehicle has antennas.
    #[error("{file}: {channels} channels; the vehicle's array has {antennas}")]
    Channels {
        /// The recording.
        file: String,
        /// Its channels.
        channels: usize,
        /// The vehicle's antennas.
        antennas: usize,
    },
    /// No usable odometry.
    #[error("the odometry holds no usable sample")]
    NoOdometry,
    /// The estimator failed.
    #[error("{0}")]
    Estimator(BoxError),
}

/// Where the vehicle was at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocatedPose {
    /// Time, pose and covariance.
    pub estimate: PoseEstimate,
    /// Odometer speed in m/s.
    pub speed_mps: f64,
    /// Yaw rate in rad/s, where there is a gyroscope.
    pub yaw_rate_radps: Option<f64>,
    /// Number of places the vehicle may be at, while the first pose is searched for; the estimate
    /// is their mean.
    pub searching: Option<usize>,
    /// How far the array has come from its survey.
    pub calibration: Option<Calibration>,
}

/// What is remarkable about one item of the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// When in the drive it came, in seconds.
    pub time_s: f64,
    /// Which item, what is wrong with it, and whether it was left out.
    pub text: String,
}

/// A located drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LocatedDrive {
    /// One pose per odometry sample.
    pub poses: Vec<LocatedPose>,
    /// The angles and what became of them.
    pub executions: Vec<Execution>,
    /// The poses as seen from the end of the drive, from the first known one on, where asked for.
    pub smoothed: Vec<LocatedPose>,
    /// What was remarkable about single items of the input, in order of time.
    pub remarks: Vec<Remark>,
}

/// A drive being located.
pub struct Replay<'a> {
    onboard: Onboard,
    odometry: std::iter::Peekable<std::slice::Iter<'a, OdometrySample>>,
    drive: LocatedDrive,
    /// Whether it is driven to be smoothed.
    looks_back: bool,
    /// Whether the odometry before told of the end of the road.
    beyond_map: bool,
    /// Where the gaps of the road begin that were remarked on (m).
    gaps_m: Vec<f64>,
}

impl<'a> Replay<'a> {
    /// A drive that starts at the site's initial pose, or anywhere on its road if it has none.
    ///
    /// # Errors
    /// [`ReplayError::Site`], [`ReplayError::NoOdometry`].
    pub fn new(site: &Site, odometry: &'a OdometryLog) -> Result<Self, ReplayError> {
        if odometry.samples.is_empty() {
            return Err(ReplayError::NoOdometry);
        }
        let platform = Platform::load(&site.scenario.platform.name)?;
        let onboard = Onboard::new(
            &site.scenario,
            &platform,
            site.initial_pose.unwrap_or_default(),
            Custom::default(),
        )?;
        Ok(Self {
            onboard,
            beyond_map: false,
            gaps_m: Vec::new(),
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
            looks_back: false,
        })
    }

    /// Takes in an SSB, after the odometry up to it.
    ///
    /// # Errors
    /// [`ReplayError::Estimator`].
    pub fn ssb(&mut self, observation: &SsbObservation) -> Result<(), ReplayError> {
        self.odometry_until(observation.ssb.time_s);
        let execution = self
            .onboard
            .estimate(observation)
            .map_err(ReplayError::Estimator)?;
        self.drive.executions.push(execution);
        Ok(())
    }

    /// Takes in an angle, after the odometry up to it.
    pub fn angle(&mut self, angle: &LoggedAngle) {
        self.odometry_until(angle.ssb.time_s);
        self.drive
            .executions
            .push(self.onboard.take_in(angle.ssb, Some(angle.measured)));
    }

    /// Takes in the rest of the odometry.
    pub fn finish(mut self) -> LocatedDrive {
        self.odometry_until(f64::INFINITY);
        self.drive
            .remarks
            .sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        self.drive
    }

    fn remark(&mut self, time_s: f64, text: String) {
        self.drive.remarks.push(Remark { time_s, text });
    }

    fn odometry_until(&mut self, time_s: f64) {
        while let Some(sample) = self.odometry.next_if(|sample| sample.time_s <= time_s) {
            let at_s = sample.time_s;
            if self.looks_back {
                self.onboard.keep_journal();
            }
            match self.onboard.odometry(sample) {
                Ok(OdometryVerdict::DistanceJump { jump_m }) => self.remark(
                    at_s,
                    format!(
                        "odometry at {at_s} s: the distance jumps by {jump_m:.3} m, the speed was \
                         used instead"
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
                estimate: PoseEstimate {
                    time_s: at_s,
                    ..self.onboard.pose()
                },
                speed_mps: sample.speed_mps,
                yaw_rate_radps: sample.yaw_rate_radps,
                searching: self.onboard.searching(),
                calibration: self.onboard.calibration(),
            });
        }
    }
}

/// Locates a drive by angles that were estimated before, and smooths it if asked to.
///
/// # Errors
/// [`ReplayError::Site`], [`ReplayError::NoOdometry`].
pub fn locate_angles(
    site: &Site,
    odometry: &OdometryLog,
    angles: &AngleLog,
    smooth: bool,
) -> Result<LocatedDrive, ReplayError> {
    let mut replay = Replay::new(site, odometry)?;
    for remark in &angles.remarks {
        replay.remark(remark.time_s, remark.to_string());
    }
    for angle in &angles.angles {
        replay.angle(angle);
    }
    let mut drive = replay.finish();
    if smooth {
        drive.smoothed = look_back(site, odometry, &drive.executions)?;
    }
    Ok(drive)
}

/// Locates a drive by recorded samples, and smooths it if asked to. Sample 0 was received at `start_time_s` of the odometry.
///
/// # Errors
/// [`ReplayError`].
pub fn locate_recording(
    site: &Site,
    odometry: &OdometryLog,
    recording: &mut Recording,
    start_time_s: f64,
    smooth: bool,
) -> Result<LocatedDrive, ReplayError> {
    let mut replay = Replay::new(site, odometry)?;
    for warning in recording.warnings() {
        replay.remark(f64::NEG_INFINITY, warning.to_string());
    }
    let file = recording.data_file().display().to_string();
    let mut receiver = Receiver::new(site.receiver_config())
        .map_err(|source| ReplayError::Receive { file, source })?;
    receiver.run(recording, start_time_s, |observation| {
        replay.ssb(observation)
    })?;
    let mut drive = replay.finish();
    if smooth {
        drive.smoothed = look_back(site, odometry, &drive.executions)?;
    }
    Ok(drive)
}

/// Drives once more, to see each pose from the end. A radio head that was found faulty is not
/// heard before it was trusted again; so nothing needs a guard.
fn look_back(
    site: &Site,
    odometry: &OdometryLog,
    executions: &[Execution],
) -> Result<Vec<LocatedPose>, ReplayError> {
    let mut site = site.clone();
    if let LocalizerSettings::Tracker(settings) = &mut site.scenario.localizer {
        settings.integrity = false;
    }
    let mut replay = Replay::new(&site, odometry)?;
    replay.looks_back = true;
    let mut mistrusted_until_s = BTreeMap::new();
    for execution in executions {
        if execution.verdict.reason == UpdateReason::Excluded {
            let ssb = &execution.ssb;
            mistrusted_until_s.insert((ssb.pci, ssb.ssb_index), ssb.time_s);
        }
    }
    for execution in executions {
        let ssb = execution.ssb;
        let until_s = mistrusted_until_s.get(&(ssb.pci, ssb.ssb_index));
        if until_s.is_none_or(|until_s| ssb.time_s > *until_s)
            && let Some(measured) = execution.measured
        {
            replay.angle(&LoggedAngle { ssb, measured });
        }
    }
    replay.odometry_until(f64::INFINITY);
    let smoothed = replay.onboard.smoothed();
    let poses = &replay.drive.poses;
    let known = poses
        .iter()
        .skip(poses.len() - smoothed.len().min(poses.len()));
    Ok(known
        .zip(smoothed)
        .map(|(pose, estimate)| LocatedPose { estimate, ..*pose })
        .collect())
}
