//! Functions that are shared by the tables.
#![allow(dead_code, reason = "each table takes what it needs")]

use std::error::Error;

use onboard::settings::{Shipped, TomlFile};
use simulate::scenario::Scenario;
use simulate::{Campaign, CampaignOptions, Simulation};
use toml::Value;

pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Parses the number of runs and the seeds from the command line.
pub fn arguments(runs: usize, seed: u64) -> Result<(usize, Vec<u64>)> {
    let mut arguments = std::env::args().skip(1);
    let runs = arguments.next().map_or(Ok(runs), |text| text.parse())?;
    let seeds = arguments.map(|text| text.parse());
    let mut seeds = seeds.collect::<std::result::Result<Vec<u64>, _>>()?;
    if seeds.is_empty() {
        seeds.push(seed);
    }
    Ok((runs, seeds))
}

/// Returns a shipped scenario with changed keys. Integrity monitoring is off unless the keys enable
/// it.
pub fn changed<'a>(
    name: &str,
    overrides: impl IntoIterator<Item = (&'a str, Value)>,
) -> Result<Scenario> {
    let scenario = Scenario::from_library(name, &Shipped)?;
    let unguarded = [("vehicle.integrity.enabled", false.into())];
    let overrides = unguarded.into_iter().chain(overrides);
    Ok(scenario.with_overrides(overrides, &Shipped)?)
}

/// Runs a campaign on the platform that the scenario names.
pub fn campaign(scenario: &Scenario, seed: u64, runs: usize) -> Result<Campaign> {
    let options = CampaignOptions {
        seed,
        runs,
        ..CampaignOptions::default()
    };
    let simulation = Simulation::on_its_platform(scenario)?;
    Ok(simulation.campaign(&options)?)
}

/// Returns the settings of a wake-up at a fixed interval.
pub fn fixed(interval_ms: f64) -> [(&'static str, Value); 2] {
    [
        ("vehicle.wake_up.policy", "fixed".into()),
        ("vehicle.wake_up.interval_ms", interval_ms.into()),
    ]
}
