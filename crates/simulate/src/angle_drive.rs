//! Export of a scenario's run as a log of the angles of arrival that the receiver estimates.

use std::fs;
use std::path::Path;

use onboard::settings::Check;
use recording::replay::{all_of_error, scatter_sigma_rad};
use recording::{RecordingError, TimedPose};
use recording::{write_angle_log, write_odometry_csv, write_tum};

use crate::measurement_trace::MeasurementTrace;
use crate::random::Streams;
use crate::run::Simulation;
use crate::scenario::Scenario;
use crate::synth::{SynthError, write_settings};

/// Writes run `run` of a scenario up to `end_s` into `directory` and returns the number of angles.
///
/// - `angles.csv`: the angle of arrival of every SSB
/// - `odometry.csv`: the odometry samples
/// - `truth.tum`: the true poses
/// - `site.toml`, `vehicle.toml`: the nominal models
/// - `scenario.toml`: the scenario
///
/// The standard deviation of an angle is its total modelled error: thermal noise and the scatter of
/// the site. The scatter is independent after half a wavelength, as the vehicle file specifies.
///
/// # Errors
/// [`SynthError`].
pub fn log_angles(
    scenario: &Scenario,
    seed: u64,
    run: u64,
    end_s: f64,
    directory: &Path,
) -> Result<usize, SynthError> {
    let simulation = Simulation::on_its_platform(scenario)?;
    let file = &scenario.name;
    Check { file }.that(
        simulation.world().is_independent_of_listening(),
        "fidelity",
        "samples, latency or noisy SNR",
        "a log of angles requires snapshots without latency and with the true SNR",
    )?;
    let method = scenario.vehicle.estimator.method;
    let trace = MeasurementTrace::record(&simulation, &[method], Streams::new(seed, run), run)?;
    let scatter_rad = scatter_sigma_rad(&scenario.site, &scenario.vehicle);
    let angles: Vec<_> = trace
        .angles_of(0)
        .filter(|it| it.ssb.time_s <= end_s)
        .map(|mut it| {
            it.measured.phase_sigma_rad = it.measured.phase_sigma_rad.hypot(scatter_rad);
            it
        })
        .collect();
    let mut vehicle = all_of_error(&scenario.site, &scenario.vehicle);
    vehicle.start.pose = vehicle.start.known.then_some(trace.given_start);
    let truth: Vec<_> = (trace.truth().filter(|(time_s, _)| *time_s <= end_s))
        .map(|(time_s, pose)| TimedPose { time_s, pose })
        .collect();
    let odometry: Vec<_> = (trace.odometry.iter().copied())
        .filter(|sample| sample.time_s <= end_s)
        .collect();

    fs::create_dir_all(directory).map_err(|source| RecordingError::io(directory, source))?;
    write_settings(directory, scenario, &vehicle)?;
    write_odometry_csv(&directory.join("odometry.csv"), &odometry)?;
    write_tum(&directory.join("truth.tum"), &truth)?;
    write_angle_log(&directory.join("angles.csv"), &angles)?;
    Ok(angles.len())
}
