//! Executions that each wake-up policy needs for the same error, on the yard:
//! `cargo run --release -p access-av --example wake_up_table -- [runs] [seed]`.
#![allow(clippy::print_stdout, reason = "prints a table")]

use std::error::Error;

use access_av::scenario::Scenario;
use access_av::simulate::{CampaignOptions, Simulation};

struct Outcome {
    p90_m: f64,
    executions: f64,
    listened: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().map_or(Ok(30), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let yard = Scenario::load("yard")?;

    println!("yard, {runs} runs, seed {seed}");
    println!("policy                  p90 m  executions  SSB bursts listened to");
    let mut references = Vec::new();
    for base_ms in [80.0, 150.0] {
        let scenario = yard.with_overrides([
            ("wake_up.policy", "pid".into()),
            ("wake_up.base_ms", base_ms.into()),
        ])?;
        references.push((
            format!("PID, base {base_ms} ms"),
            drive(scenario, runs, seed)?,
        ));
    }
    for interval_ms in [20.0, 240.0] {
        let scenario = yard.with_overrides([
            ("wake_up.policy", "fixed".into()),
            ("wake_up.interval_ms", interval_ms.into()),
        ])?;
        references.push((
            format!("fixed {interval_ms} ms"),
            drive(scenario, runs, seed)?,
        ));
    }
    for (name, reference) in &references {
        print(name, reference);
        // The least gain at which the 90th percentile comes out the same, by bisection.
        let (mut low, mut high) = (1e-6_f64, 1e-3_f64);
        let mut same = None;
        for _ in 0..7 {
            let least_gain_m2 = (low * high).sqrt();
            let scenario = yard.with_overrides([
                ("wake_up.bound_m", (0.5 * reference.p90_m).into()),
                ("wake_up.least_gain_m2", least_gain_m2.into()),
            ])?;
            let outcome = drive(scenario, runs, seed)?;
            if outcome.p90_m > reference.p90_m {
                high = least_gain_m2;
            } else {
                low = least_gain_m2;
                same = Some((least_gain_m2, outcome));
            }
        }
        if let Some((least_gain_m2, outcome)) = same {
            print(&format!("  uncertainty {least_gain_m2:.1e}"), &outcome);
            println!(
                "  share of executions: {:.2}",
                outcome.executions / reference.executions
            );
        }
    }
    Ok(())
}

fn print(name: &str, outcome: &Outcome) {
    println!(
        "{name:22} {:6.3} {:11.0} {:11.0}",
        outcome.p90_m, outcome.executions, outcome.listened
    );
}

fn drive(scenario: Scenario, runs: usize, seed: u64) -> Result<Outcome, Box<dyn Error>> {
    let campaign = Simulation::on_its_platform(scenario)?.campaign(&CampaignOptions {
        seed,
        runs,
        ..CampaignOptions::default()
    })?;
    let listened: usize = campaign.runs.iter().map(|run| run.listened).sum();
    Ok(Outcome {
        p90_m: campaign.errors.quantile_m(0.9).unwrap_or(f64::NAN),
        executions: campaign.mean_executions(),
        listened: listened as f64 / runs as f64,
    })
}
