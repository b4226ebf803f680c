//! A recorded drive through the pipeline: odometry and SSBs, or angles, in order of time.

use crate::BoxError;
use crate::localize::PoseEstimate;
use crate::observation::{OdometrySample, SsbObservation};
use crate::onboard::{Custom, Execution, Onboard};
use crate::platform::Platform;
use crate::receive::{ReceiveError, Receiver};
use crate::recording::{LoggedAngle, Recording, RecordingError, Site};
use crate::scenario::ScenarioError;
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
}

/// A located drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LocatedDrive {
    /// One pose per odometry sample.
    pub poses: Vec<LocatedPose>,
    /// The angles and what became of them.
    pub executions: Vec<Execution>,
}

/// A drive being located.
pub struct Replay<'a> {
    onboard: Onboard,
    odometry: std::iter::Peekable<std::slice::Iter<'a, OdometrySample>>,
    drive: LocatedDrive,
}

impl<'a> Replay<'a> {
    /// A drive that starts at the site's initial pose; `odometry` is in order of time.
    ///
    /// # Errors
    /// [`ReplayError::Site`], [`ReplayError::NoOdometry`].
    pub fn new(site: &Site, odometry: &'a [OdometrySample]) -> Result<Self, ReplayError> {
        if odometry.is_empty() {
            return Err(ReplayError::NoOdometry);
        }
        let platform = Platform::load(&site.scenario.platform.name)?;
        let onboard = Onboard::new(
            &site.scenario,
            &platform,
            site.initial_pose,
            Custom::default(),
        )?;
        Ok(Self {
            onboard,
            odometry: odometry.iter().peekable(),
            drive: LocatedDrive::default(),
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
    }

    fn odometry_until(&mut self, time_s: f64) {
        while let Some(sample) = self.odometry.next_if(|sample| sample.time_s <= time_s) {
            // Nothing is known of the vehicle's place by a sample that is left out.
            if self.onboard.odometry(sample).is_ok() {
                self.drive.poses.push(LocatedPose {
                    estimate: PoseEstimate {
                        time_s: sample.time_s,
                        ..self.onboard.pose()
                    },
                    speed_mps: sample.speed_mps,
                    yaw_rate_radps: sample.yaw_rate_radps,
                });
            }
        }
    }
}

/// Locates a drive by angles that were estimated before.
///
/// # Errors
/// [`ReplayError::Site`], [`ReplayError::NoOdometry`].
pub fn locate_angles(
    site: &Site,
    odometry: &[OdometrySample],
    angles: &[LoggedAngle],
) -> Result<LocatedDrive, ReplayError> {
    let mut replay = Replay::new(site, odometry)?;
    for angle in angles {
        replay.angle(angle);
    }
    Ok(replay.finish())
}

/// Locates a drive by recorded samples. Sample 0 was received at `start_time_s` of the odometry.
///
/// # Errors
/// [`ReplayError`].
pub fn locate_recording(
    site: &Site,
    odometry: &[OdometrySample],
    recording: &mut Recording,
    start_time_s: f64,
) -> Result<LocatedDrive, ReplayError> {
    let mut replay = Replay::new(site, odometry)?;
    let file = recording.data_file().display().to_string();
    let mut receiver = Receiver::new(site.receiver_config())
        .map_err(|source| ReplayError::Receive { file, source })?;
    receiver.run(recording, start_time_s, |observation| {
        replay.ssb(observation)
    })?;
    Ok(replay.finish())
}
