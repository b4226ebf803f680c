//! Response of the monitors to faults: time to detection, time in state `ok` with an error that
//! exceeds the protection level, and time to recovery.
//!
//! ```sh
//! cargo run -p simulate --example monitor_table -- yard 3
//! cargo run -p simulate --example monitor_table -- yard 20 nominal inf-sh
//! ```
//!
//! With `nominal`, the table counts the faults that are reported in fault-free runs, in the
//! scenario's channel or in a channel of 3GPP.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example")]

use onboard::Custom;
use onboard::localize::IntegrityState;
use onboard::settings::{Shipped, TomlFile};
use simulate::scenario::{FaultKind, FaultSettings, Scenario};
use simulate::{Simulation, Step};

/// Start of the fault in the first run, in seconds.
const FROM_S: f64 = 60.0;
/// Difference between the starts of the fault in successive runs, in seconds.
const STEP_S: f64 = 11.0;
const LASTS_S: f64 = 15.0;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let name = arguments.get(1).map_or("yard", String::as_str);
    let runs: u64 = arguments.get(2).map_or(1, |it| it.parse().unwrap());
    if arguments.get(3).is_some_and(|it| it == "nominal") {
        return nominal(name, runs, arguments.get(4).map(String::as_str));
    }
    let kinds = [
        FaultKind::OdometerStopped,
        FaultKind::OdometerFrozen,
        FaultKind::OdometerReversed,
        FaultKind::OdometerHeld,
        FaultKind::DeadAntenna { antennas: [2] },
        FaultKind::InvertedAntenna { antennas: [1] },
        FaultKind::ExchangedAntennas { antennas: [1, 3] },
    ];
    println!(
        "scenario, fault, run: reported, fault ended, ok (s after begin, end, end); ok beyond the level (s)"
    );
    for what in kinds {
        for run in 0..runs {
            // Each run has its fault elsewhere.
            let from_s = FROM_S + STEP_S * run as f64;
            let until_s = from_s + LASTS_S;
            let mut scenario = Scenario::from_library(name, &Shipped).unwrap();
            scenario.faults = vec![FaultSettings {
                from_s,
                until_s,
                what,
            }];
            let simulation = Simulation::on_its_platform(&scenario).unwrap();
            let record = simulation.run(5, run, &|_| Ok(Custom::default())).unwrap();
            let is_ok = |step: &Step| {
                step.integrity
                    .is_some_and(|it| it.state == IntegrityState::Ok)
            };
            let first_s = |after_s: f64, is: &dyn Fn(&Step) -> bool| {
                let mut steps = record.steps.iter().filter(|it| it.time_s > after_s);
                let found = steps.find(|it| is(it)).map(|it| it.time_s - after_s);
                found.map_or("none".to_owned(), |it| format!("{it:.2}"))
            };
            let reported_s = first_s(from_s, &|it| !it.faults.is_empty());
            let ended_s = first_s(until_s, &|it| it.faults.is_empty());
            let ok_s = first_s(until_s, &is_ok);
            let beyond = record.steps.iter().filter(|it| {
                let level_m = it.integrity.map(|it| it.protection_level_m);
                is_ok(it) && level_m.is_some_and(|level_m| it.error_m() > level_m)
            });
            let period_s = record
                .steps
                .get(1)
                .map_or(0.0, |it| it.time_s - record.steps[0].time_s);
            let beyond_s = period_s * beyond.count() as f64;
            println!("{name} {what:?} {run}: {reported_s}, {ended_s}, {ok_s}; {beyond_s:.2}");
        }
    }
}

/// Prints the faults that are reported in each fault-free run.
fn nominal(name: &str, runs: u64, channel: Option<&str>) {
    let mut scenario = Scenario::from_library(name, &Shipped).unwrap();
    if let Some(channel) = channel {
        let overrides = [("channel.model", channel.into())];
        scenario = scenario.with_overrides(overrides, &Shipped).unwrap();
    }
    let simulation = Simulation::on_its_platform(&scenario).unwrap();
    for run in 0..runs {
        let record = simulation.run(9, run, &|_| Ok(Custom::default())).unwrap();
        let mut reported = Vec::new();
        for step in &record.steps {
            for active in step.faults.iter() {
                let found = (active.fault.name(), active.since_s);
                if !reported.contains(&found) {
                    reported.push(found);
                }
            }
        }
        println!("{name} {channel:?} run {run}: {reported:?}");
    }
}
