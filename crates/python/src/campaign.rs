//! Campaigns of simulated runs.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ::simulate::scenario::Scenario as CoreScenario;
use ::simulate::{
    Campaign, CampaignOptions, Found, IntegritySummary, MeasurementTraces as CoreMeasurementTraces,
    RunRecord, RunSummary, Simulation, SimulationError,
};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use onboard::energy::{Energy, EstimateCost};
use onboard::geometry::Pose;
use onboard::localize::AngleMeasurement;
use onboard::settings::EstimatorMethod;
use onboard::{AngleResult, BoxError, Custom};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::Value;

use crate::message::brief;
use crate::plug_ins::{
    PythonEstimator, PythonLocalizer, PythonPolicy, estimate_cost, made_for_run,
};
use crate::settings::{Platform, Scenario, settings_error};
use crate::table::{Table, covariance, level};
use crate::threads::at_most_one_per_core;

/// Maximum number of runs of a campaign; larger campaigns must be split.
const MAX_RUNS: usize = 1_000_000;

/// Result of a campaign as columns of equal length.
#[pyclass(frozen, get_all, module = "access_av._core")]
pub struct SimulationResult {
    /// Statistics over all runs, one row per SSB.
    steps: Py<PyDict>,
    /// Summaries, one row per run.
    runs: Py<PyDict>,
    /// True and estimated poses, one row per run and SSB; `None` unless requested.
    trajectories: Option<Py<PyDict>>,
    /// Integrity statistics `(runs, median ratio of protection level to error)`, where `runs`
    /// contains the numbers of steps with a protection level, one row per run. `None` if no
    /// protection levels were reported.
    integrity: Option<(Py<PyDict>, f64)>,
    /// Angle estimates, one row each; `None` unless requested.
    aoa_estimates: Option<Py<PyDict>>,
    /// Quantiles of the horizontal error over all runs and SSBs in metres, by probability, from a
    /// histogram with 5.9 % wide bins.
    error_quantiles_m: Py<PyDict>,
    /// Errors in x and y in metres with the shape (runs, SSBs, 2), NaN until the first pose is
    /// found; `None` unless requested.
    errors_m: Option<Py<PyArray3<f32>>>,
    /// Protection levels in metres with the shape (runs, SSBs), NaN unless the state is `ok`;
    /// `None` unless errors are requested.
    levels_m: Option<Py<PyArray2<f32>>>,
}

/// Simulate many runs of a scenario.
///
/// Equal seeds give equal bytes for any number of threads. `estimator`, `policy` and `localizer`
/// are factories, called as `factory(site, vehicle, start)` at the start of each run; their objects
/// replace the vehicle's components. `access_av.simulate` documents their interfaces. An
/// estimator's factory has the attribute `energy_per_execution_j` or `time_per_execution_s`.
/// `progress` is called with the number of finished runs and the total. Exceptions from any of
/// these end the campaign and are raised.
#[pyfunction]
#[pyo3(signature = (
    scenario, runs = 100, seed = 1, *, platform = None, threads = None, first_run = 0,
    keep_trajectories = false, errors_every = None, estimator = None, policy = None, localizer = None, progress = None
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
    errors_every: Option<usize>,
    estimator: Option<Py<PyAny>>,
    policy: Option<Py<PyAny>>,
    localizer: Option<Py<PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<SimulationResult> {
    let threads = check(runs, threads, errors_every)?;
    crate::arrays::look_up(py)?;
    let simulation = simulation(scenario, platform)?;
    let plug_ins = PlugIns {
        estimator,
        policy,
        localizer,
        sigma_warned: Arc::new(AtomicBool::new(false)),
    };
    let estimate_cost = plug_ins.estimate_cost(py)?;
    let campaign = py.detach(|| {
        let raised = std::cell::RefCell::new(None);
        let options = CampaignOptions {
            seed,
            first_run,
            runs,
            threads,
            keep_records: keep_trajectories,
            quantiles: true,
            errors_every,
            custom: &|start| plug_ins.custom(&scenario.0, start),
            estimate_cost,
            progress: &|done| {
                let called = Python::attach(|py| {
                    py.check_signals()?;
                    progress
                        .as_ref()
                        .map_or(Ok(()), |f| f.call1(py, (done, runs)).map(drop))
                });
                let go_on = called.is_ok();
                *raised.borrow_mut() = called.err();
                go_on
            },
        };
        simulation
            .campaign(&options)
            .map_err(|error| raised.take().unwrap_or_else(|| python_error(error)))
    })?;
    result(py, &campaign, keep_trajectories, errors_every)
}

