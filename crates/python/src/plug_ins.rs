//! Python objects that replace parts of the pipeline, with validation of their results.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{PyArray2, PyReadonlyArray1};
use onboard::BoxError;
use onboard::energy::EstimateCost;
use onboard::estimator::{AngleEstimator, EstimatedAngle};
use onboard::geometry::Pose;
use onboard::localize::OdometryResult;
use onboard::localize::{AngleMeasurement, Localizer, PoseEstimate, UpdateReason, UpdateResult};
use onboard::manifold::Measurand;
use onboard::observation::{OdometrySample, SsbDetection as CoreSensed, SsbObservation};
use onboard::radio_head::RadioHead as CoreHead;
use onboard::wake_up::{Situation as CoreSituation, WakeUpPolicy};
use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use simulate::scenario::Scenario;

use crate::message::brief;

/// Radio head at its nominal position.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct RadioHead {
    /// Physical cell identity.
    pci: u16,
    /// Index of the SSB in the burst.
    ssb_index: u8,
    /// Position x in the map frame in metres.
    x_m: f64,
    /// Position y in the map frame in metres.
    y_m: f64,
    /// Height in metres above the reference of the array's height.
    z_m: f64,
}

impl From<&CoreHead> for RadioHead {
    fn from(head: &CoreHead) -> Self {
        Self {
            pci: head.pci,
            ssb_index: head.ssb_index,
            x_m: head.position.x_m,
            y_m: head.position.y_m,
            z_m: head.height_m,
        }
    }
}

/// Detected SSB whose angle is not yet estimated.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct SsbDetection {
    /// Physical cell identity.
    pci: u16,
    /// Index of the SSB in the burst.
    ssb_index: u8,
    /// Measured SNR in dB.
    snr_db: f64,
    /// SNR according to the link budget at the estimated position in dB; `None` if no radio head of
    /// the site sends this SSB.
    expected_snr_db: Option<f64>,
}

/// Inputs of a wake-up policy.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct Situation {
    /// Time of the burst in seconds.
    time_s: f64,
    /// Speed of the odometer in m/s.
    speed_mps: f64,
    /// Estimated position x in metres.
    x_m: f64,
    /// Estimated position y in metres.
    y_m: f64,
    /// Estimated heading in radians, counter-clockwise from +x.
    heading_rad: f64,
    /// Covariance of (x, y, heading); `None` if the localizer has none.
    covariance: Option<[[f64; 3]; 3]>,
    /// Radio heads of the site.
    heads: Vec<Py<RadioHead>>,
    /// Detected SSBs of the burst; empty while the receiver is off.
    sensed: Vec<Py<SsbDetection>>,
}

impl Situation {
    fn new(py: Python<'_>, now: &CoreSituation<'_>, sensed: &[CoreSensed]) -> PyResult<Self> {
        let failed = |error: BoxError| PyErr::from(PlugInError(error));
        let estimate = now.localizer.pose(now.time_s).map_err(failed)?;
        let sensed = sensed.iter().map(|ssb| {
            let expected = now.head(ssb).map(|head| now.expected_snr_db(head));
            let detection = SsbDetection {
                pci: ssb.pci,
                ssb_index: ssb.ssb_index,
                snr_db: ssb.snr_db,
                expected_snr_db: expected.transpose().map_err(failed)?,
            };
            Py::new(py, detection)
        });
        let heads = now
            .heads
            .iter()
            .map(|head| Py::new(py, RadioHead::from(head)));
        Ok(Self {
            time_s: now.time_s,
            speed_mps: now.speed_mps,
            x_m: estimate.pose.x_m,
            y_m: estimate.pose.y_m,
            heading_rad: estimate.pose.heading_rad,
            covariance: estimate.covariance,
            heads: heads.collect::<PyResult<_>>()?,
            sensed: sensed.collect::<PyResult<_>>()?,
        })
    }
}

/// Error that is passed through the core unchanged.
struct PlugInError(BoxError);

