//! Recorded drives: simulation and localization.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use numpy::PyReadonlyArray1;
use onboard::geometry::Pose;
use onboard::localize::UpdateResult;
use onboard::localize::ekf::EstimatedConstant;
use onboard::settings::{Site as CoreSite, Vehicle as CoreVehicle};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recording::replay::{self, ReplayError, StartChoice};
use recording::{
    Datatype, OdometryChoice, RangeLog, Recording, TimedPose, angle_log_of_columns, is_prs_log,
    is_range_log, read_angle_log, read_odometry, read_prs_log, read_range_log, write_drive_mcap,
    write_tum,
};
use simulate::{SynthError, SynthSettings};

use crate::campaign::measured;
use crate::message::brief;
use crate::recording::{RecordingError, recording_error};
use crate::settings::{Scenario, Site, Vehicle, settings_error};
use crate::table::{Table, covariance, level};

/// Simulate a recorded drive of a scenario.
///
/// Writes `iq.sigmf-meta`, `iq.sigmf-data`, `odometry.csv`, `site.toml`, `vehicle.toml`,
/// `scenario.toml` and `truth.tum`.
///
/// Parameters
/// ----------
/// scenario : Scenario
///     Scenario to simulate.
/// directory : path-like
///     Output directory, created if it does not exist.
/// seed, run : int
///     Seed of the random streams and number of the run.
/// duration_s : float, optional
///     Duration in seconds from the start [default: the whole drive].
/// continuous : bool
///     Whether to record the samples between the SSB bursts too, which makes the files many times
///     larger.
/// datatype : str
///     Sample format, `ci16_le` or `cf32_le`.
/// progress : callable, optional
///     Callback with the recorded fraction of the drive.
///
/// Returns
/// -------
/// tuple of (path of the metadata, number of bursts, samples per antenna)
#[pyfunction]
#[pyo3(signature = (scenario, directory, *, seed = 1, run = 0, duration_s = None, continuous = false, datatype = "ci16_le", progress = None))]
#[allow(clippy::too_many_arguments, clippy::needless_pass_by_value)] // Python's keywords
pub fn synthesize(
    py: Python<'_>,
    scenario: &Scenario,
    directory: PathBuf,
    seed: u64,
    run: u64,
    duration_s: Option<f64>,
    continuous: bool,
    datatype: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<(PathBuf, usize, u64)> {
    let datatype = match datatype {
        "ci16_le" => Datatype::Ci16Le,
        "cf32_le" => Datatype::Cf32Le,
        other => {
            return Err(PyValueError::new_err(format!(
                "datatype is {other:?}; allowed: ci16_le, cf32_le"
            )));
        }
    };
    let settings = SynthSettings {
        seed,
        run,
        duration_s,
        continuous,
        datatype,
    };
    let mut raised = None;
    let mut report = |share: f64| {
        let outcome = Python::attach(|py| {
            py.check_signals()?;
            let called = progress.as_ref().map(|call| call.call1(py, (share,)));
            called.transpose().map(drop)
        });
        raised = outcome.err();
        raised.is_none()
    };
    let made = py
        .detach(|| simulate::synthesize(&scenario.0, &settings, &directory, &mut report))
        .map_err(|error| match error {
            SynthError::Stopped => raised
                .take()
                .unwrap_or_else(|| PyValueError::new_err("stopped")),
            other => synth_error(other),
        })?;
    Ok((made.recording, made.bursts, made.samples))
}

fn synth_error(error: SynthError) -> PyErr {
    match error {
        SynthError::Settings(error) => settings_error(error),
        SynthError::Recording(error) => recording_error(error),
        other => PyValueError::new_err(brief(other)),
    }
}

/// Simulate a log of the angles that the vehicle's receiver estimates in a scenario.
///
/// Writes `angles.csv`, `odometry.csv`, `site.toml`, `vehicle.toml`, `scenario.toml` and
/// `truth.tum`, and returns the number of angles.
#[pyfunction]
#[pyo3(signature = (scenario, directory, *, seed = 1, run = 0, duration_s = None))]
#[allow(clippy::needless_pass_by_value)] // what extraction yields
pub fn log_angles(
    py: Python<'_>,
    scenario: &Scenario,
    directory: PathBuf,
    seed: u64,
    run: u64,
    duration_s: Option<f64>,
) -> PyResult<usize> {
    let end_s = duration_s.unwrap_or(f64::INFINITY);
    py.detach(|| simulate::log_angles(&scenario.0, seed, run, end_s, &directory))
        .map_err(synth_error)
}

/// Read a TUM trajectory as columns `time_s`, `x_m`, `y_m`, `heading_rad`.
///
/// Raises
/// ------
/// RecordingError
///     A line is not eight numbers with a unit quaternion.
#[pyfunction]
#[allow(clippy::needless_pass_by_value)] // what extraction yields
pub fn read_tum(py: Python<'_>, file: PathBuf) -> PyResult<Py<PyDict>> {
    let poses = recording::read_tum(&file).map_err(recording_error)?;
    let table = Table::new(py, poses.iter())
        .column("time_s", |it| it.time_s)?
        .column("x_m", |it| it.pose.x_m)?
        .column("y_m", |it| it.pose.y_m)?
        .column("heading_rad", |it| it.pose.heading_rad)?;
    Ok(table.finish())
}

/// Locate a recorded drive.
///
/// Parameters
/// ----------
/// site : Site
///     Radio heads and, optionally, the road.
/// vehicle : Vehicle
///     Array, odometer and localizer.
/// odometry : path-like
///     CSV file with the columns `time_s`, `distance_m`, `speed_mps` and, with a gyroscope,
///     `yaw_rate_radps`; or an MCAP file or a rosbag2 folder with `nav_msgs/msg/Odometry`.
/// recording : path-like
///     SigMF recording of the array's samples, CSV log of angles or ranges, or log of an
///     OpenAirInterface UE (`.log`, `.txt`).
/// angles : dict of ndarray, optional
///     Columns of a log of angles that was read from `recording`, float64, NaN for missing values.
/// topic, imu_topic : str, optional
///     Topic of the odometry in a bag with several, and topic of the IMU with the yaw rate.
/// start_time_s : float
///     Time of the recording's first sample according to the odometry's clock.
/// start : tuple of float, optional
///     Initial pose (x in metres, y in metres, heading in radians) instead of the vehicle's.
/// start_unknown : bool
///     Whether to search for the initial pose along the road, even if the vehicle has one.
/// smooth : bool
///     Whether to smooth the poses from the end of the drive, which fills `smoothed`.
///
/// Raises
/// ------
/// RecordingError, SettingsError
///     An unusable recording or odometry file; a vehicle that is incompatible with the site.
#[pyfunction]
#[pyo3(signature = (
    site, vehicle, odometry, recording, *, angles = None, topic = None, imu_topic = None,
    start_time_s = 0.0, start = None, start_unknown = false, smooth = false
))]
#[allow(clippy::too_many_arguments, clippy::needless_pass_by_value)] // Python's keywords
pub fn locate(
    py: Python<'_>,
    site: &Site,
    vehicle: &Vehicle,
    odometry: PathBuf,
    recording: PathBuf,
    angles: Option<BTreeMap<String, PyReadonlyArray1<'_, f64>>>,
    topic: Option<&str>,
    imu_topic: Option<&str>,
    start_time_s: f64,
    start: Option<[f64; 3]>,
    start_unknown: bool,
    smooth: bool,
) -> PyResult<LocatedDrive> {
    let pose = start.map(|[x_m, y_m, heading_rad]| Pose {
        x_m,
        y_m,
        heading_rad,
    });
    if start.is_some_and(|values| values.iter().any(|value| !value.is_finite())) {
        return Err(PyValueError::new_err(
            "`start` must be three finite numbers",
        ));
    }
    if start.is_some() && start_unknown {
        return Err(PyValueError::new_err(
            "give either `start` or `start_unknown`",
        ));
    }
    let start = match pose {
        Some(pose) => StartChoice::At(pose),
        None if start_unknown => StartChoice::Unknown,
        None => StartChoice::AsSet,
    };
    let owned = |it: &PyReadonlyArray1<'_, f64>| it.as_array().to_vec();
    let angles = angles.map(|columns| {
        let columns = columns.iter();
        columns
            .map(|(name, it)| (name.clone(), owned(it)))
            .collect()
    });
    let drive = RecordedDrive {
        odometry: &odometry,
        recording: &recording,
        angles,
        choice: OdometryChoice {
            topic,
            imu_topic,
            track_width_m: vehicle.0.odometer.track_width_m,
        },
        start_time_s,
        start,
    };
    crate::arrays::look_up(py)?;
    py.detach(|| drive.locate(&site.0, &vehicle.0, smooth))
        .map(|core| LocatedDrive { core })
        .map_err(|error| match drive.faulty_file(&error) {
            Some(file) => RecordingError::new_err(format!("{}: {}", file.display(), brief(error))),
            None => replay_error(error),
        })
}