/// Checks the arguments.
fn check(
    runs: usize,
    threads: Option<usize>,
    errors_every: Option<usize>,
) -> PyResult<Option<usize>> {
    if !(1..=MAX_RUNS).contains(&runs) {
        let message = format!("`runs` is {runs}; it must be between 1 and {MAX_RUNS}");
        return Err(PyValueError::new_err(message));
    }
    if errors_every == Some(0) {
        return Err(PyValueError::new_err("`errors_every` must be at least 1"));
    }
    threads.map(at_most_one_per_core).transpose()
}

/// Prepares a scenario on a platform, by default the one that the scenario names.
fn simulation(scenario: &Scenario, platform: Option<&Platform>) -> PyResult<Simulation> {
    match platform {
        Some(platform) => Simulation::new(&scenario.0, platform.0.clone()),
        None => Simulation::on_its_platform(&scenario.0),
    }
    .map_err(settings_error)
}

fn result(
    py: Python<'_>,
    campaign: &Campaign,
    keep_trajectories: bool,
    errors_every: Option<usize>,
) -> PyResult<SimulationResult> {
    Ok(SimulationResult {
        steps: steps(py, campaign)?,
        runs: run_table(py, campaign)?,
        trajectories: keep_trajectories
            .then(|| trajectories(py, &campaign.records))
            .transpose()?,
        integrity: integrity(py, campaign)?,
        aoa_estimates: keep_trajectories
            .then(|| aoa_estimates(py, &campaign.records))
            .transpose()?,
        error_quantiles_m: error_quantiles(py, campaign)?,
        errors_m: errors_every.map(|_| errors(py, campaign)).transpose()?,
        levels_m: errors_every.map(|_| levels(py, campaign)).transpose()?,
    })
}

/// Measurement traces of a scenario's runs, with the angle of every SSB.
///
/// The traces can be processed with another localizer or wake-up policy. The result equals that of
/// a new campaign bit by bit, in a small fraction of the computing time.
#[pyclass(frozen, module = "access_av._core")]
pub struct MeasurementTraces(CoreMeasurementTraces);

#[pymethods]
impl MeasurementTraces {
    /// Record the first runs with the angles of the given methods. Return `None` if an SSB depends
    /// on the reception of other SSBs.
    #[staticmethod]
    #[pyo3(signature = (scenario, runs = 100, seed = 1, *, methods, platform = None, threads = None))]
    #[allow(clippy::needless_pass_by_value)] // as Python passes them
    fn record(
        py: Python<'_>,
        scenario: &Scenario,
        runs: usize,
        seed: u64,
        methods: Vec<String>,
        platform: Option<&Platform>,
        threads: Option<usize>,
    ) -> PyResult<Option<Self>> {
        let threads = check(runs, threads, None)?;
        crate::arrays::look_up(py)?;
        let simulation = simulation(scenario, platform)?;
        let method = |name: &String| {
            let named = Value::from(name.as_str()).try_into::<EstimatorMethod>();
            named.map_err(|_| PyValueError::new_err(format!("no method {name:?}")))
        };
        let methods = methods.iter().map(method).collect::<PyResult<Vec<_>>>()?;
        let tapes = py.detach(|| {
            let options = CampaignOptions {
                seed,
                runs,
                threads,
                ..CampaignOptions::default()
            };
            CoreMeasurementTraces::record(&simulation, &methods, &options)
        });
        Ok(tapes.map_err(python_error)?.map(Self))
    }

