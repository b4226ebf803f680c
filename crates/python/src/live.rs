//! The pipeline on a vehicle, which processes inputs as they arrive.

use std::sync::{Mutex, MutexGuard, PoisonError};

use onboard::Custom;
use onboard::geometry::Pose;
use onboard::live::{
    AngleObservation, AngleRecord as CoreAngleRecord, Continuity, HeadStatus as CoreHead,
    Live as Core, LiveError, RangeObservation, RangeValue, Status as CoreStatus, StreamConfig,
};
use onboard::localize::{OdometryResult, SelectedHypothesis};
use onboard::observation::{MeasurementKind, OdometrySample};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use recording::load;

use crate::message::brief;
use crate::nr::{complex_samples, rows};
use crate::settings::{Site, Vehicle, settings_error};

#[allow(clippy::needless_pass_by_value)] // the shape that `map_err` wants
fn live_error(error: LiveError) -> PyErr {
    match error {
        LiveError::Settings(error) => settings_error(error),
        other => PyValueError::new_err(brief(other)),
    }
}

/// Status of the vehicle at one time.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct LiveStatus {
    /// Time of the pose in seconds: the requested time, or the latest time for which the odometry
    /// is valid.
    time_s: f64,
    /// Position (x and y in metres) and heading (radians counter-clockwise from +x); during the
    /// search, the mean of the possible positions. `None` before any odometry.
    pose: Option<(f64, f64, f64)>,
    /// Covariance of (x, y, heading), row-major, in m², m·rad and rad².
    covariance: Option<[[f64; 3]; 3]>,
    /// Speed of the odometer in m/s.
    speed_mps: f64,
    /// Yaw rate in rad/s, counter-clockwise; `None` if it is not measured.
    yaw_rate_radps: Option<f64>,
    /// `waiting`, `searching`, `lost`, `unavailable`, `degraded`, `ok` or `unmonitored`.
    state: &'static str,
    /// Whether the pose is a single confirmed position.
    is_localized: bool,
    /// Reason of the state.
    reason: String,
    /// Recommended action.
    what_to_do: &'static str,
    /// Horizontal protection level in metres; `None` without one.
    protection_level_m: Option<f64>,
    /// Hypothesis that explains the measurements best, and whose position is reported: `nominal`,
    /// `radio_heads_excluded`, `wheel_slip`, `uncalibrated_array`, `noisy_odometer`,
    /// `displaced_site`, `biased_radio_heads` or `noisy_angles`; `None` without a monitored pose.
    selected_hypothesis: Option<&'static str>,
    /// Number of radio heads identified as faulty.
    faulty: usize,
    /// Time of the last accepted angle in seconds.
    last_angle_s: Option<f64>,
    /// Age of the newest odometry in seconds.
    odometry_age_s: Option<f64>,
    /// Age of the newest sample in seconds.
    samples_age_s: Option<f64>,
    /// Number of SSBs that the receiver tracks.
    tracked: usize,
    /// Strongest tones that are subtracted from the samples: absolute frequency in Hz, power in dBFS.
    tones: Vec<(f64, f64)>,
    /// Active faults: name, description, and time of detection in seconds.
    faults: Vec<(&'static str, String, f64)>,
}

impl From<CoreStatus> for LiveStatus {
    fn from(status: CoreStatus) -> Self {
        Self {
            time_s: status.time_s,
            pose: status.pose.map(|it| (it.x_m, it.y_m, it.heading_rad)),
            covariance: status.covariance,
            speed_mps: status.speed_mps,
            yaw_rate_radps: status.yaw_rate_radps,
            state: status.state.name(),
            is_localized: status.state.is_localized(),
            reason: status.reason.to_string(),
            what_to_do: status.reason.what_to_do(),
            protection_level_m: status.protection_level_m,
            selected_hypothesis: status.selected_hypothesis.map(SelectedHypothesis::name),
            faulty: status.faulty,
            last_angle_s: status.last_angle_s,
            odometry_age_s: status.odometry_age_s,
            samples_age_s: status.samples_age_s,
            tracked: status.tracked,
            tones: (status.tones.iter().flatten())
                .map(|it| (it.frequency_hz, it.power_dbfs))
                .collect(),
            faults: (status.faults.iter())
                .map(|it| (it.fault.name(), it.fault.to_string(), it.since_s))
                .collect(),
        }
    }
}