/// Inputs of a recorded drive.
struct RecordedDrive<'a> {
    odometry: &'a Path,
    recording: &'a Path,
    /// Columns of a log of angles that was read elsewhere.
    angles: Option<BTreeMap<String, Vec<f64>>>,
    choice: OdometryChoice<'a>,
    start_time_s: f64,
    start: StartChoice,
}

impl RecordedDrive<'_> {
    /// Returns the file that causes an error whose message does not name it.
    fn faulty_file(&self, error: &ReplayError) -> Option<&Path> {
        match error {
            ReplayError::NoOdometry { .. } => Some(self.odometry),
            ReplayError::TimeUnit { of, .. } if *of == "odometry" => Some(self.odometry),
            ReplayError::TimeUnit { .. }
            | ReplayError::NoAngle { .. }
            | ReplayError::Clocks { .. }
            | ReplayError::UnknownRadioHeads { .. } => Some(self.recording),
            _ => None,
        }
    }

    fn locate(
        &self,
        site: &CoreSite,
        vehicle: &CoreVehicle,
        smooth: bool,
    ) -> Result<replay::LocatedDrive, ReplayError> {
        if self.angles.is_none()
            && let Some(log) = ranges(site, self.recording)?
        {
            if smooth {
                return Err(ReplayError::Custom(
                    "smoothing needs angles; it does not support ranges".into(),
                ));
            }
            let odometry = read_odometry(self.odometry, &self.choice)?;
            return replay::locate_ranges(site, vehicle, self.start, &odometry, &log);
        }
        let odometry = read_odometry(self.odometry, &self.choice)?;
        let angles = match &self.angles {
            Some(columns) => Some(angle_log_of_columns(self.recording, columns)?),
            None if is(self.recording, "csv") => Some(read_angle_log(self.recording)?),
            None => None,
        };
        if let Some(angles) = angles {
            let (site, vehicle) = &replay::as_stated(site, vehicle);
            replay::locate_angles(site, vehicle, self.start, &odometry, &angles, smooth)
        } else {
            replay::locate_recording(
                site,
                vehicle,
                self.start,
                &odometry,
                &mut Recording::open(self.recording)?,
                self.start_time_s,
                smooth,
            )
        }
    }
}