    /// Whether the traces are valid for a scenario: the environment is equal, and its method is
    /// recorded.
    #[pyo3(signature = (scenario, *, platform = None))]
    fn serve(&self, scenario: &Scenario, platform: Option<&Platform>) -> PyResult<bool> {
        Ok(self.0.serve(&simulation(scenario, platform)?))
    }

    /// Process the recorded runs with a scenario for which they are valid. Quantiles are not
    /// computed.
    #[pyo3(signature = (scenario, *, platform = None, threads = None, errors_every = None))]
    fn simulate(
        &self,
        py: Python<'_>,
        scenario: &Scenario,
        platform: Option<&Platform>,
        threads: Option<usize>,
        errors_every: Option<usize>,
    ) -> PyResult<SimulationResult> {
        let threads = check(1, threads, errors_every)?;
        let simulation = simulation(scenario, platform)?;
        if !self.0.serve(&simulation) {
            return Err(PyValueError::new_err(
                "the scenario has another environment than the traces",
            ));
        }
        let campaign = py.detach(|| {
            let options = CampaignOptions {
                threads,
                quantiles: false,
                errors_every,
                ..CampaignOptions::default()
            };
            self.0.campaign(&simulation, &options)
        });
        result(py, &campaign.map_err(python_error)?, false, errors_every)
    }
}

fn errors(py: Python<'_>, campaign: &Campaign) -> PyResult<Py<PyArray3<f32>>> {
    let runs = campaign.runs.len();
    let shape = [runs, campaign.errors_m.len() / runs, 2];
    let flat = PyArray1::from_slice(py, campaign.errors_m.as_flattened());
    Ok(flat.reshape(shape)?.unbind())
}

fn levels(py: Python<'_>, campaign: &Campaign) -> PyResult<Py<PyArray2<f32>>> {
    let runs = campaign.runs.len();
    let shape = [runs, campaign.levels_m.len() / runs];
    let levels_m = campaign.levels_m.iter();
    let flat = levels_m.map(|it| it.unwrap_or(f32::NAN));
    Ok(PyArray1::from_iter(py, flat).reshape(shape)?.unbind())
}

fn python_error(error: SimulationError) -> PyErr {
    match error {
        SimulationError::Settings(error) => settings_error(error),
        SimulationError::Custom(error) => match error.downcast::<PyErr>() {
            Ok(raised) => *raised,
            Err(other) => PyRuntimeError::new_err(brief(other)),
        },
        // A lack of operating system resources is an OSError.
        error @ SimulationError::Threads(_) => PyOSError::new_err(brief(error)),
        other => PyRuntimeError::new_err(brief(other)),
    }
}

/// Factories of Python objects that replace parts of the pipeline, called once per run.
struct PlugIns {
    estimator: Option<Py<PyAny>>,
    policy: Option<Py<PyAny>>,
    localizer: Option<Py<PyAny>>,
    /// Whether the message was printed that an estimator without standard deviations gets the
    /// bound.
    sigma_warned: Arc<AtomicBool>,
}

impl PlugIns {
    /// Returns the cost of an estimate, as specified by the user's estimator if there is one.
    fn estimate_cost(&self, py: Python<'_>) -> PyResult<EstimateCost> {
        let Some(estimator) = &self.estimator else {
            return Ok(EstimateCost::OfMethod);
        };
        estimate_cost(estimator.bind(py))
    }

    fn custom(&self, scenario: &CoreScenario, start: Pose) -> Result<Custom, BoxError> {
        Python::attach(|py| {
            let measurand = scenario.vehicle.array.measurand();
            let made = |factory: &Option<Py<PyAny>>| {
                factory
                    .as_ref()
                    .map(|factory| made_for_run(factory.bind(py), scenario, start))
                    .transpose()
            };
            let sigma_warned = self.sigma_warned.clone();
            let estimator = made(&self.estimator)?
                .map(|call| Box::new(PythonEstimator::new(call, measurand, sigma_warned)) as _);
            let policy = made(&self.policy)?.map(|call| Box::new(PythonPolicy::new(call)) as _);
            let localizer =
                made(&self.localizer)?.map(|object| Box::new(PythonLocalizer::new(object)) as _);
            Ok(Custom {
                estimator,
                policy,
                localizer,
            })
        })
    }
}

