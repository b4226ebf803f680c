//! Functions that are shared by the tests.
#![allow(
    dead_code,
    unused_imports,
    clippy::unwrap_used,
    reason = "shared by tests"
)]

#[path = "../../../../recording/tests/all/common/mod.rs"]
mod files;

use onboard::observation::SsbDetection;
use onboard::settings::{Shipped, TomlFile};
use onboard::{BoxError, Custom, SsbInput, SsbSource};
use recording::{AngleLog, LoggedAngle, OdometryLog};
use simulate::random::Streams;
use simulate::scenario::Scenario;
use simulate::truth::World;
use simulate::{Campaign, CampaignOptions, MakeCustom, RunRecord, Simulation};
use toml::Value;

pub use files::scratch;

/// Factory without custom code.
pub const NONE: &MakeCustom = &|_| Ok(Custom::default());

/// Returns a shipped scenario.
pub fn shipped(name: &str) -> Scenario {
    Scenario::from_library(name, &Shipped).unwrap()
}

/// Returns a shipped scenario without integrity monitoring, which takes a tenth of the computing
/// time.
pub fn unguarded(name: &str) -> Scenario {
    changed(name, [])
}

/// Returns a shipped scenario with changed keys. Integrity monitoring is off unless the keys enable
/// it (`vehicle.integrity`).
pub fn changed<'a>(name: &str, overrides: impl IntoIterator<Item = (&'a str, Value)>) -> Scenario {
    let unguarded = [("vehicle.integrity.enabled", false.into())];
    let overrides = unguarded.into_iter().chain(overrides);
    let scenario = shipped(name).with_overrides(overrides, &Shipped);
    scenario.unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the value of a TOML expression.
pub fn value(text: &str) -> Value {
    let table = format!("it = {text}").parse::<toml::Table>();
    table.unwrap()["it"].clone()
}

/// Prepares a scenario on its platform.
pub fn simulation(scenario: &Scenario) -> Simulation {
    Simulation::on_its_platform(scenario).unwrap()
}

/// Simulates one run of a scenario.
pub fn run(scenario: &Scenario, seed: u64, number: u64) -> RunRecord {
    simulation(scenario).run(seed, number, NONE).unwrap()
}

/// Simulates the first runs of a scenario.
pub fn drives(scenario: &Scenario, seed: u64, runs: u64) -> Vec<RunRecord> {
    let simulation = simulation(scenario);
    (0..runs)
        .map(|run| simulation.run(seed, run, NONE).unwrap())
        .collect()
}

/// Simulates the first runs of a scenario as a campaign.
pub fn campaign(scenario: &Scenario, seed: u64, runs: usize) -> Campaign {
    let options = CampaignOptions {
        seed,
        runs,
        ..CampaignOptions::default()
    };
    simulation(scenario).campaign(&options).unwrap()
}

/// Returns the odometry and angle logs of a run.
pub fn logs(scenario: &Scenario, seed: u64) -> (OdometryLog, AngleLog, RunRecord) {
    logs_until(scenario, seed, f64::INFINITY)
}

/// Returns the odometry and angle logs of the beginning of a run, until a time in seconds.
pub fn logs_until(
    scenario: &Scenario,
    seed: u64,
    end_s: f64,
) -> (OdometryLog, AngleLog, RunRecord) {
    let simulation = simulation(scenario).until(end_s);
    let record = simulation.run(seed, 0, NONE).unwrap();
    let mut truth = World::new(scenario).unwrap().draw(Streams::new(seed, 0));
    let times = record.steps.iter().map(|step| step.time_s);
    let odometry = OdometryLog {
        samples: times
            .filter_map(|time_s| truth.odometer.sample(truth.path.at(time_s)))
            .collect(),
        ..OdometryLog::default()
    };
    let logged = record.aoa_estimates.iter().map(|angle_result| LoggedAngle {
        ssb: angle_result.ssb,
        measured: angle_result.measured.unwrap(),
    });
    let angles = AngleLog {
        angles: logged.collect(),
        remarks: Vec::new(),
    };
    (odometry, angles, record)
}

/// Burst with given angles.
pub struct Burst<'a>(pub &'a [LoggedAngle]);

impl SsbSource for Burst<'_> {
    fn sense(&mut self, sensed: &mut Vec<SsbDetection>) -> Result<(), BoxError> {
        sensed.extend(self.0.iter().map(|angle| angle.ssb));
        Ok(())
    }

    fn observe(&mut self, index: usize) -> Result<SsbInput<'_>, BoxError> {
        Ok(SsbInput::Angle(self.0[index].measured))
    }
}