/// Returns the ranges of a file, if it contains ranges.
fn ranges(site: &CoreSite, file: &Path) -> Result<Option<RangeLog>, recording::RecordingError> {
    if is_prs_log(file) {
        return read_prs_log(file, site.ssb.subcarrier_spacing_khz).map(Some);
    }
    if is(file, "csv") && is_range_log(file)? {
        return read_range_log(file).map(Some);
    }
    Ok(None)
}

/// Read the ranges of a CSV file or of an OpenAirInterface log.
///
/// Parameters
/// ----------
/// site : Site
///     Site with the subcarrier spacing of the positioning reference signals.
/// file : path-like
///     Range log, `.csv`, or log of an OpenAirInterface UE, `.log` or `.txt`.
///
/// Returns
/// -------
/// tuple
///     Columns `time_s`, `pci`, `ssb_index` and `range_m`; whether the ranges are one-way delays; the
///     length of a sample in metres, if the delays are in samples; and remarks on single lines.
///
/// Raises
/// ------
/// RecordingError
///     An unusable file, or one without ranges.
#[pyfunction]
#[allow(clippy::needless_pass_by_value)] // what extraction yields
#[allow(clippy::type_complexity)] // described above
pub fn read_ranges(
    py: Python<'_>,
    site: &Site,
    file: PathBuf,
) -> PyResult<(Py<PyDict>, bool, Option<f64>, Vec<String>)> {
    let log = ranges(&site.0, &file).map_err(recording_error)?;
    let log = log.ok_or_else(|| {
        RecordingError::new_err(format!(
            "{}: contains no ranges; it must be a CSV file with range_m, delay_ns or delay_samples, or a \
             log of an OpenAirInterface UE (.log, .txt)",
            file.display()
        ))
    })?;
    let table = Table::new(py, log.ranges.iter())
        .column("time_s", |it| it.measured.time_s)?
        .column("pci", |it| it.pci)?
        .column("ssb_index", |it| it.ssb_index)?
        .column("range_m", |it| it.measured.value)?;
    let remarks = log.remarks.iter().map(|(_, text)| text.clone()).collect();
    Ok((table.finish(), log.has_delays, log.sample_m, remarks))
}

