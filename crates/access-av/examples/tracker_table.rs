//! The tracker against its bound and against its own covariance:
//! `cargo run --release --example tracker_table -- [runs] [seed]`.

use std::error::Error;

use access_av::localize::bound::Bound;
use access_av::onboard::Custom;
use access_av::platform::Platform;
use access_av::scenario::Scenario;
use access_av::simulate::{CampaignOptions, RunRecord, Simulation};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().map_or(Ok(100), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;

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
        let records = drive(scenario, runs, seed)?;
        let table = Table::new(&records);
        let bound_m = (bound.iter().map(|p| p.position_rms_m.powi(2)).sum::<f64>()
            / bound.len() as f64)
            .sqrt();
        println!(
            "{name:22} {:7.3} {:7.3} {bound_m:8.3} {:10.3} {:12.3} {:7.2} {:7.1} %",
            table.p90_m,
            table.rms_m,
            table.rms_m / bound_m,
            table.predicted_m,
            table.mean_nees / 2.0,
            100.0 * table.in_band,
        );
    }

    println!("\npaper, adaptive, worst mean |error| along the track (m)");
    println!("mode  map: X      Y      no map: X      Y");
    for mode in 0..8 {
        let mut worst = Vec::new();
        for map in [true, false] {
            let scenario = Scenario::load("paper")?.with_overrides([
                ("localizer.kind", "tracker".into()),
                ("localizer.map", map.into()),
                ("platform.mode", mode.into()),
            ])?;
            let table = Table::new(&drive(scenario, runs, seed)?);
            worst.extend([table.worst_x_m, table.worst_y_m]);
        }
        if let [a, b, c, d] = worst[..] {
            println!("{mode:4} {a:10.3} {b:6.3} {c:14.3} {d:6.3}");
        }
    }
    Ok(())
}

fn drive(scenario: Scenario, runs: usize, seed: u64) -> Result<Vec<RunRecord>, Box<dyn Error>> {
    let platform = Platform::load(&scenario.platform.name)?;
    let simulation = Simulation::new(scenario, platform)?;
    let campaign = simulation.campaign(&CampaignOptions {
        seed,
        first_run: 0,
        runs,
        keep_records: true,
        threads: None,
        custom: &Custom::default,
        progress: &|_| true,
    })?;
    Ok(campaign.records)
}

#[derive(Default)]
struct Table {
    rms_m: f64,
    predicted_m: f64,
    p90_m: f64,
    mean_nees: f64,
    in_band: f64,
    worst_x_m: f64,
    worst_y_m: f64,
}

impl Table {
    fn new(records: &[RunRecord]) -> Self {
        let runs = records.len() as f64;
        let steps = records.first().map_or(0, |record| record.steps.len());
        // χ² with 2 degrees of freedom for each run: its 95 % band by Wilson and Hilferty.
        let freedom = 2.0 * runs;
        let band = [-1.96, 1.96].map(|z: f64| {
            let spread = 2.0 / (9.0 * freedom);
            freedom * (1.0 - spread + z * spread.sqrt()).powi(3)
        });
        let (mut errors_m, mut table) = (Vec::new(), Self::default());
        let mut settled = 0.0;
        for number in 0..steps {
            let (mut nees, mut x_m, mut y_m) = (0.0, 0.0, 0.0);
            for step in records.iter().filter_map(|record| record.steps.get(number)) {
                let (dx, dy) = (
                    step.estimate.x_m - step.truth.x_m,
                    step.estimate.y_m - step.truth.y_m,
                );
                x_m += dx.abs() / runs;
                y_m += dy.abs() / runs;
                errors_m.push(dx.hypot(dy));
                if let Some([[xx, xy, _], [_, yy, _], _]) = step.covariance {
                    table.predicted_m += (xx + yy) / (runs * steps as f64);
                    let determinant = xx * yy - xy * xy;
                    if determinant > 0.0 {
                        nees += (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
                    }
                }
            }
            table.worst_x_m = table.worst_x_m.max(x_m);
            table.worst_y_m = table.worst_y_m.max(y_m);
            // The pose is exact at first: its error ellipse has no area before the vehicle moves.
            if number >= 50 {
                settled += 1.0;
                table.mean_nees += nees / runs;
                table.in_band += f64::from(u8::from(nees > band[0] && nees < band[1]));
            }
        }
        table.mean_nees /= settled;
        table.in_band /= settled;
        table.predicted_m = table.predicted_m.sqrt();
        table.rms_m = (errors_m.iter().map(|e| e * e).sum::<f64>() / errors_m.len() as f64).sqrt();
        errors_m.sort_by(f64::total_cmp);
        let place = (0.9 * errors_m.len() as f64) as usize;
        table.p90_m = errors_m.get(place).copied().unwrap_or(f64::NAN);
        table
    }
}
