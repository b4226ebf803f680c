//! Comparison of the tracker with its Cramér–Rao bound, its own covariance and the paper's method:
//! `cargo run --release -p simulate --example tracker_table -- [runs] [seed]`.
//!
//! The line below each of the first lines shows the spread of a perfectly consistent filter in
//! campaigns of equal size. The spread is large because the odometer's scale error is constant
//! during a run.
#![allow(clippy::print_stdout, reason = "prints a table")]

mod common;
#[path = "../tests/all/statistics.rs"]
mod statistics;

use simulate::Campaign;
use simulate::bound::{Bound, BoundPoint};
use toml::Value;

use common::{Result, arguments, changed, fixed};
use statistics::{CampaignStatistics, Consistency};

/// Number of initial SSBs that are excluded from the comparison with the covariance, because an
/// exact start has a singular covariance. The errors of the perfect filter are drawn at the same
/// spacing.
const SETTLING: usize = 50;

/// Number of campaigns of a perfect filter.
const CAMPAIGNS: u64 = 200;

fn main() -> Result<()> {
    let (runs, seeds) = arguments(100, 1)?;
    let seed = seeds.first().copied().unwrap_or_default();
    let drive = |scenario| common::campaign(&scenario, seed, runs);

    println!("{runs} runs, seed {seed}");
    println!(
        "scenario                   p90 m   rms m  bound m  rms/bound  predicted m  NEES/2   in band"
    );
    for name in [
        "paper-real-odometry",
        "paper-real-odometry-2",
        "paper-real-odometry-4",
    ] {
        let scenario = changed(name, [])?;
        let bound = Bound::new(&scenario)?;
        let points = bound.along_route();
        let square_m2: f64 = points.iter().map(|p| p.position_rms_m.powi(2)).sum();
        let bound_m = (square_m2 / points.len() as f64).sqrt();
        print_line(name, bound_m, &drive(scenario)?.consistency(SETTLING));
        let ideal = bound.ideal_filter(SETTLING);
        let campaigns: Vec<Consistency> = (0..CAMPAIGNS)
            .map(|number| ideal.campaign(seed + number, runs as u64).consistency(1))
            .collect();
        for (label, probability) in [("5 %", 0.05), ("median", 0.5), ("95 %", 0.95)] {
            let quantile = |figure: fn(&Consistency) -> f64| {
                let mut values: Vec<f64> = campaigns.iter().map(figure).collect();
                values.sort_by(f64::total_cmp);
                let place = (probability * CAMPAIGNS as f64) as usize;
                values.get(place).copied().unwrap_or(f64::NAN)
            };
            let quantiles = Consistency {
                rms_m: quantile(|it| it.rms_m),
                predicted_rms_m: quantile(|it| it.predicted_rms_m),
                p90_m: quantile(|it| it.p90_m),
                mean_nees: quantile(|it| it.mean_nees),
                in_band: quantile(|it| it.in_band),
            };
            print_line(&format!("  perfect filter, {label}"), bound_m, &quantiles);
        }
    }

    println!("\npaper-real-odometry-2, start unknown by 5 m (1σ): largest rms/bound from 20 m on");
    println!("                      tracker   perfect filter, median   95 %");
    for (label, map, heading_std_rad) in [
        ("map", true, 0.0),
        ("no map", false, 0.0),
        ("no map, heading 0.02", false, 0.02),
    ] {
        let vague = [
            ("vehicle.start.position_std_m", Value::from(5.0)),
            ("vehicle.start.heading_std_rad", heading_std_rad.into()),
            ("vehicle.localizer.map", map.into()),
        ];
        let scenario = changed("paper-real-odometry-2", vague)?;
        let bound = Bound::new(&scenario)?;
        let points = bound.along_route();
        let ideal = bound.ideal_filter(SETTLING);
        let mut perfect: Vec<f64> = (0..CAMPAIGNS / 4)
            .map(|number| {
                let campaign = ideal.campaign(seed + number, runs as u64);
                largest_ratio(&campaign, points.iter().step_by(SETTLING))
            })
            .collect();
        perfect.sort_by(f64::total_cmp);
        let [median, high] = [0.5, 0.95].map(|probability| {
            let place = (probability * perfect.len() as f64) as usize;
            perfect.get(place).copied().unwrap_or(f64::NAN)
        });
        let found = largest_ratio(&drive(scenario)?, &points);
        println!("{label:20} {found:8.3} {median:24.3} {high:6.3}");
    }

    println!("\npaper, worst mean |error| along the track (m)");
    println!("              paper's method    tracker, map      no map    aoa_estimates");
    println!("wake-up           X      Y        X      Y        X      Y");
    for (name, policy) in policies() {
        let mut worst = Vec::new();
        let mut aoa_estimates = 0.0;
        for localizer in [
            vec![],
            vec![("vehicle.localizer.kind", Value::from("tracker"))],
            vec![
                ("vehicle.localizer.kind", "tracker".into()),
                ("vehicle.localizer.map", false.into()),
            ],
        ] {
            let settings = policy.iter().cloned().chain(localizer);
            let campaign = drive(changed("paper", settings)?)?;
            worst.extend(campaign.worst_mean_abs_error_m());
            aoa_estimates = campaign.mean_aoa_estimates();
        }
        print!("{name:12}");
        for pair in worst.chunks(2) {
            for error_m in pair {
                print!(" {error_m:6.3}");
            }
            print!("   ");
        }
        println!(" {aoa_estimates:8.0}");
    }
    Ok(())
}

fn print_line(name: &str, bound_m: f64, errors: &Consistency) {
    println!(
        "{name:24} {:7.3} {:7.3} {bound_m:8.3} {:10.3} {:12.3} {:7.3} {:7.1} %",
        errors.p90_m,
        errors.rms_m,
        errors.rms_m / bound_m,
        errors.predicted_rms_m,
        errors.mean_nees / 2.0,
        100.0 * errors.in_band,
    );
}

/// Returns the largest ratio of RMS error to bound after 20 m of travel.
fn largest_ratio<'a>(campaign: &Campaign, bound: impl IntoIterator<Item = &'a BoundPoint>) -> f64 {
    (campaign.steps.iter().zip(bound))
        .filter(|(_, point)| point.along_m >= 20.0)
        .map(|(step, point)| step.rms_error_m / point.position_rms_m)
        .fold(0.0, f64::max)
}

/// Returns the paper's adaptive wake-up in every power mode and the fixed intervals.
fn policies() -> Vec<(String, Vec<(&'static str, Value)>)> {
    let mode = |mode: i64| {
        let settings = vec![("vehicle.platform.mode", mode.into())];
        (format!("mode {mode}"), settings)
    };
    let fixed = |interval_ms: f64| (format!("{interval_ms} ms"), fixed(interval_ms).to_vec());
    (0..8)
        .map(mode)
        .chain([20.0, 80.0, 120.0, 240.0].map(fixed))
        .collect()
}
