//! Delays and range rates from samples in the localizer.

use crate::common;
use crate::common::{changed, value};
use onboard::localize::UpdateReason;
use onboard::range::RangeQuantity;
use onboard::settings::{Site, Vehicle};
use recording::replay::{LocatedDrive, StartChoice, locate_recording};
use recording::{Datatype, Recording, load, read_odometry_csv};
use simulate::scenario::Scenario;
use simulate::{SynthSettings, synthesize};
use toml::Value;

/// Clocks of radio heads and vehicle that are known to nanoseconds.
fn scenario(with_delays: bool) -> Scenario {
    let mut overrides = vec![
        ("fidelity", Value::from("iq")),
        (
            "site.road.segments",
            value("[{ length_m = 60.0, turn_rad = 0.1 }]"),
        ),
        ("site.radio_heads[1].ssb_index", Value::from(2)),
    ];
    if with_delays {
        overrides.push((
            "vehicle.ranging",
            value("{ kind = \"one-way\", clock_wander_ns_per_sqrt_s = 0.1 }"),
        ));
        for head in [
            "site.radio_heads[0].clock_wander_ns_per_sqrt_s",
            "site.radio_heads[1].clock_wander_ns_per_sqrt_s",
        ] {
            overrides.push((head, Value::from(0.1)));
        }
    }
    changed("paper-real-odometry-2", overrides)
}

fn rms_m(errors_m: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for error_m in errors_m {
        sum += error_m * error_m;
        count += 1.0;
    }
    f64::sqrt(sum / count)
}

#[test]
fn delays_of_simulated_samples_reach_the_filter() {
    let record = |with_delays| common::run(&scenario(with_delays), 3, 0);
    let (with, without) = (record(true), record(false));
    assert_eq!((without.ranges, without.accepted_ranges), (0, 0));
    // Each of the two SSBs of a burst has a delay and a range rate, except uncertain first paths.
    assert!(with.ranges > 3 * with.bursts_received, "{}", with.ranges);
    let accepted = with.accepted_ranges as f64 / with.ranges as f64;
    let rms = |it: &simulate::RunRecord| rms_m(it.steps.iter().map(simulate::Step::error_m));
    println!(
        "{} of {} accepted, RMS {:.3} m, angles alone {:.3} m",
        with.accepted_ranges,
        with.ranges,
        rms(&with),
        rms(&without)
    );
    assert!(accepted > 0.95, "{accepted}");
    assert!(rms(&with) < 1.2 * rms(&without));
}

#[test]
fn delays_of_a_recording_reach_the_filter() {
    let dir = common::scratch("delays");
    let settings = SynthSettings {
        seed: 2,
        run: 0,
        duration_s: Some(6.0),
        continuous: false,
        datatype: Datatype::Ci16Le,
    };
    let made = synthesize(&scenario(true), &settings, &dir, &mut |_| true).unwrap();
    let path = |name: &str| dir.join(name).display().to_string();
    let site: Site = load(&path("site.toml")).unwrap();
    let vehicle: Vehicle = load(&path("vehicle.toml")).unwrap();
    let odometry = read_odometry_csv(&dir.join("odometry.csv")).unwrap();
    let mut recording = Recording::open(&made.recording).unwrap();
    let start = StartChoice::AsSet;
    let drive: LocatedDrive = locate_recording(
        &site,
        &vehicle,
        start,
        &odometry,
        &mut recording,
        0.0,
        false,
    )
    .unwrap();
    let delays = drive
        .ranges
        .iter()
        .filter(|it| it.range.measured.quantity == RangeQuantity::Range);
    let outliers = delays
        .clone()
        .filter(|it| it.verdict.reason == UpdateReason::Outlier);
    assert!(delays.clone().count() > 200, "{}", delays.count());
    assert!(outliers.count() < 10);
}