fn steps(py: Python<'_>, campaign: &Campaign) -> PyResult<Py<PyDict>> {
    let rows = campaign.time_s.iter().zip(&campaign.steps);
    let table = Table::new(py, rows)
        .column("time_s", |(time_s, _)| *time_s)?
        .column("mean_abs_error_x_m", |(_, step)| step.mean_abs_error_x_m)?
        .column("mean_abs_error_y_m", |(_, step)| step.mean_abs_error_y_m)?
        .column("rms_error_m", |(_, step)| step.rms_error_m)?
        .column("rms_heading_error_rad", |(_, step)| {
            step.rms_heading_error_rad
        })?
        .column("mean_true_snr_db", |(_, step)| step.mean_snr_db)?
        .column("p50_error_m", |(_, step)| step.p50_error_m)?
        .column("p90_error_m", |(_, step)| step.p90_error_m)?
        .column("p99_error_m", |(_, step)| step.p99_error_m)?;
    Ok(table.finish())
}

/// Creates the table of runs. Energies are NaN if the platform has no figure for the method.
fn run_table(py: Python<'_>, campaign: &Campaign) -> PyResult<Py<PyDict>> {
    let energy_j =
        |run: &RunSummary, part: fn(&Energy) -> f64| run.energy.as_ref().map_or(f64::NAN, part);
    let found =
        |run: &RunSummary, value: fn(&Found) -> f64| run.found.as_ref().map_or(f64::NAN, value);
    let table = Table::new(py, campaign.runs.iter())
        .column("run", |run| run.run)?
        .column("aoa_estimates", |run| run.aoa_estimates as u64)?
        .column("bursts_received", |run| run.bursts_received as u64)?
        .column("longest_gap_s", |run| run.longest_gap_s)?
        .column("energy_j", |run| energy_j(run, Energy::total_j))?
        .column("energy_aoa_estimates_j", |run| {
            energy_j(run, |it| it.aoa_estimates_j)
        })?
        .column("energy_listening_j", |run| {
            energy_j(run, |it| it.listening_j)
        })?
        .column("energy_idle_j", |run| energy_j(run, |it| it.idle_j))?
        .column("rms_error_m", |run| run.rms_error_m)?
        .column("max_error_m", |run| run.max_error_m)?
        .column("final_error_m", |run| run.final_error_m)?
        .column("found_s", |run| found(run, |it| it.step.time_s))?
        .column("found_m", |run| found(run, |it| it.driven_m))?;
    Ok(table.finish())
}

/// Creates the integrity table per run: epochs by state, degraded ones with a protection level above
/// the alert limit, and exceeded protection levels while ok. The median is from the histogram.
fn integrity(py: Python<'_>, campaign: &Campaign) -> PyResult<Option<(Py<PyDict>, f64)>> {
    let runs = &campaign.integrity;
    if runs.is_empty() {
        return Ok(None);
    }
    let table = Table::new(py, runs.iter())
        .column("ok", |run| run.ok as f64)?
        .column("degraded", |run| {
            (run.epochs - run.ok - run.unavailable) as f64
        })?
        .column("unavailable", |run| run.unavailable as f64)?
        .column("too_wide", |run| run.too_wide as f64)?
        .column("beyond", |run| run.beyond as f64)?;
    let median = IntegritySummary::sum(runs).median_ratio();
    Ok(Some((table.finish(), median)))
}

