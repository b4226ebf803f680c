//! Search for an unknown start: fraction of starting points at which the vehicle is found, distance
//! driven until then, and correctness. Run with `cargo run --release -p simulate --example
//! start_table -- [starts] [seed]`.

#![allow(clippy::print_stdout, reason = "this is a program")]

mod common;

use onboard::Custom;
use onboard::gaussian::principal_variances;
use onboard::settings::{Check, Shipped, TomlFile};
use rand::RngExt;
use simulate::random::{Purpose, Streams};
use simulate::scenario::Scenario;
use simulate::{Found, Simulation};

use common::{Result, arguments, changed};

/// Minimum distance from a starting point to the end of the road (m).
const AHEAD_M: f64 = 60.0;

fn main() -> Result<()> {
    let (starts, seeds) = arguments(100, 1)?;
    let seed = seeds.first().copied().unwrap_or_default();

    println!("{starts} starts, seed {seed}; right: within 2 m and 4 standard deviations");
    println!(
        "scenario               direction  found  right  driven m: median   90 %   most  \
         time s: median   most"
    );
    for name in ["paper-real-odometry-2", "yard"] {
        for either in [false, true] {
            let unknown = [
                ("vehicle.start.known", false.into()),
                ("vehicle.start.either_direction", either.into()),
            ];
            let finds = search(&changed(name, unknown)?, starts as u64, seed)?;
            let sorted = |of: fn(&Found) -> f64| {
                let mut values: Vec<f64> = finds.iter().map(of).collect();
                values.sort_by(f64::total_cmp);
                values
            };
            let (driven_m, time_s) = (sorted(|it| it.driven_m), sorted(|it| it.step.time_s));
            let quantile = |values: &[f64], share: f64| {
                let place = (share * (values.len().saturating_sub(1)) as f64).round() as usize;
                values.get(place).copied().unwrap_or(f64::NAN)
            };
            println!(
                "{name:22} {:9} {:6} {:6} {:17.1} {:6.1} {:6.1} {:15.1} {:6.1}",
                if either { "either" } else { "along" },
                finds.len(),
                finds.iter().filter(|it| is_right(it)).count(),
                quantile(&driven_m, 0.5),
                quantile(&driven_m, 0.9),
                quantile(&driven_m, 1.0),
                quantile(&time_s, 0.5),
                quantile(&time_s, 1.0),
            );
        }
    }
    Ok(())
}

/// Searches from each starting point and returns the successful searches.
fn search(scenario: &Scenario, starts: u64, seed: u64) -> Result<Vec<Found>> {
    let file = &scenario.name;
    let length_m = scenario.path(Check { file })?.length_m();
    let mut finds = Vec::new();
    for run in 0..starts {
        let mut random = Streams::new(seed, run).generator(Purpose::Start, 1);
        let start_m = random.random::<f64>() * (length_m - AHEAD_M);
        let there = [("motion.start_at_m", start_m.into())];
        let there = scenario.with_overrides(there, &Shipped)?;
        let simulation = Simulation::on_its_platform(&there)?;
        let record = simulation.run(seed, run, &|_| Ok(Custom::default()))?;
        finds.extend(record.found());
    }
    Ok(finds)
}

fn is_right(found: &Found) -> bool {
    let error_m = found
        .step
        .truth
        .point()
        .distance_m(found.step.estimate.point());
    let [[xx, xy, _], [_, yy, _], _] = found.step.covariance.unwrap_or_default();
    let [larger_m2, _] = principal_variances(xx, xy, yy);
    error_m < 2.0 && error_m < 4.0 * larger_m2.sqrt()
}
