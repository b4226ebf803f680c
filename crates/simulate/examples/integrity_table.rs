//! Protection levels, alarms and false alarms without a fault and under each fault: `cargo run
//! --release -p simulate --example integrity_table -- [runs] [seed ...]`.
//!
//! The epochs of a run are correlated. Therefore, each fraction is shown with the upper end of its
//! 95 % bootstrap interval over runs and with the number of affected runs. `silent` is the longest
//! time without an alarm while the error exceeded the alert limit. `early` counts alarms while the
//! error was within the alert limit, caused by the protection level or by a suspected source.
#![allow(clippy::print_stdout, reason = "prints a table")]

mod common;
#[path = "../tests/all/statistics.rs"]
mod statistics;

use simulate::IntegritySummary;
use simulate::scenario::{FaultKind, FaultSettings, Scenario};
use toml::{Table, Value};

use common::{Result, arguments, campaign, changed, fixed};
use statistics::bootstrap_interval;

fn main() -> Result<()> {
    let (runs, seeds) = arguments(40, 1)?;
    println!("{runs} runs of each, seeds {seeds:?}");
    println!(
        "                      beyond PL while ok    runs         PL/error      worst  silent  early alarms/h"
    );
    println!(
        "case                     share    limit   with    epochs   median  not ok      m       s     all  suspected"
    );
    for (name, scenario) in cases()? {
        let mut driven = Vec::new();
        for &seed in &seeds {
            driven.extend(campaign(&scenario, seed, runs)?.integrity);
        }
        print(name, &driven);
    }
    Ok(())
}

fn cases() -> Result<Vec<(&'static str, Scenario)>> {
    let shipped = changed(
        "nlos-and-faults",
        [("vehicle.integrity", Value::Table(Table::new()))],
    )?;
    let with = |faults: Vec<FaultSettings>| Scenario {
        faults,
        ..shipped.clone()
    };
    let alone = |what| {
        with(vec![FaultSettings {
            from_s: 25.0,
            until_s: 60.0,
            what,
        }])
    };
    let behind_a_wall = |radio_head, bias_rad| {
        alone(FaultKind::NonLineOfSight {
            radio_head,
            bias_rad,
        })
    };
    let elsewhere = |radio_head, by_m| alone(FaultKind::MovedHead { radio_head, by_m });
    let mut cases = vec![
        ("nominal", with(Vec::new())),
        ("non-line-of-sight", behind_a_wall(3, 0.5)),
        ("  a slight one", behind_a_wall(0, 0.1)),
        ("moved head, 25 m", elsewhere(0, [25.0, 0.0])),
        ("  by 3 m", elsewhere(2, [3.0, 0.0])),
        ("spoofed from 300 m", elsewhere(1, [-200.0, 250.0])),
        ("slip", alone(FaultKind::OdometerSlip { scale: 1.2 })),
        (
            "stuck antenna",
            alone(FaultKind::StuckAntenna { antennas: [1] }),
        ),
        ("all, one by one", shipped.clone()),
    ];
    for name in ["paper-real-odometry-2", "paper-real-odometry-4", "yard"] {
        let guarded = [("vehicle.integrity", Value::Table(Table::new()))];
        cases.push((name, changed(name, guarded)?));
    }
    for (name, k_db) in [
        ("yard, K = 5 dB, not 10", 5.0),
        ("yard, K = 3 dB, not 10", 3.0),
    ] {
        let guarded = [
            ("vehicle.integrity", Value::Table(Table::new())),
            ("truth.site.rician_k_db", k_db.into()),
        ];
        let [policy, interval] = fixed(100.0);
        let scenario = changed("yard", guarded.into_iter().chain([policy, interval]))?;
        cases.push((name, scenario));
    }
    Ok(cases)
}

fn print(name: &str, runs: &[IntegritySummary]) {
    let total = IntegritySummary::sum(runs);
    let affected = runs.iter().filter(|run| run.beyond > 0).count();
    // The bootstrap uses counts only, because merging histograms thousands of times would be slower
    // than the simulation.
    let counts: Vec<[f64; 2]> = (runs.iter())
        .map(|run| [run.beyond as f64, run.ok as f64])
        .collect();
    let [_, limit] = bootstrap_interval(&counts, |sample| {
        let [beyond, ok] = (sample.iter()).fold([0.0; 2], |[beyond, ok], [more, all]| {
            [beyond + more, ok + all]
        });
        beyond / ok.max(1.0)
    });
    println!(
        "{name:22} {:8.1e} {limit:8.1e} {affected:6} {:9} {:8.2} {:5.1} % {:6.2} {:7.2} {:7.1} {:10.1}",
        total.risk(),
        total.epochs,
        total.median_ratio(),
        100.0 * (1.0 - total.ok as f64 / total.epochs.max(1) as f64),
        total.worst_m,
        total.longest_silence_s,
        total.per_h(total.early_alarms),
        total.per_h(total.suspicions),
    );
}