impl From<PlugInError> for PyErr {
    fn from(error: PlugInError) -> Self {
        match error.0.downcast::<Self>() {
            Ok(raised) => *raised,
            Err(other) => PyValueError::new_err(brief(other)),
        }
    }
}

/// Attribute of an estimator with the energy of one estimate above idle in joules.
const ENERGY: &str = "energy_per_execution_j";
/// Attribute of an estimator with the time of one estimate on one busy core in seconds.
const TIME: &str = "time_per_execution_s";

/// Python callable that replaces the angle estimator of one run.
pub struct PythonEstimator {
    call: Py<PyAny>,
    measurand: Measurand,
    sigma_warned: Arc<AtomicBool>,
}

impl PythonEstimator {
    /// Creates the estimator for an array with the given measurand; `sigma_warned` is shared by
    /// all runs.
    pub const fn new(call: Py<PyAny>, measurand: Measurand, sigma_warned: Arc<AtomicBool>) -> Self {
        Self {
            call,
            measurand,
            sigma_warned,
        }
    }

    fn angle(
        &self,
        py: Python<'_>,
        angle_rad: f64,
        sigma_rad: Option<f64>,
    ) -> PyResult<EstimatedAngle> {
        let (least, named) = match self.measurand {
            Measurand::ElectricalAngle { .. } => (0.0, "0"),
            Measurand::Azimuth { .. } => (-PI, "-pi"),
        };
        if !(least..=PI).contains(&angle_rad) {
            return Err(refused(&format!(
                "estimator returned an angle of {angle_rad} rad; it must be between {named} and pi"
            )));
        }
        match sigma_rad {
            Some(sigma_rad) if !(sigma_rad > 0.0 && sigma_rad <= PI) => {
                return Err(refused(&format!(
                    "estimator returned a standard deviation of {sigma_rad} rad; it must be above 0 \
                     and at most pi"
                )));
            }
            None if !self.sigma_warned.swap(true, Ordering::Relaxed) => PyErr::warn(
                py,
                &py.get_type::<PyUserWarning>(),
                c"the estimator returns no standard deviation; the Cramer-Rao bound at each SSB's \
                  SNR is used",
                1,
            )?,
            _ => {}
        }
        let spread = |sigma: f64| match self.measurand {
            Measurand::ElectricalAngle {
                spacing_wavelengths,
                ..
            } => {
                // Second-order expansion, which is finite at end-fire.
                let sin = angle_rad.sin();
                TAU * spacing_wavelengths * (sin * sigma + 0.5 * sigma * sigma)
            }
            Measurand::Azimuth { .. } => sigma,
        };
        Ok(EstimatedAngle::Angle {
            phase_rad: self.measurand.value_rad(angle_rad, 1.0),
            phase_sigma_rad: sigma_rad.map(spread),
            snr_db: None,
            resolved: true,
        })
    }

    fn understand(&self, found: &Bound<'_, PyAny>) -> PyResult<Option<EstimatedAngle>> {
        let py = found.py();
        if found.is_none() {
            return Ok(None);
        }
        if let Ok(angle_rad) = found.extract::<f64>() {
            return self.angle(py, angle_rad, None).map(Some);
        }
        if let Ok((angle_rad, sigma_rad)) = found.extract::<(f64, f64)>() {
            return self.angle(py, angle_rad, Some(sigma_rad)).map(Some);
        }
        if let Ok(log) = found.extract::<PyReadonlyArray1<'_, f64>>() {
            let log = log.as_array().to_vec();
            if log.len() < 8 || !log.iter().any(|value| value.is_finite()) {
                return Err(refused(
                    "estimator returned a log-likelihood without a finite value, or of fewer than \
                     8 electrical angles",
                ));
            }
            if log
                .iter()
                .any(|value| value.is_nan() || *value == f64::INFINITY)
            {
                return Err(refused(
                    "estimator returned a log-likelihood that is not a number",
                ));
            }
            return Ok(Some(EstimatedAngle::LogLikelihood(log)));
        }
        Err(refused(&format!(
            "estimator returned a {}; allowed are an angle in radians, (angle, standard deviation), \
             a float64 array of the log-likelihood over the electrical angle, and None",
            found.get_type().name()?
        )))
    }
}

