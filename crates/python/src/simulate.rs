//! Campaigns of simulated drives, as columns.

use access_av::BoxError;
use access_av::estimator::CustomEstimator;
use access_av::localize::AngleMeasurement;
use access_av::observation::{ANTENNAS, Snapshot};
use access_av::onboard::{Custom, Execution};
use access_av::platform::Platform as CorePlatform;
use access_av::simulate::{
    Campaign, CampaignOptions, RunRecord, RunSummary, Simulation, SimulationError, Step,
    StepStatistics,
};
use access_av::wake_up::Controller;
use numpy::{Element, PyArray1, PyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::scenario::{Platform, Scenario, scenario_error};

/// What a campaign found, as columns of equal length.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct SimulationResult {
    /// Statistics over all runs, one row per SSB.
    steps: Py<PyDict>,
    /// One row per run.
    runs: Py<PyDict>,
    /// Truth and estimate, one row per run and SSB; `None` unless kept.
    trajectories: Option<Py<PyDict>>,
    /// Estimated angles, one row each; `None` unless kept.
    executions: Option<Py<PyDict>>,
    /// Quantiles of the horizontal error over all runs and SSBs, in metres, by probability.
    error_quantiles_m: Py<PyDict>,
}

/// Drive a scenario many times.
///
/// The same seed gives the same bytes whatever the number of threads. `estimator` takes snapshots
/// of shape (antennas, snapshots) and returns an angle from the array's axis in radians; `policy`
/// takes the SNR error, the velocity error and the seconds since its last call, and returns the
/// wake-up time in seconds. `progress` is called with the runs done and their total. Exceptions
/// raised in any of them end the campaign and reach the caller.
#[pyfunction]
#[pyo3(signature = (
    scenario, runs = 100, seed = 1, *, platform = None, threads = None, first_run = 0,
    keep_trajectories = false, estimator = None, policy = None, progress = None
))]
#[allow(clippy::too_many_arguments, clippy::needless_pass_by_value)] // as Python passes them
pub fn simulate(
    py: Python<'_>,
    scenario: &Scenario,
    runs: usize,
    seed: u64,
    platform: Option<&Platform>,
    threads: Option<usize>,
    first_run: u64,
    keep_trajectories: bool,
    estimator: Option<Py<PyAny>>,
    policy: Option<Py<PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<SimulationResult> {
    if runs == 0 || threads == Some(0) {
        return Err(PyValueError::new_err(
            "`runs` and `threads` must be at least 1",
        ));
    }
    let platform = match platform {
        Some(platform) => platform.0.clone(),
        None => CorePlatform::load(&scenario.0.platform.name).map_err(scenario_error)?,
    };
    let simulation = Simulation::new(scenario.0.clone(), platform).map_err(scenario_error)?;
    let campaign = py.detach(|| {
        let raised = std::cell::RefCell::new(None);
        let options = CampaignOptions {
            seed,
            first_run,
            runs,
            threads,
            keep_records: keep_trajectories,
            custom: &|| custom(estimator.as_ref(), policy.as_ref()),
            progress: &|done| {
                let told = Python::attach(|py| {
                    py.check_signals()?;
                    progress
                        .as_ref()
                        .map_or(Ok(()), |f| f.call1(py, (done, runs)).map(drop))
                });
                let go_on = told.is_ok();
                *raised.borrow_mut() = told.err();
                go_on
            },
        };
        simulation
            .campaign(&options)
            .map_err(|error| raised.take().unwrap_or_else(|| python_error(error)))
    })?;
    Ok(SimulationResult {
        steps: steps(py, &campaign)?,
        runs: run_table(py, &campaign)?,
        trajectories: keep_trajectories
            .then(|| trajectories(py, &campaign.records))
            .transpose()?,
        executions: keep_trajectories
            .then(|| executions(py, &campaign.records))
            .transpose()?,
        error_quantiles_m: error_quantiles(py, &campaign)?,
    })
}

fn python_error(error: SimulationError) -> PyErr {
    match error {
        SimulationError::Scenario(error) => scenario_error(error),
        SimulationError::Custom(error) => match error.downcast::<PyErr>() {
            Ok(raised) => *raised,
            Err(other) => PyRuntimeError::new_err(other.to_string()),
        },
        other => PyRuntimeError::new_err(other.to_string()),
    }
}

/// A Python callable in place of the angle estimator.
struct PythonEstimator(Py<PyAny>);

impl CustomEstimator for PythonEstimator {
    fn angle_rad(&mut self, snapshots: &[Snapshot]) -> Result<f64, BoxError> {
        let angle = Python::attach(|py| {
            let rows: Vec<Vec<_>> = (0..ANTENNAS)
                .map(|antenna| snapshots.iter().map(|snapshot| snapshot[antenna]).collect())
                .collect();
            let array = PyArray2::from_vec2(py, &rows).map_err(PyErr::from)?;
            self.0.call1(py, (array,))?.extract::<f64>(py)
        });
        Ok(angle?)
    }
}

/// A Python callable in place of Algorithm 1.
#[derive(Debug)]
struct PythonController(Py<PyAny>);

impl Controller for PythonController {
    fn wake_up_time_s(
        &mut self,
        snr_error: f64,
        velocity_error: f64,
        interval_s: f64,
    ) -> Result<f64, BoxError> {
        let wake_up_time_s = Python::attach(|py| {
            let arguments = (snr_error, velocity_error, interval_s);
            self.0.call1(py, arguments)?.extract::<f64>(py)
        });
        Ok(wake_up_time_s?)
    }
}

fn custom(estimator: Option<&Py<PyAny>>, policy: Option<&Py<PyAny>>) -> Custom {
    Python::attach(|py| Custom {
        estimator: estimator.map(|f| Box::new(PythonEstimator(f.clone_ref(py))) as _),
        controller: policy.map(|f| Box::new(PythonController(f.clone_ref(py))) as _),
    })
}

/// A column's name, and its value in a row.
type Column<R> = (&'static str, fn(&R) -> f64);

/// A column from the rows of a table.
fn column<R, T: Element>(
    py: Python<'_>,
    rows: impl IntoIterator<Item = R>,
    value: impl Fn(R) -> T,
) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, rows.into_iter().map(value).collect())
}