fn is(path: &Path, extension: &str) -> bool {
    path.extension()
        .is_some_and(|it| it.eq_ignore_ascii_case(extension))
}

/// Estimate the angles of a recording with the vehicle's receiver.
///
/// Parameters
/// ----------
/// site : Site
///     Site with the radio heads to receive.
/// vehicle : Vehicle
///     Array, receiver and estimator.
/// recording : path-like
///     SigMF recording of the array's samples.
/// start_time_s : float
///     Time of the first sample in seconds.
///
/// Returns
/// -------
/// tuple
///     Columns `time_s`, `pci`, `ssb_index`, `snr_db`, `phase_rad`, `phase_sigma_rad` (receiver
///     noise and the site's scatter), `phase_noise_sigma_rad` (receiver noise only), `angle_rad`
///     and `resolved` (1 or 0); the vehicle with receiver settings for which these standard
///     deviations are the total error; and the faults of the recording.
///
/// Raises
/// ------
/// RecordingError, SettingsError
///     An unusable recording, or one without an SSB of the site; a vehicle that is incompatible
///     with the site.
#[pyfunction]
#[pyo3(signature = (site, vehicle, recording, *, start_time_s = 0.0))]
#[allow(clippy::needless_pass_by_value)] // what extraction yields
pub fn estimate_angles(
    py: Python<'_>,
    site: &Site,
    vehicle: &Vehicle,
    recording: PathBuf,
    start_time_s: f64,
) -> PyResult<(Py<PyDict>, Vehicle, Vec<String>)> {
    crate::arrays::look_up(py)?;
    let (found, warnings) = py
        .detach(|| {
            let mut opened = Recording::open(&recording)?;
            let warnings = opened.warnings().iter().map(ToString::to_string).collect();
            let found = replay::estimate_angles(&site.0, &vehicle.0, &mut opened, start_time_s)?;
            Ok((found, warnings))
        })
        .map_err(replay_error)?;
    let rows = found.angles.iter().zip(&found.noise_sigma_rad);
    let table = Table::new(py, rows)
        .column("time_s", |(it, _)| it.ssb.time_s)?
        .column("pci", |(it, _)| it.ssb.pci)?
        .column("ssb_index", |(it, _)| it.ssb.ssb_index)?
        .column("snr_db", |(it, _)| it.measured.snr_db)?
        .column("phase_rad", |(it, _)| it.measured.phase_rad)?
        .column("phase_sigma_rad", |(it, _)| it.measured.phase_sigma_rad)?
        .column("phase_noise_sigma_rad", |(_, sigma_rad)| *sigma_rad)?
        .column("angle_rad", |(it, _)| it.measured.angle_rad)?
        .column("resolved", |(it, _)| u8::from(it.measured.resolved))?;
    let vehicle = Vehicle(replay::all_of_error(&site.0, &vehicle.0));
    Ok((table.finish(), vehicle, warnings))
}

#[allow(clippy::needless_pass_by_value)] // the shape that `map_err` wants
pub fn replay_error(error: ReplayError) -> PyErr {
    match error {
        ReplayError::Settings(error) => settings_error(error),
        ReplayError::Recording(error) => recording_error(error),
        other => RecordingError::new_err(brief(other)),
    }
}

/// Located drive.
#[pyclass(frozen, module = "access_av._core")]
pub struct LocatedDrive {
    core: replay::LocatedDrive,
}