/// Returns the energy or the time of one estimate from the estimator's attributes.
pub fn estimate_cost(estimator: &Bound<'_, PyAny>) -> PyResult<EstimateCost> {
    let stated = |name: &str| -> PyResult<Option<f64>> {
        let Some(value) = estimator.getattr_opt(name)?.filter(|it| !it.is_none()) else {
            return Ok(None);
        };
        match value.extract::<f64>() {
            Ok(number) if number.is_finite() && number >= 0.0 => Ok(Some(number)),
            _ => Err(refused(&format!(
                "the estimator's {name} is {}; it must be a finite number, 0 or above",
                value.repr()?
            ))),
        }
    };
    match (stated(ENERGY)?, stated(TIME)?) {
        (Some(_), Some(_)) => Err(refused(&format!(
            "the estimator has both {ENERGY} and {TIME}; only one of them is allowed"
        ))),
        (Some(energy_j), None) => Ok(EstimateCost::EnergyJ(energy_j)),
        (None, Some(time_s)) => Ok(EstimateCost::TimeS(time_s)),
        (None, None) => Ok(EstimateCost::Unknown),
    }
}

fn refused(message: &str) -> PyErr {
    PyValueError::new_err(brief(message))
}

/// Adds the SSB at which a custom component failed to the exception, and keeps its type.
fn at(py: Python<'_>, error: PyErr, what: &str) -> PyErr {
    // A note does not change the exception (Python 3.11 and later).
    let _ = error.value(py).call_method1("add_note", (what,));
    error
}

impl AngleEstimator for PythonEstimator {
    fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<EstimatedAngle>, BoxError> {
        let estimated = Python::attach(|py| {
            let elements = observation.elements();
            let values = observation.values();
            let rows: Vec<Vec<_>> = (0..elements)
                .map(|antenna| {
                    values
                        .iter()
                        .skip(antenna)
                        .step_by(elements)
                        .copied()
                        .collect()
                })
                .collect();
            let estimated = PyArray2::from_vec2(py, &rows)
                .map_err(PyErr::from)
                .and_then(|snapshots| self.call.bind(py).call1((snapshots,)))
                .and_then(|found| self.understand(&found));
            let ssb = &observation.ssb;
            let what = || {
                let (pci, index, time_s) = (ssb.pci, ssb.ssb_index, ssb.time_s);
                format!("in the estimator, for the SSB of pci {pci}, index {index}, at {time_s} s")
            };
            estimated.map_err(|error| at(py, error, &what()))
        });
        Ok(estimated?)
    }
}

/// Python callable that replaces the wake-up policy of one run.
pub struct PythonPolicy(Py<PyAny>);

impl PythonPolicy {
    /// Creates the policy from `call`, with its method `listens` if it has one.
    pub const fn new(call: Py<PyAny>) -> Self {
        Self(call)
    }
}

impl WakeUpPolicy for PythonPolicy {
    fn listens(&mut self, now: &CoreSituation<'_>) -> Result<bool, BoxError> {
        let listens = Python::attach(|py| {
            let policy = self.0.bind(py);
            if !policy.hasattr("listens")? {
                return Ok(true);
            }
            let what = format!("in policy.listens, at {} s", now.time_s);
            let situation = Situation::new(py, now, &[])?;
            let found = policy
                .call_method1("listens", (situation,))
                .map_err(|error| at(py, error, &what))?;
            let listens = found.extract::<bool>();
            listens.map_err(|_| {
                let message = "policy.listens returned a value other than True or False";
                at(py, refused(message), &what)
            })
        });
        Ok(listens?)
    }

