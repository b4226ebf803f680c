//! What several tests share.
#![allow(
    dead_code,
    unused_imports,
    clippy::unwrap_used,
    reason = "shared by tests"
)]

#[path = "../../../../recording/tests/all/common/mod.rs"]
mod files;

use onboard::observation::SensedSsb;
use onboard::settings::{Shipped, TomlFile};
use onboard::{BoxError, Custom, Observed, SsbSource};
use recording::{AngleLog, LoggedAngle, OdometryLog};
use simulate::random::Streams;
use simulate::scenario::Scenario;
use simulate::truth::World;
use simulate::{Campaign, CampaignOptions, MakeCustom, RunRecord, Simulation};
use toml::Value;

pub use files::scratch;

/// None of the user's own code.
pub const NONE: &MakeCustom = &|_| Ok(Custom::default());

/// A shipped scenario.
pub fn shipped(name: &str) -> Scenario {
    Scenario::from_library(name, &Shipped).unwrap()
}

/// A shipped scenario whose vehicle mistrusts nobody: driven in a tenth of the time.
pub fn unguarded(name: &str) -> Scenario {
    changed(name, [])
}

/// A shipped scenario with some of its keys changed, its vehicle mistrusting nobody unless they say so
/// (`vehicle.integrity`).
pub fn changed<'a>(name: &str, overrides: impl IntoIterator<Item = (&'a str, Value)>) -> Scenario {
    let unguarded = [("vehicle.integrity.enabled", false.into())];
    let overrides = unguarded.into_iter().chain(overrides);
    let scenario = shipped(name).with_overrides(overrides, &Shipped);
    scenario.unwrap_or_else(|error| panic!("{error}"))
}

/// The value of a TOML expression.
pub fn value(text: &str) -> Value {
    let table = format!("it = {text}").parse::<toml::Table>();
    table.unwrap()["it"].clone()
}

/// A scenario on its platform.
pub fn simulation(scenario: &Scenario) -> Simulation {
    Simulation::on_its_platform(scenario).unwrap()
}

/// One run of a scenario.
pub fn run(scenario: &Scenario, seed: u64, number: u64) -> RunRecord {
    simulation(scenario).run(seed, number, NONE).unwrap()
}

/// The first runs of a scenario.
pub fn drives(scenario: &Scenario, seed: u64, runs: u64) -> Vec<RunRecord> {
    let simulation = simulation(scenario);
    (0..runs)
        .map(|run| simulation.run(seed, run, NONE).unwrap())
        .collect()
}

/// The first runs of a scenario as a campaign.
pub fn campaign(scenario: &Scenario, seed: u64, runs: usize) -> Campaign {
    let options = CampaignOptions {
        seed,
        runs,
        ..CampaignOptions::default()
    };
    simulation(scenario).campaign(&options).unwrap()
}

/// Odometry and angles of a run, as a vehicle would have logged them.
pub fn logs(scenario: &Scenario, seed: u64) -> (OdometryLog, AngleLog, RunRecord) {
    let record = run(scenario, seed, 0);
    let mut truth = World::new(scenario).unwrap().draw(Streams::new(seed, 0));
    let times = record.steps.iter().map(|step| step.time_s);
    let odometry = OdometryLog {
        samples: times
            .filter_map(|time_s| truth.odometer.sample(truth.path.at(time_s)))
            .collect(),
        ..OdometryLog::default()
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

/// A burst whose angles are known.
pub struct Burst<'a>(pub &'a [LoggedAngle]);

impl SsbSource for Burst<'_> {
    fn sense(&mut self, sensed: &mut Vec<SensedSsb>) -> Result<(), BoxError> {
        sensed.extend(self.0.iter().map(|angle| angle.ssb));
        Ok(())
    }

    fn observe(&mut self, index: usize) -> Result<Observed<'_>, BoxError> {
        Ok(Observed::Angle(self.0[index].measured))
    }
}