/// Result of one angle.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct LiveOutcome {
    /// Reception time in seconds.
    time_s: f64,
    /// Physical cell identity.
    pci: u16,
    /// Index of the SSB in the burst.
    ssb_index: u8,
    /// SNR per antenna and resource element in dB.
    snr_db: f64,
    /// Electrical angle, or azimuth for an array that is not linear, in radians; `None` without an
    /// estimate.
    phase_rad: Option<f64>,
    /// Standard deviation of `phase_rad` in radians.
    phase_sigma_rad: Option<f64>,
    /// Whether the angle was used for the pose.
    accepted: bool,
    /// Reason of acceptance or rejection.
    reason: &'static str,
    /// Measured angle minus the angle expected from the pose after the update, in radians.
    residual_rad: Option<f64>,
    /// Pose after the update: x and y in metres, heading in radians.
    pose: (f64, f64, f64),
}

impl From<CoreAngleRecord> for LiveOutcome {
    fn from(outcome: CoreAngleRecord) -> Self {
        let (ssb, verdict) = (outcome.angle_result.ssb, outcome.angle_result.verdict);
        let (measured, pose) = (outcome.angle_result.measured, outcome.after.pose);
        Self {
            time_s: ssb.time_s,
            pci: ssb.pci,
            ssb_index: ssb.ssb_index,
            snr_db: ssb.snr_db,
            phase_rad: measured.map(|it| it.phase_rad),
            phase_sigma_rad: measured.map(|it| it.phase_sigma_rad),
            accepted: verdict.accepted,
            reason: verdict.reason.name(),
            residual_rad: outcome.residual_rad,
            pose: (pose.x_m, pose.y_m, pose.heading_rad),
        }
    }
}

/// Reception of one radio head.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct LiveHead {
    /// Physical cell identity.
    pci: u16,
    /// Index of the SSB in the burst.
    ssb_index: u8,
    /// Whether the radio head is excluded by `exclude`.
    is_excluded: bool,
    /// Whether the radio head is identified as faulty.
    is_faulty: bool,
    /// SNR of the last SSB in dB.
    snr_db: Option<f64>,
    /// Time of the last SSB with an angle estimate in seconds.
    last_angle_s: Option<f64>,
    /// Time of the last SSB with an accepted angle in seconds.
    last_accepted_s: Option<f64>,
    /// Residual of the last angle in radians.
    residual_rad: Option<f64>,
    /// Number of accepted angles.
    accepted: u64,
    /// Number of rejected angles.
    refused: u64,
}

impl From<&CoreHead> for LiveHead {
    fn from(it: &CoreHead) -> Self {
        Self {
            pci: it.head.pci,
            ssb_index: it.head.ssb_index,
            is_excluded: it.is_excluded,
            is_faulty: it.is_faulty,
            snr_db: it.snr_db,
            last_angle_s: it.last_angle_s,
            last_accepted_s: it.last_accepted_s,
            residual_rad: it.residual_rad,
            accepted: it.accepted,
            refused: it.refused,
        }
    }
}

/// Activity since the start and its energy according to the platform's model.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct LiveEnergy {
    /// Time since the first input in seconds.
    duration_s: f64,
    /// Number of angle estimates.
    aoa_estimates: usize,
    /// Number of bursts received.
    bursts_received: usize,
    /// Time for which the receiver was on for these bursts, in seconds.
    on_time_s: f64,
    /// Energy of angle estimates, receiver and idle board in joules; `None` if the platform has no
    /// figures.
    total_j: Option<f64>,
}

/// Pipeline on a vehicle: accepts samples, angles and odometry as they arrive, and returns a status
/// at any time.
///
/// All times are in seconds of one clock. Rejected input raises an exception and changes nothing.
/// Other threads run while samples are processed.
///
/// Time stamps are compared with earlier ones and, if `arrival_s` is given, with the arrival of the
/// message according to a monotonic clock (`time.monotonic()`). One implausible time stamp is
/// rejected. Five consecutive consistent messages indicate a permanent clock step: the pose is
/// resumed, and `clock_step` returns the step. A given or resumed pose is `unavailable` until five
/// angles to two radio heads have confirmed it.
///
/// Parameters
/// ----------
/// site : Site
///     Radio heads and road.
/// vehicle : Vehicle
///     Array, odometer, localizer, wake-up policy and platform.
/// start : tuple of (x_m, y_m, heading_rad), optional
///     Initial pose [default: the start in the vehicle file, otherwise a search].
/// rate_hz, centre_hz : float, optional
///     Sample rate, and absolute frequency at 0 Hz in the samples; without them, only angles are
///     accepted.
///
/// Raises
/// ------
/// SettingsError
///     Site, vehicle and start are incompatible.
/// ValueError
///     An unsupported rate or frequency.
///
/// Examples
/// --------
/// >>> import access_av
/// >>> site, vehicle = access_av.Site.load("yard"), access_av.Vehicle.load("tugger")
/// >>> live = access_av.Live(site, vehicle, start=(-59.0, 0.0, 0.0))
/// >>> for step in range(50):
/// ...     _ = live.odometry(0.02 * step, 1.5, yaw_rate_radps=0.0)
/// >>> status = live.status(1.0)
/// >>> status.state, status.reason
/// ('unavailable', 'angles have not confirmed the given or resumed pose yet')
/// >>> round(status.pose[0], 1)
/// -57.5
#[pyclass(frozen, module = "access_av._core")]
pub struct Live(Mutex<Core>);

