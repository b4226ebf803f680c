//! What several tests share.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "shared by tests"
)]

use std::path::{Path, PathBuf};

use access_av::onboard::Custom;
use access_av::platform::Platform;
use access_av::random::Streams;
use access_av::recording::{AngleLog, LoggedAngle, OdometryLog};
use access_av::scenario::Scenario;
use access_av::simulate::{RunRecord, Simulation};
use access_av::world::{Odometer, Vehicle};

/// Where the reference data is, or `None` with a printed reason.
pub fn data_dir() -> Option<PathBuf> {
    let dir = std::env::var_os("ACCESS_AV_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    if dir.is_dir() {
        return Some(dir);
    }
    println!(
        "skipped: no reference data at {} (set ACCESS_AV_DATA)",
        dir.display()
    );
    None
}

/// An empty directory of its own for a test.
pub fn scratch(name: &str) -> PathBuf {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if dir.exists() {
        std::fs::remove_dir_all(&dir).unwrap();
    }
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

/// One run of a scenario.
pub fn run(scenario: &Scenario, seed: u64, number: u64) -> RunRecord {
    let platform = Platform::load(&scenario.platform.name).unwrap();
    let simulation = Simulation::new(scenario.clone(), platform).unwrap();
    simulation.run(seed, number, Custom::default()).unwrap()
}

/// Odometry and angles of a run, as a vehicle would have logged them.
pub fn logs(scenario: &Scenario, seed: u64) -> (OdometryLog, AngleLog, RunRecord) {
    let record = run(scenario, seed, 0);
    let streams = Streams::new(seed, 0);
    let vehicle = Vehicle::new(scenario.build_track().unwrap(), &scenario.motion, streams);
    let mut odometer = Odometer::new(scenario.odometer, vehicle.at(0.0), streams);
    let times = record.steps.iter().map(|step| step.time_s);
    let odometry = OdometryLog {
        samples: times
            .filter_map(|time_s| odometer.sample(vehicle.at(time_s)))
            .collect(),
        remarks: Vec::new(),
    };
    let logged = record.executions.iter().map(|execution| LoggedAngle {
        ssb: execution.ssb,
        measured: execution.measured.unwrap(),
    });
    let angles = AngleLog {
        angles: logged.collect(),
        remarks: Vec::new(),
    };
    (odometry, angles, record)
}
