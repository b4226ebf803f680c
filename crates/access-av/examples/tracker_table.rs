//! The tracker against its bound, against its own covariance and against the paper's method:
//! `cargo run --release --example tracker_table -- [runs] [seed]`.
#![allow(clippy::print_stdout, reason = "prints a table")]

use std::error::Error;

use access_av::localize::bound::Bound;
use access_av::scenario::Scenario;
use access_av::simulate::{Campaign, CampaignOptions, Simulation};
use toml::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().map_or(Ok(100), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let drive = |scenario: Scenario| -> Result<Campaign, Box<dyn Error>> {
        let simulation = Simulation::on_its_platform(scenario)?;
        Ok(simulation.campaign(&CampaignOptions {
            seed,
            runs,
            ..CampaignOptions::default()
        })?)
    };

    println!("{runs} runs, seed {seed}");
    println!(
        "scenario                 p90 m   rms m  bound m  rms/bound  predicted m  NEES/2  in band"
    );
    for name in [
        "paper-real-odometry",
        "paper-real-odometry-2",
        "paper-real-odometry-4",
    ] {
        let scenario = Scenario::load(name)?;
        let bound = Bound::new(&scenario)?.along_route();
        let bound_m = (bound.iter().map(|p| p.position_rms_m.powi(2)).sum::<f64>()
            / bound.len() as f64)
            .sqrt();
        // The pose is exact at first: its error ellipse has no area before the vehicle moves.
        let errors = drive(scenario)?.consistency(50);
        println!(
            "{name:22} {:7.3} {:7.3} {bound_m:8.3} {:10.3} {:12.3} {:7.2} {:7.1} %",
            errors.p90_m,
            errors.rms_m,
            errors.rms_m / bound_m,
            errors.predicted_rms_m,
            errors.mean_nees / 2.0,
            100.0 * errors.in_band,
        );
    }

    println!("\npaper, worst mean |error| along the track (m)");
    println!("              paper's method    tracker, map      no map    executions");
    println!("wake-up           X      Y        X      Y        X      Y");
    for (name, policy) in policies() {
        let mut worst = Vec::new();
        let mut executions = 0.0;
        for localizer in [
            vec![],
            vec![("localizer.kind", Value::from("tracker"))],
            vec![
                ("localizer.kind", "tracker".into()),
                ("localizer.map", false.into()),
            ],
        ] {
            let settings = policy.iter().cloned().chain(localizer);
            let campaign = drive(Scenario::load("paper")?.with_overrides(settings)?)?;
            worst.extend(campaign.worst_mean_abs_error_m());
            executions = campaign.mean_executions();
        }
        print!("{name:12}");
        for pair in worst.chunks(2) {
            for error_m in pair {
                print!(" {error_m:6.3}");
            }
            print!("   ");
        }
        println!(" {executions:8.0}");
    }
    Ok(())
}

/// The paper's adaptive wake-up in every mode, and fixed intervals.
fn policies() -> Vec<(String, Vec<(&'static str, Value)>)> {
    let mode = |mode: i64| (format!("mode {mode}"), vec![("platform.mode", mode.into())]);
    let fixed = |interval_ms: f64| {
        let settings = vec![
            ("wake_up.policy", "fixed".into()),
            ("wake_up.interval_ms", interval_ms.into()),
        ];
        (format!("{interval_ms} ms"), settings)
    };
    (0..8)
        .map(mode)
        .chain([20.0, 80.0, 120.0, 240.0].map(fixed))
        .collect()
}