    fn decide(
        &mut self,
        now: &CoreSituation<'_>,
        sensed: &[CoreSensed],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        let wake_up_time_s = Python::attach(|py| -> PyResult<f64> {
            let what = format!("in the policy, at {} s", now.time_s);
            let policy = self.0.bind(py);
            let situation = Situation::new(py, now, sensed)?;
            let found = policy
                .call1((situation,))
                .map_err(|error| at(py, error, &what))?;
            if let Ok(all) = found.extract::<bool>() {
                chosen.fill(all);
            } else if let Ok(each) = found.extract::<Vec<bool>>()
                && each.len() == chosen.len()
            {
                chosen.copy_from_slice(&each);
            } else {
                let message = format!(
                    "policy returned {}; it must be True, False, or a list of them, one for each \
                     of the {} sensed SSBs",
                    found.repr()?,
                    sensed.len()
                );
                return Err(at(py, refused(&message), &what));
            }
            let stated = policy.getattr_opt("wake_up_time_s")?;
            let Some(stated) = stated else {
                return Ok(f64::NAN);
            };
            match stated.extract::<f64>() {
                Ok(time_s) if time_s >= 0.0 && time_s.is_finite() => Ok(time_s),
                _ => {
                    let message = format!(
                        "policy.wake_up_time_s is {}; it must be a finite number of seconds, not \
                         below 0",
                        stated.repr()?
                    );
                    Err(at(py, refused(&message), &what))
                }
            }
        });
        Ok(wake_up_time_s?)
    }
}

/// Python object that replaces the localizer of one run.
pub struct PythonLocalizer(Py<PyAny>);

impl PythonLocalizer {
    /// Creates the localizer from an object that a factory created for one run.
    pub const fn new(object: Py<PyAny>) -> Self {
        Self(object)
    }
}

/// Calls a factory of a custom component for one run: `factory(site, vehicle, start)`. Site and
/// vehicle are dictionaries, and the start is the pose that the vehicle knows (x and y in metres,
/// heading in radians).
///
/// # Errors
/// Exception that the factory raises.
pub fn made_for_run(
    factory: &Bound<'_, PyAny>,
    scenario: &Scenario,
    start: Pose,
) -> PyResult<Py<PyAny>> {
    use onboard::settings::TomlFile;
    let loads = factory.py().import("json")?.getattr("loads")?;
    let site = loads.call1((scenario.site.to_json(),))?;
    let vehicle = loads.call1((scenario.vehicle.to_json(),))?;
    let start = (start.x_m, start.y_m, start.heading_rad);
    Ok(factory.call1((site, vehicle, start))?.unbind())
}

impl Localizer for PythonLocalizer {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryResult, BoxError> {
        let arguments = (
            sample.time_s,
            sample.distance_m,
            sample.speed_mps,
            sample.yaw_rate_radps,
        );
        Python::attach(|py| {
            let what = format!("in localizer.odometry, at {} s", sample.time_s);
            let called = self.0.bind(py).call_method1("odometry", arguments);
            called.map(drop).map_err(|error| at(py, error, &what))
        })?;
        Ok(OdometryResult::Accepted)
    }

    fn update(
        &mut self,
        head: &CoreHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        // The method `angle` is defined for angles at the vehicle.
        if measured.kind.is_at_head() {
            return Ok(UpdateResult::unused(UpdateReason::Unusable));
        }
        let accepted = Python::attach(|py| {
            let what = format!("in localizer.angle, at {} s", measured.time_s);
            let arguments = (
                measured.time_s,
                RadioHead::from(head),
                measured.phase_rad,
                measured.phase_sigma_rad,
            );
            let verdict = self.0.bind(py).call_method1("angle", arguments);
            let verdict = verdict.map_err(|error| at(py, error, &what))?;
            if verdict.is_none() {
                return Ok(true);
            }
            let accepted = verdict.extract::<bool>();
            accepted.map_err(|_| {
                let message = "localizer.angle returned a value other than True, False or None";
                at(py, refused(message), &what)
            })
        })?;
        let reason = if accepted {
            UpdateReason::Consistent
        } else {
            UpdateReason::Outlier
        };
        Ok(UpdateResult {
            accepted,
            ..UpdateResult::unused(reason)
        })
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        let estimate = Python::attach(|py| {
            let what = format!("in localizer.pose, at {time_s} s");
            let found = self.0.bind(py).call_method1("pose", (time_s,));
            found
                .and_then(|found| pose_estimate(&found, time_s))
                .map_err(|error| at(py, error, &what))
        });
        Ok(estimate?)
    }

