//! Starts from scratch: from where on the road is the vehicle found, after what distance, and is it
//! there? `cargo run --release --example start_table -- [starts] [seed]`.

#![allow(clippy::print_stdout, reason = "this is a program")]

use std::error::Error;

use access_av::localize::gaussian::principal_variances;
use access_av::onboard::Custom;
use access_av::platform::Platform;
use access_av::random::{Purpose, Streams};
use access_av::scenario::Scenario;
use access_av::simulate::{Found, Simulation};
use rand::RngExt;

/// Road that is left ahead of the last starting point (m).
const AHEAD_M: f64 = 60.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let starts: u64 = arguments.next().map_or(Ok(100), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;

    println!("{starts} starts, seed {seed}; right: within 2 m and 4 standard deviations");
    println!(
        "scenario               direction  found  right  driven m: median   90 %   most  \
         time s: median   most"
    );
    for name in ["paper-real-odometry-2", "yard"] {
        for either in [false, true] {
            let scenario = Scenario::load(name)?.with_overrides([
                ("start.known", false.into()),
                ("start.either_direction", either.into()),
            ])?;
            let finds = search(&scenario, starts, seed)?;
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

/// Searches from each of the starting points; those in which the vehicle was found.
fn search(scenario: &Scenario, starts: u64, seed: u64) -> Result<Vec<Found>, Box<dyn Error>> {
    let platform = Platform::load(&scenario.platform.name)?;
    let length_m = scenario.build_track()?.length_m();
    let mut finds = Vec::new();
    for run in 0..starts {
        let mut random = Streams::new(seed, run).generator(Purpose::Start, 1);
        let start_m = random.random::<f64>() * (length_m - AHEAD_M);
        let there = scenario.with_overrides([("motion.start_at_m", start_m.into())])?;
        let simulation = Simulation::new(there, platform.clone())?;
        finds.extend(simulation.run(seed, run, Custom::default())?.found());
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
