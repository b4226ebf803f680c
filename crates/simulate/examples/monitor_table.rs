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
use simulate::Simulation;
use simulate::scenario::{FaultKind, FaultSettings, Scenario};

const FROM_S: f64 = 60.0;
const UNTIL_S: f64 = 75.0;

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
        FaultKind::DeadAntenna { antenna: 2 },
        FaultKind::InvertedAntenna { antenna: 1 },
        FaultKind::ExchangedAntennas { antennas: [1, 3] },
    ];
    for what in kinds {
        let (from_s, until_s) = (FROM_S, UNTIL_S);
        let fault = FaultSettings {
            from_s,
            until_s,
            what,
        };
        let mut scenario = Scenario::from_library(name, &Shipped).unwrap();
        scenario.faults = vec![fault];
        let simulation = Simulation::on_its_platform(&scenario).unwrap();
        for run in 0..runs {
            let record = simulation.run(5, run, &|_| Ok(Custom::default())).unwrap();
            let mut before = String::new();
            let (mut beyond, mut period_s) = (0, 0.0);
            for pair in record.steps.windows(2) {
                let [last, step] = pair else { continue };
                period_s = step.time_s - last.time_s;
                let Some(integrity) = step.integrity else {
                    continue;
                };
                let is_beyond = integrity.state == IntegrityState::Ok
                    && step.error_m() > integrity.protection_level_m;
                beyond += usize::from(is_beyond);
                let faults: Vec<_> = step.faults.iter().map(|it| it.fault.name()).collect();
                let now = format!("{} {faults:?}", integrity.state.name());
                let is_near = (FROM_S - 1.0..UNTIL_S + 20.0).contains(&step.time_s);
                let is_time = (step.time_s % 2.0).abs() < 0.5 * period_s && step.time_s > UNTIL_S;
                if (now != before || is_time) && (is_near || !faults.is_empty()) {
                    println!(
                        "  {:.2} s: {now}, error {:.2} m, level {:.2} m",
                        step.time_s,
                        step.error_m(),
                        integrity.protection_level_m
                    );
                }
                before = now;
            }
            let beyond_s = period_s * beyond as f64;
            println!("{name} {what:?} run {run}: ok beyond the level {beyond_s:.2} s");
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