fn steps(py: Python<'_>, campaign: &Campaign) -> PyResult<Py<PyDict>> {
    let table = PyDict::new(py);
    table.set_item("time_s", column(py, &campaign.time_s, |time_s| *time_s))?;
    let columns: [Column<StepStatistics>; 8] = [
        ("mean_abs_error_x_m", |step| step.mean_abs_error_x_m),
        ("mean_abs_error_y_m", |step| step.mean_abs_error_y_m),
        ("rms_error_m", |step| step.rms_error_m),
        ("rms_heading_error_rad", |step| step.rms_heading_error_rad),
        ("mean_true_snr_db", |step| step.mean_snr_db),
        ("p50_error_m", |step| step.p50_error_m),
        ("p90_error_m", |step| step.p90_error_m),
        ("p99_error_m", |step| step.p99_error_m),
    ];
    for (name, value) in columns {
        table.set_item(name, column(py, &campaign.steps, value))?;
    }
    Ok(table.unbind())
}

/// Energies are NaN where the platform has no figure for the method.
fn run_table(py: Python<'_>, campaign: &Campaign) -> PyResult<Py<PyDict>> {
    let table = PyDict::new(py);
    let runs = &campaign.runs;
    table.set_item("run", column(py, runs, |run| run.run))?;
    table.set_item("executions", column(py, runs, |run| run.executions as u64))?;
    table.set_item("listened", column(py, runs, |run| run.listened as u64))?;
    let columns: [Column<RunSummary>; 9] = [
        ("energy_j", |run| {
            run.energy.map_or(f64::NAN, |energy| energy.total_j())
        }),
        ("energy_executions_j", |run| {
            run.energy.map_or(f64::NAN, |energy| energy.executions_j)
        }),
        ("energy_listening_j", |run| {
            run.energy.map_or(f64::NAN, |energy| energy.listening_j)
        }),
        ("energy_idle_j", |run| {
            run.energy.map_or(f64::NAN, |energy| energy.idle_j)
        }),
        ("rms_error_m", |run| run.rms_error_m),
        ("max_error_m", |run| run.max_error_m),
        ("final_error_m", |run| run.final_error_m),
        ("found_s", |run| {
            run.found.map_or(f64::NAN, |found| found.step.time_s)
        }),
        ("found_m", |run| {
            run.found.map_or(f64::NAN, |found| found.driven_m)
        }),
    ];
    for (name, value) in columns {
        table.set_item(name, column(py, runs, value))?;
    }
    Ok(table.unbind())
}