#[pymethods]
impl LocatedDrive {
    /// Errors of single items of the input.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        let remarks = self.core.remarks.iter();
        remarks.map(|remark| remark.text.clone()).collect()
    }

    /// Constants of the vehicle that the localizer estimated by the end of the drive: columns
    /// `constant`, `constant_unit`, `stated_value`, `found_value` and `found_value_std`; empty if
    /// the localizer estimates none.
    #[getter]
    fn findings(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        let rows: Vec<(&str, &str, EstimatedConstant)> =
            self.core.constants.map_or_else(Vec::new, |it| {
                vec![
                    ("odometer.scale", "1", it.odometer_scale),
                    ("gyroscope.scale", "1", it.yaw_rate_scale),
                    ("gyroscope.bias_radps", "rad/s", it.yaw_rate_bias_radps),
                    ("array.mounting_rad", "rad", it.mounting_rad),
                    ("array.phase_rad", "rad", it.phase_rad),
                    ("receiver.angle_time_offset_s", "s", it.angle_time_offset_s),
                ]
            });
        let table = Table::new(py, rows.iter())
            .list("constant", |(name, ..)| *name)?
            .list("constant_unit", |(_, unit, _)| *unit)?
            .column("stated_value", |(.., it)| it.stated)?
            .column("found_value", |(.., it)| it.found)?
            .column("found_value_std", |(.., it)| it.std)?;
        Ok(table.finish())
    }

    /// Errors of the input as a whole, harmful or not.
    #[getter]
    fn diagnoses(&self) -> Vec<String> {
        let texts = self.core.diagnoses.iter().map(|it| it.text.clone());
        texts.collect()
    }

    /// Fraction of the time in state `lost`; 1 if the vehicle was never located.
    #[getter]
    fn lost_share(&self) -> f64 {
        self.core.lost_share()
    }

    /// Whether the vehicle was lost for more than a fifth of the time, lost at the end, or never
    /// located.
    #[getter]
    fn is_lost_for_long(&self) -> bool {
        self.core.is_lost_for_long()
    }

    /// Diagnoses that affected the result.
    #[getter]
    fn suspicions(&self) -> Vec<String> {
        let texts = self.core.suspicions().map(|it| it.text.clone());
        texts.collect()
    }

    /// Poses, one per odometry sample. Columns: `time_s`, `x_m`, `y_m`, `heading_rad`, `speed_mps`,
    /// `covariance_xx_m2`, `covariance_xy_m2`, `covariance_yy_m2`, `covariance_heading_rad2`,
    /// `protection_level_m`, `protection_level_along_m` and `protection_level_across_m` (NaN if
    /// unknown), `integrity` (`ok`, `degraded`, `unavailable` or None), `selected_hypothesis` (its
    /// name, or None if the vehicle is not monitored) and `searching` (whether the
    /// first pose is still unknown, so that the pose is the mean of the possible positions).
    #[getter]
    fn poses(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        pose_columns(py, &self.core.poses)
    }

    /// Smoothed poses with the columns of `poses`; empty unless requested.
    #[getter]
    fn smoothed(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        pose_columns(py, &self.core.smoothed)
    }

    /// Angles, one row each: columns `time_s`, `pci`, `ssb_index`, `snr_db`, `phase_rad`,
    /// `phase_sigma_rad`, `angle_rad`, `accepted`, `reason`, `mahalanobis_squared`, `threshold`.
    #[getter]
    fn angles(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        let table = Table::new(py, self.core.aoa_estimates.iter())
            .column("time_s", |it| it.ssb.time_s)?
            .column("pci", |it| it.ssb.pci)?
            .column("ssb_index", |it| it.ssb.ssb_index)?
            .column("snr_db", |it| it.ssb.snr_db)?
            .column("phase_rad", |it| measured(it, |angle| angle.phase_rad))?
            .column("phase_sigma_rad", |it| {
                measured(it, |angle| angle.phase_sigma_rad)
            })?
            .column("angle_rad", |it| measured(it, |angle| angle.angle_rad))?;
        Ok(with_verdicts(table, |it| it.verdict)?.finish())
    }

    /// Ranges, one row each: columns `time_s`, `pci`, `ssb_index`, `range_m`, `range_sigma_m` (NaN
    /// if that of the vehicle applies), `accepted`, `reason`, `mahalanobis_squared`, `threshold`.
    #[getter]
    fn ranges(&self, py: Python<'_>) -> PyResult<Py<PyDict>> {
        let is_range = |it: &&replay::LocatedRange| {
            it.range.measured.quantity == onboard::range::RangeQuantity::Range
        };
        let table = Table::new(py, self.core.ranges.iter().filter(is_range))
            .column("time_s", |it| it.range.measured.time_s)?
            .column("pci", |it| it.range.pci)?
            .column("ssb_index", |it| it.range.ssb_index)?
            .column("range_m", |it| it.range.measured.value)?
            .column("range_sigma_m", |it| {
                it.range.measured.sigma.unwrap_or(f64::NAN)
            })?;
        Ok(with_verdicts(table, |it| it.verdict)?.finish())
    }

    /// Write poses, verdicts and diagnostics to an MCAP file (ROS 2).
    #[allow(clippy::needless_pass_by_value)] // what extraction yields
    fn write_mcap(&self, path: PathBuf) -> PyResult<()> {
        write_drive_mcap(&path, &self.core).map_err(recording_error)
    }

    /// Write the poses from the first known one as a TUM trajectory.
    #[allow(clippy::needless_pass_by_value)] // what extraction yields
    fn write_tum(&self, path: PathBuf) -> PyResult<()> {
        write_poses(&path, &self.core.poses)
    }

    /// Write the smoothed poses as a TUM trajectory.
    #[allow(clippy::needless_pass_by_value)] // what extraction yields
    fn write_smoothed_tum(&self, path: PathBuf) -> PyResult<()> {
        write_poses(&path, &self.core.smoothed)
    }
}