/// Creates the table of poses. Covariances and protection levels are NaN and integrity states
/// `None` if the localizer does not provide them.
fn trajectories(py: Python<'_>, records: &[RunRecord]) -> PyResult<Py<PyDict>> {
    let rows = records
        .iter()
        .flat_map(|it| it.steps.iter().map(|step| (it.run, step)));
    let table = Table::new(py, rows)
        .column("run", |(run, _)| run)?
        .column("time_s", |(_, step)| step.time_s)?
        .column("x_m", |(_, step)| step.estimate.x_m)?
        .column("y_m", |(_, step)| step.estimate.y_m)?
        .column("heading_rad", |(_, step)| step.estimate.heading_rad)?
        .column("true_x_m", |(_, step)| step.truth.x_m)?
        .column("true_y_m", |(_, step)| step.truth.y_m)?
        .column("true_heading_rad", |(_, step)| step.truth.heading_rad)?
        .column("error_x_m", |(_, step)| step.estimate.x_m - step.truth.x_m)?
        .column("error_y_m", |(_, step)| step.estimate.y_m - step.truth.y_m)?
        .column("true_snr_db", |(_, step)| step.snr_db)?
        .column("covariance_xx_m2", |(_, it)| {
            covariance(it.covariance, 0, 0)
        })?
        .column("covariance_yy_m2", |(_, it)| {
            covariance(it.covariance, 1, 1)
        })?
        .column("covariance_heading_rad2", |(_, it)| {
            covariance(it.covariance, 2, 2)
        })?
        .column("covariance_xy_m2", |(_, it)| {
            covariance(it.covariance, 0, 1)
        })?
        .column("covariance_x_heading_m_rad", |(_, it)| {
            covariance(it.covariance, 0, 2)
        })?
        .column("covariance_y_heading_m_rad", |(_, it)| {
            covariance(it.covariance, 1, 2)
        })?
        .column("protection_level_m", |(_, step)| {
            level(step.integrity, |it| it.protection_level_m)
        })?
        .column("protection_level_along_m", |(_, step)| {
            level(step.integrity, |it| it.protection_level_along_m)
        })?
        .column("protection_level_across_m", |(_, step)| {
            level(step.integrity, |it| it.protection_level_across_m)
        })?
        .column("searching", |(_, step)| step.searching)?
        .list("integrity", |(_, step)| {
            step.integrity.map(|it| it.state.name())
        })?
        .list("selected_hypothesis", |(_, step)| {
            step.integrity.map(|it| it.hypothesis.name())
        })?;
    Ok(table.finish())
}

/// Creates the table of angle estimates. Angles are NaN if the estimator found none.
fn aoa_estimates(py: Python<'_>, records: &[RunRecord]) -> PyResult<Py<PyDict>> {
    let rows = records.iter().flat_map(|record| {
        let results = record.aoa_estimates.iter();
        results.map(|it| (record.run, it))
    });
    let table = Table::new(py, rows)
        .column("run", |(run, _)| run)?
        .column("time_s", |(_, it)| it.ssb.time_s)?
        .column("pci", |(_, it)| it.ssb.pci)?
        .column("ssb_index", |(_, it)| it.ssb.ssb_index)?
        .column("snr_db", |(_, it)| it.ssb.snr_db)?
        .column("phase_rad", |(_, it)| measured(it, |angle| angle.phase_rad))?
        .column("phase_sigma_rad", |(_, it)| {
            measured(it, |angle| angle.phase_sigma_rad)
        })?
        .column("angle_rad", |(_, it)| measured(it, |angle| angle.angle_rad))?
        .column("estimator_snr_db", |(_, it)| {
            measured(it, |angle| angle.snr_db)
        })?
        .column("mahalanobis_squared", |(_, it)| {
            it.verdict.mahalanobis_squared.unwrap_or(f64::NAN)
        })?
        .column("threshold", |(_, it)| {
            it.verdict.threshold.unwrap_or(f64::NAN)
        })?
        .column("wake_up_time_s", |(_, it)| it.wake_up_time_s)?
        .column("resolved", |(_, it)| {
            it.measured.is_some_and(|angle| angle.resolved)
        })?
        .column("accepted", |(_, it)| it.verdict.accepted)?
        .list("reason", |(_, it)| it.verdict.reason.name())?;
    Ok(table.finish())
}

/// Returns a value of an estimated angle; NaN without one.
pub fn measured(result: &AngleResult, value: fn(&AngleMeasurement) -> f64) -> f64 {
    result.measured.as_ref().map_or(f64::NAN, value)
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