/// Covariances and protection levels are NaN where the localizer does not know its own error, states
/// of integrity `None`.
fn trajectories(py: Python<'_>, records: &[RunRecord]) -> PyResult<Py<PyDict>> {
    let table = PyDict::new(py);
    let rows = || records.iter().flat_map(|record| record.steps.iter());
    let runs = records
        .iter()
        .flat_map(|record| record.steps.iter().map(|_| record.run));
    table.set_item("run", column(py, runs, |run| run))?;
    let columns: [Column<Step>; 17] = [
        ("time_s", |step| step.time_s),
        ("x_m", |step| step.estimate.x_m),
        ("y_m", |step| step.estimate.y_m),
        ("heading_rad", |step| step.estimate.heading_rad),
        ("true_x_m", |step| step.truth.x_m),
        ("true_y_m", |step| step.truth.y_m),
        ("true_heading_rad", |step| step.truth.heading_rad),
        ("error_x_m", |step| step.estimate.x_m - step.truth.x_m),
        ("error_y_m", |step| step.estimate.y_m - step.truth.y_m),
        ("true_snr_db", |step| step.snr_db),
        ("covariance_xx_m2", |step| covariance(step, 0, 0)),
        ("covariance_yy_m2", |step| covariance(step, 1, 1)),
        ("covariance_heading_rad2", |step| covariance(step, 2, 2)),
        ("covariance_xy_m2", |step| covariance(step, 0, 1)),
        ("covariance_x_heading_m_rad", |step| covariance(step, 0, 2)),
        ("covariance_y_heading_m_rad", |step| covariance(step, 1, 2)),
        ("protection_level_m", |step| {
            step.integrity
                .map_or(f64::NAN, |integrity| integrity.protection_level_m)
        }),
    ];
    for (name, value) in columns {
        table.set_item(name, column(py, rows(), value))?;
    }
    table.set_item("searching", column(py, rows(), |step| step.searching))?;
    let states = rows().map(|step| step.integrity.map(|integrity| integrity.state.name()));
    table.set_item("integrity", PyList::new(py, states.collect::<Vec<_>>())?)?;
    Ok(table.unbind())
}

fn covariance(step: &Step, row: usize, column: usize) -> f64 {
    let matrix = step.covariance.as_ref();
    matrix
        .and_then(|m| m.get(row)?.get(column).copied())
        .unwrap_or(f64::NAN)
}

/// Angles are NaN where the snapshots carried none.
fn executions(py: Python<'_>, records: &[RunRecord]) -> PyResult<Py<PyDict>> {
    let table = PyDict::new(py);
    let rows = || records.iter().flat_map(|record| record.executions.iter());
    let runs = records
        .iter()
        .flat_map(|record| record.executions.iter().map(|_| record.run));
    table.set_item("run", column(py, runs, |run| run))?;
    table.set_item(
        "time_s",
        column(py, rows(), |execution| execution.ssb.time_s),
    )?;
    table.set_item("pci", column(py, rows(), |execution| execution.ssb.pci))?;
    table.set_item(
        "ssb_index",
        column(py, rows(), |execution| execution.ssb.ssb_index),
    )?;
    let columns: [Column<Execution>; 8] = [
        ("snr_db", |execution| execution.ssb.snr_db),
        ("phase_rad", |execution| {
            measured(execution, |angle| angle.phase_rad)
        }),
        ("phase_sigma_rad", |execution| {
            measured(execution, |angle| angle.phase_sigma_rad)
        }),
        ("angle_rad", |execution| {
            measured(execution, |angle| angle.angle_rad)
        }),
        ("estimator_snr_db", |execution| {
            measured(execution, |angle| angle.snr_db)
        }),
        ("mahalanobis_squared", |e| {
            e.verdict.mahalanobis_squared.unwrap_or(f64::NAN)
        }),
        ("threshold", |execution| {
            execution.verdict.threshold.unwrap_or(f64::NAN)
        }),
        ("wake_up_time_s", |execution| execution.wake_up_time_s),
    ];
    for (name, value) in columns {
        table.set_item(name, column(py, rows(), value))?;
    }
    let resolved = |e: &Execution| e.measured.as_ref().is_some_and(|angle| angle.resolved);
    table.set_item("resolved", column(py, rows(), resolved))?;
    table.set_item(
        "accepted",
        column(py, rows(), |execution| execution.verdict.accepted),
    )?;
    let reasons = PyList::new(py, rows().map(|execution| execution.verdict.reason.name()))?;
    table.set_item("reason", reasons)?;
    Ok(table.unbind())
}

fn measured(execution: &Execution, value: fn(&AngleMeasurement) -> f64) -> f64 {
    execution.measured.as_ref().map_or(f64::NAN, value)
}

fn error_quantiles(py: Python<'_>, campaign: &Campaign) -> PyResult<Py<PyDict>> {
    let table = PyDict::new(py);
    for probability in [0.5, 0.68, 0.9, 0.95, 0.99, 0.999] {
        table.set_item(
            probability,
            campaign.errors.quantile_m(probability).unwrap_or(f64::NAN),
        )?;
    }
    Ok(table.unbind())
}