    /// Copies the object by `copy.deepcopy`. An object that cannot be copied gets no late angles.
    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        let copy = Python::attach(|py| {
            let deepcopy = py.import("copy")?.getattr("deepcopy")?;
            Ok::<_, PyErr>(deepcopy.call1((&self.0,))?.unbind())
        });
        copy.map(|copy| *slot = Some(Box::new(Self(copy)))).is_ok()
    }
}

/// Whether a matrix is finite, symmetric and positive semidefinite, up to rounding.
fn is_covariance(matrix: &[[f64; 3]; 3]) -> bool {
    const ROUNDING: f64 = 1e-9;
    let [[xx, xy, xh], [yx, yy, yh], [hx, hy, hh]] = *matrix;
    if !matrix.iter().flatten().all(|value| value.is_finite()) || xx < 0.0 || yy < 0.0 || hh < 0.0 {
        return false;
    }
    let correlation = |upper: f64, lower: f64, a: f64, b: f64| {
        let most = a.sqrt() * b.sqrt();
        let symmetric = (upper - lower).abs() <= ROUNDING * most;
        let of_one = if most > 0.0 { upper / most } else { upper };
        (symmetric && (most > 0.0 || upper == 0.0)).then_some(of_one)
    };
    let found = [
        correlation(xy, yx, xx, yy),
        correlation(xh, hx, xx, hh),
        correlation(yh, hy, yy, hh),
    ];
    let [Some(a), Some(b), Some(c)] = found else {
        return false;
    };
    // Principal minors of the correlation matrix.
    let whole = 1.0 + 2.0 * a * b * c - a * a - b * b - c * c;
    [a, b, c].iter().all(|it| it.abs() <= 1.0 + ROUNDING) && whole >= -ROUNDING
}

fn pose_estimate(found: &Bound<'_, PyAny>, time_s: f64) -> PyResult<PoseEstimate> {
    let shape = || {
        refused(
            "localizer.pose returned a value other than (x_m, y_m, heading_rad) or (x_m, y_m, \
             heading_rad, covariance), with the 3 by 3 covariance of the three",
        )
    };
    let found = found.cast::<PyTuple>().map_err(|_| shape())?;
    let number = |index: usize| -> PyResult<f64> {
        let value = found.get_item(index).map_err(|_| shape())?;
        value.extract().map_err(|_| shape())
    };
    let [x_m, y_m, heading_rad] = [number(0)?, number(1)?, number(2)?];
    if ![x_m, y_m, heading_rad]
        .iter()
        .all(|value| value.is_finite())
    {
        return Err(refused(
            "localizer.pose returned a value that is not finite",
        ));
    }
    let covariance = match found.len() {
        3 => None,
        4 => {
            let rows = found.get_item(3)?;
            let rows = rows.call_method0("tolist").unwrap_or(rows);
            let matrix: [[f64; 3]; 3] = rows.extract().map_err(|_| shape())?;
            if !is_covariance(&matrix) {
                return Err(refused(
                    "localizer.pose returned a covariance that is not finite, or not symmetric, or \
                     has a negative variance or a correlation beyond one",
                ));
            }
            Some(matrix)
        }
        _ => return Err(shape()),
    };
    Ok(PoseEstimate {
        time_s,
        pose: Pose {
            x_m,
            y_m,
            heading_rad,
        },
        covariance,
        integrity: None,
    })
}