fn write_poses(path: &Path, poses: &[replay::LocatedPose]) -> PyResult<()> {
    let known = poses.iter().filter(|it| it.searching.is_none());
    let timed = known.map(|it| TimedPose {
        time_s: it.estimate.time_s,
        pose: it.estimate.pose,
    });
    write_tum(path, &timed.collect::<Vec<_>>()).map_err(recording_error)
}

/// Adds the verdicts of the localizer to a table of measurements.
fn with_verdicts<R: Iterator + Clone>(
    table: Table<'_, R>,
    verdict: impl Fn(R::Item) -> UpdateResult,
) -> PyResult<Table<'_, R>> {
    let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
    table
        .column("accepted", |it| verdict(it).accepted)?
        .list("reason", |it| verdict(it).reason.name())?
        .column("mahalanobis_squared", |it| {
            or_nan(verdict(it).mahalanobis_squared)
        })?
        .column("threshold", |it| or_nan(verdict(it).threshold))
}

fn pose_columns(py: Python<'_>, poses: &[replay::LocatedPose]) -> PyResult<Py<PyDict>> {
    let covariance =
        |it: &replay::LocatedPose, row, column| covariance(it.estimate.covariance, row, column);
    let level = |it: &replay::LocatedPose, which| level(it.estimate.integrity, which);
    let table = Table::new(py, poses.iter())
        .column("time_s", |it| it.estimate.time_s)?
        .column("x_m", |it| it.estimate.pose.x_m)?
        .column("y_m", |it| it.estimate.pose.y_m)?
        .column("heading_rad", |it| it.estimate.pose.heading_rad)?
        .column("speed_mps", |it| it.speed_mps)?
        .column("covariance_xx_m2", |it| covariance(it, 0, 0))?
        .column("covariance_xy_m2", |it| covariance(it, 0, 1))?
        .column("covariance_yy_m2", |it| covariance(it, 1, 1))?
        .column("covariance_heading_rad2", |it| covariance(it, 2, 2))?
        .column("protection_level_m", |it| {
            level(it, |of| of.protection_level_m)
        })?
        .column("protection_level_along_m", |it| {
            level(it, |of| of.protection_level_along_m)
        })?
        .column("protection_level_across_m", |it| {
            level(it, |of| of.protection_level_across_m)
        })?
        .list("integrity", |it| Some(it.estimate.integrity?.state.name()))?
        .list("selected_hypothesis", |it| {
            Some(it.estimate.integrity?.hypothesis.name())
        })?
        .column("searching", |it| it.searching.is_some())?
        .column("lost", |it| it.is_lost)?;
    Ok(table.finish())
}