impl Live {
    fn core(&self) -> MutexGuard<'_, Core> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls the pipeline without the interpreter lock.
    fn call<T: Send>(
        &self,
        py: Python<'_>,
        call: impl FnOnce(&mut Core) -> Result<T, LiveError> + Send,
    ) -> PyResult<T> {
        py.detach(|| call(&mut self.core())).map_err(live_error)
    }

    /// Passes an input with its arrival time to the pipeline.
    fn take<T: Send>(
        &self,
        py: Python<'_>,
        arrival_s: Option<f64>,
        take: impl FnOnce(&mut Core) -> Result<T, LiveError> + Send,
    ) -> PyResult<T> {
        if let Some(value) = arrival_s.filter(|it| !it.is_finite()) {
            return Err(PyValueError::new_err(format!(
                "arrival_s is {value}; it must be a finite number"
            )));
        }
        self.call(py, |core| {
            core.set_arrival(arrival_s);
            take(core)
        })
    }
}

#[pymethods]
impl Live {
    #[new]
    #[pyo3(signature = (site, vehicle, *, start = None, rate_hz = None, centre_hz = None))]
    fn new(
        site: &Site,
        vehicle: &Vehicle,
        start: Option<(f64, f64, f64)>,
        rate_hz: Option<f64>,
        centre_hz: Option<f64>,
    ) -> PyResult<Self> {
        let stream = match (rate_hz, centre_hz) {
            (Some(rate_hz), Some(centre_hz)) => Some(StreamConfig { rate_hz, centre_hz }),
            (None, None) => None,
            _ => {
                let text = "rate_hz and centre_hz must be given together or both be omitted";
                return Err(PyValueError::new_err(text));
            }
        };
        let platform = load(&vehicle.0.platform.name).map_err(settings_error)?;
        let start = start.map(pose);
        let live = Core::new(
            &site.0,
            &vehicle.0,
            &platform,
            start,
            stream,
            Custom::default(),
        );
        Ok(Self(Mutex::new(live.map_err(live_error)?)))
    }

