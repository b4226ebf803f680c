//! Time offsets between angles and odometry of a recorded drive: a zero offset is not corrected,
//! and a real offset is.

use onboard::settings::{Shipped, TomlFile};
use recording::replay::{StartChoice, locate_angles};
use recording::{AngleLog, OdometryLog};
use simulate::scenario::Scenario;

use crate::common::{changed, logs};

/// Maximum time offset that is not corrected (s).
const MIN_S: f64 = 0.03;

/// Three standard deviations of an uncertain time offset (s), which is a filter state instead of a
/// correction.
const DOUBTED_S: f64 = 0.3;

/// Locates the first seconds of a recorded drive whose angles have late time stamps. Returns the
/// estimated time offset and its standard deviation (s).
fn found_s(
    scenario: &Scenario,
    (odometry, angles): (&OdometryLog, &AngleLog),
    start: StartChoice,
    until_s: f64,
    late_s: f64,
) -> [f64; 2] {
    let (mut odometry, mut angles) = (odometry.clone(), angles.clone());
    odometry.samples.retain(|it| it.time_s < until_s);
    angles
        .angles
        .retain(|it| it.ssb.time_s < until_s - late_s.max(0.0));
    for angle in &mut angles.angles {
        angle.ssb.time_s += late_s;
        angle.measured.time_s += late_s;
    }
    let (site, vehicle) = (&scenario.site, &scenario.vehicle);
    let located = locate_angles(site, vehicle, start, &odometry, &angles, false).unwrap();
    let found = located.constants.map(|it| it.angle_time_offset_s);
    found.map_or([0.0; 2], |it| [it.found, it.std])
}

/// Simulates a drive of the yard with equal clocks.
fn drive(seed: u64) -> (Scenario, OdometryLog, AngleLog, StartChoice) {
    let scenario = changed("yard", []);
    let (odometry, angles, record) = logs(&scenario, seed);
    let start = StartChoice::At(record.steps[0].truth);
    (scenario, odometry, angles, start)
}

#[test]
fn agreeing_clocks_are_not_corrected() {
    for seed in 0..3 {
        let (scenario, odometry, angles, start) = drive(seed);
        for until_s in [16.0, 60.0] {
            let [found_s, std_s] = found_s(&scenario, (&odometry, &angles), start, until_s, 0.0);
            let max_s = MIN_S.max(3.0 * std_s).min(DOUBTED_S);
            assert!(
                found_s.abs() < max_s,
                "seed {seed}, {until_s} s: {found_s} s ± {std_s} s"
            );
        }
    }
}

#[test]
fn a_time_offset_is_corrected() {
    for (seed, late_s) in [(0, 0.4), (1, -0.4)] {
        let (scenario, odometry, angles, start) = drive(seed);
        let [found_s, std_s] = found_s(&scenario, (&odometry, &angles), start, 150.0, late_s);
        let is_found = (found_s - late_s).abs() < 4.0 * std_s.max(0.01);
        assert!(
            is_found && found_s * late_s > 0.0,
            "{late_s} s: {found_s} s ± {std_s} s"
        );
    }
}

#[test]
#[ignore = "prints a table of many drives"]
fn table_of_agreeing_clocks() {
    let drives: u64 = std::env::var("CLOCK_DRIVES").map_or(20, |it| it.parse().unwrap());
    for seed in 0..drives {
        let (scenario, odometry, angles, start) = drive(seed);
        let without_road = [("vehicle.localizer.map", false.into())];
        let without_road = scenario.with_overrides(without_road, &Shipped).unwrap();
        for until_s in [15.0, 30.0, 60.0, 120.0] {
            for (name, scenario) in [("road", &scenario), ("no road", &without_road)] {
                let [found_s, std_s] = found_s(scenario, (&odometry, &angles), start, until_s, 0.0);
                println!("{seed} {name} {until_s} s: {found_s:.3} s ± {std_s:.3} s");
            }
        }
    }
}