    /// Process the next samples, in blocks of any length.
    ///
    /// Parameters
    /// ----------
    /// time_s : float
    ///     Reception time of the first sample according to the sample clock: a sample counter or
    ///     the radio's time. It reveals missing or repeated samples and a restarted stream.
    /// samples : ndarray
    ///     Complex samples, `(antennas, samples)`.
    /// arrival_s : float, optional
    ///     Arrival time of the samples according to a monotonic clock, in seconds.
    ///
    /// Returns
    /// -------
    /// str
    ///     Relation to the previous samples: `first`, `contiguous`, `gap`, `overlap` or `restart`.
    #[pyo3(signature = (time_s, samples, *, arrival_s = None))]
    fn samples(
        &self,
        py: Python<'_>,
        time_s: f64,
        samples: &Bound<'_, PyAny>,
        arrival_s: Option<f64>,
    ) -> PyResult<&'static str> {
        let samples = complex_samples(samples)?;
        let antennas = rows(&samples)?;
        let taken = self.take(py, arrival_s, |core| core.samples(time_s, &antennas))?;
        Ok(match taken {
            Continuity::First => "first",
            Continuity::Contiguous => "contiguous",
            Continuity::Gap { .. } => "gap",
            Continuity::Overlap => "overlap",
            Continuity::Restart => "restart",
        })
    }

    /// Process an odometry sample; the speed is sufficient.
    ///
    /// Parameters
    /// ----------
    /// time_s : float
    ///     Time of the measurement in seconds.
    /// speed_mps : float
    ///     Speed in m/s, negative backwards.
    /// distance_m : float, optional
    ///     Distance counter in metres.
    /// yaw_rate_radps : float, optional
    ///     Yaw rate in rad/s, counter-clockwise.
    /// arrival_s : float, optional
    ///     Arrival time of the sample according to a monotonic clock, in seconds.
    ///
    /// Returns
    /// -------
    /// bool
    ///     Whether all values were used. A distance that jumps and an implausible yaw rate are
    ///     ignored.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     An implausible time, or a value that is not finite.
    #[pyo3(signature = (time_s, speed_mps, *, distance_m = None, yaw_rate_radps = None, arrival_s = None))]
    fn odometry(
        &self,
        py: Python<'_>,
        time_s: f64,
        speed_mps: f64,
        distance_m: Option<f64>,
        yaw_rate_radps: Option<f64>,
        arrival_s: Option<f64>,
    ) -> PyResult<bool> {
        if distance_m.is_some_and(|it| !it.is_finite()) {
            return Err(PyValueError::new_err("distance_m is not a finite number"));
        }
        let sample = OdometrySample {
            distance_m: distance_m.unwrap_or(f64::NAN),
            ..OdometrySample::of_speed(time_s, speed_mps, yaw_rate_radps)
        };
        let verdict = self.take(py, arrival_s, |core| core.odometry(&sample))?;
        Ok(!matches!(
            verdict,
            OdometryResult::DistanceJump { .. } | OdometryResult::YawRateRefused { .. }
        ))
    }

    /// Add an angle that was estimated elsewhere. The angles of a burst are processed together as
    /// soon as odometry, a later angle or `flush` shows that the burst is complete.
    ///
    /// Parameters
    /// ----------
    /// pci : int
    ///     Physical cell identity.
    /// time_s : float
    ///     Reception time in seconds.
    /// phase_rad, sigma_rad : float
    ///     Electrical angle ω = 2π(d/λ)·cos θ of a linear array, or azimuth of any other array, and
    ///     its standard deviation, in radians.
    /// ssb_index : int
    ///     Index of the SSB in its burst.
    /// snr_db : float, optional
    ///     SNR per antenna in dB.
    /// resolved : bool
    ///     Whether the estimator reports the angle as resolved.
    /// at_head : bool
    ///     Whether the array of the radio head measured the angle: `phase_rad` is the azimuth of the
    ///     vehicle in the frame of that array (`radio_heads.array` of the site).
    /// arrival_s : float, optional
    ///     Arrival time of the angle according to a monotonic clock, in seconds.
    #[pyo3(signature = (pci, time_s, phase_rad, sigma_rad, *, ssb_index = 0, snr_db = None, resolved = true, at_head = false, arrival_s = None))]
    #[allow(clippy::too_many_arguments)] // Python's keywords
    fn angle(
        &self,
        py: Python<'_>,
        pci: u16,
        time_s: f64,
        phase_rad: f64,
        sigma_rad: f64,
        ssb_index: u8,
        snr_db: Option<f64>,
        resolved: bool,
        at_head: bool,
        arrival_s: Option<f64>,
    ) -> PyResult<()> {
        let angle = AngleObservation {
            kind: MeasurementKind::of_angle(at_head),
            pci,
            ssb_index,
            time_s,
            phase_rad,
            sigma_rad,
            snr_db,
            resolved,
        };
        self.take(py, arrival_s, |core| core.angle(&angle))
    }

    /// Add a two-way range or one-way delay to a radio head that was measured elsewhere. The vehicle
    /// needs `[ranging]`. Returns the verdict of the localizer.
    ///
    /// Parameters
    /// ----------
    /// pci : int
    ///     Physical cell identity of the radio head.
    /// time_s : float
    ///     Time in seconds.
    /// range_m : float, optional
    ///     Two-way range in metres, or
    /// delay_ns : float, optional
    ///     one-way delay by the clocks of vehicle and radio head, in nanoseconds.
    /// sigma : float, optional
    ///     Standard deviation in the unit of the value; by default `ranging.sigma_m` of the vehicle.
    /// ssb_index : int
    ///     Index of the SSB in its burst.
    /// arrival_s : float, optional
    ///     Arrival time of the range according to a monotonic clock, in seconds.
    #[pyo3(signature = (pci, time_s, *, range_m = None, delay_ns = None, sigma = None, ssb_index = 0, arrival_s = None))]
    #[allow(clippy::too_many_arguments)] // Python's keywords
    fn range(
        &self,
        py: Python<'_>,
        pci: u16,
        time_s: f64,
        range_m: Option<f64>,
        delay_ns: Option<f64>,
        sigma: Option<f64>,
        ssb_index: u8,
        arrival_s: Option<f64>,
    ) -> PyResult<&'static str> {
        let value = match (range_m, delay_ns) {
            (Some(range_m), None) => RangeValue::RangeM(range_m),
            (None, Some(delay_ns)) => RangeValue::DelayNs(delay_ns),
            _ => {
                let text = "range: give either range_m or delay_ns";
                return Err(PyValueError::new_err(text));
            }
        };
        let range = RangeObservation {
            pci,
            ssb_index,
            time_s,
            value,
            sigma,
        };
        let verdict = self.take(py, arrival_s, |core| core.range(&range))?;
        Ok(verdict.reason.name())
    }

    /// Return the clock step of the odometry in seconds that was detected since the last call; the
    /// pose was resumed.
    fn clock_step(&self) -> Option<f64> {
        self.core().take_odometry_step().map(|it| it.step_s)
    }

    /// Return the time of angles minus that of odometry in seconds if their clocks differ; the
    /// state is then `unavailable`.
    fn clock_disagreement_s(&self) -> Option<f64> {
        self.core().clock_disagreement_s()
    }

    /// Process the received part of a burst without waiting for the rest.
    fn flush(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, Core::flush)
    }

    /// Return the results of the angles since the last call, oldest first, at most 256.
    fn outcomes(&self) -> Vec<LiveOutcome> {
        let mut core = self.core();
        let next = std::iter::from_fn(|| core.next_angle_record());
        next.map(LiveOutcome::from).collect()
    }

    /// Set the pose at a time near the newest odometry, with the covariance of (x, y, heading)
    /// [default: the start covariance of the vehicle file]. Estimated constants are reset.
    #[pyo3(signature = (time_s, pose, covariance = None))]
    fn set_pose(
        &self,
        py: Python<'_>,
        time_s: f64,
        pose: (f64, f64, f64),
        covariance: Option<[[f64; 3]; 3]>,
    ) -> PyResult<()> {
        let pose = self::pose(pose);
        self.call(py, |core| core.set_pose(time_s, pose, covariance))
    }

    /// Reset pose, odometry and estimated constants, and search for the pose. Earlier times are
    /// allowed afterwards.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, Core::reset)
    }

    /// Exclude a cell.
    fn exclude(&self, pci: u16) -> PyResult<()> {
        self.core().exclude(pci).map_err(live_error)
    }

    /// Include an excluded cell again.
    fn readmit(&self, pci: u16) -> PyResult<()> {
        self.core().readmit(pci).map_err(live_error)
    }

    /// Return the status at a time.
    fn status(&self, py: Python<'_>, now_s: f64) -> PyResult<LiveStatus> {
        self.call(py, |core| core.status(now_s))
            .map(LiveStatus::from)
    }

    /// Return the reception of each radio head that the vehicle uses.
    fn heads(&self) -> Vec<LiveHead> {
        self.core().heads().iter().map(LiveHead::from).collect()
    }

    /// Whether the burst at a time is required according to the current state.
    fn listens(&self, py: Python<'_>, time_s: f64) -> PyResult<bool> {
        self.call(py, |core| core.listens(time_s))
    }

    /// Return the time at which the receiver must be on next. This is the next required burst, or
    /// `now_s` while no SSB is tracked or the pose is searched for. If no burst is required within
    /// a second, it is the time of the next query.
    fn next_wake_up_s(&self, py: Python<'_>, now_s: f64) -> PyResult<f64> {
        self.call(py, |core| core.next_wake_up_s(now_s))
    }

    /// Return the activity since the start or the last reset, and its energy.
    fn energy(&self) -> LiveEnergy {
        let energy = self.core().energy();
        LiveEnergy {
            duration_s: energy.duration_s,
            aoa_estimates: energy.aoa_estimates,
            bursts_received: energy.bursts_received,
            on_time_s: energy.on_time_s,
            total_j: energy.energy.map(|it| it.total_j()),
        }
    }
}

const fn pose((x_m, y_m, heading_rad): (f64, f64, f64)) -> Pose {
    Pose {
        x_m,
        y_m,
        heading_rad,
    }
}
