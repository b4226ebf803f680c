//! Deviations of the truth from the nominal models.

use crate::common;
use std::f64::consts::PI;

use onboard::geometry::wrap_angle;
use onboard::settings::{SettingsError, Shipped, TomlFile};
use simulate::random::Streams;
use simulate::scenario::Scenario;
use simulate::truth::{Truth, World};
use toml::Value;

use crate::common::{changed, shipped, unguarded, value};

const RUNS: u64 = 2000;

/// Returns a scenario in which every uncertain value has a standard deviation.
fn uncertain(more: &[(&'static str, Value)]) -> Scenario {
    let mut changes: Vec<(&str, Value)> = [
        ("site.radio_heads[0].position_std_m", 0.3),
        ("site.radio_heads[0].eirp_std_db", 2.0),
        ("site.radio_heads[1].position_std_m", 0.1),
        ("vehicle.array.mounting_std_rad", 0.02),
        ("vehicle.array.phase_std_rad", 0.1),
        ("vehicle.array.position_std_m", 0.05),
        ("vehicle.odometer.scale_std", 0.004),
        ("vehicle.receiver.angle_time_offset_std_s", 0.02),
        ("vehicle.start.position_std_m", 0.5),
        ("vehicle.start.heading_std_rad", 0.05),
    ]
    .map(|(key, std)| (key, Value::from(std)))
    .into();
    changes.push(("vehicle.gyroscope", value("{ bias_std_radps = 1e-3 }")));
    changes.extend(more.iter().cloned());
    changed("paper-real-odometry-2", changes)
}

fn draw(scenario: &Scenario, run: u64) -> Truth {
    World::new(scenario).unwrap().draw(Streams::new(9, run))
}

/// Returns name, deviation and standard deviation of each quantity of a run.
fn departures(scenario: &Scenario, truth: &Truth) -> Vec<(&'static str, f64, f64)> {
    let (site, vehicle) = (&scenario.site, &scenario.vehicle);
    let by_head = |index: usize, axis: usize| {
        let [true_m, nominal_m] = [&truth.site, site].map(|it| it.radio_heads[index].position_m);
        true_m[axis] - nominal_m[axis]
    };
    let by_array_m =
        |axis: usize| truth.vehicle.array.position_m[axis] - vehicle.array.position_m[axis];
    let at_start = truth.path.at(0.0).pose;
    let (array, drawn) = (&vehicle.array, &truth.vehicle.array);
    let gyroscopes = (truth.vehicle.gyroscope.unwrap(), vehicle.gyroscope.unwrap());
    let eirp_db = truth.site.radio_heads[0].eirp_dbm - site.radio_heads[0].eirp_dbm;
    vec![
        ("first head, x", by_head(0, 0), 0.3),
        ("first head, y", by_head(0, 1), 0.3),
        ("second head, x", by_head(1, 0), 0.1),
        ("second head, y", by_head(1, 1), 0.1),
        ("power", eirp_db, 2.0),
        ("mounting", drawn.mounting_rad - array.mounting_rad, 0.02),
        ("phase", drawn.phase_rad - array.phase_rad, 0.1),
        ("array, forward", by_array_m(0), 0.05),
        ("array, left", by_array_m(1), 0.05),
        (
            "odometer",
            truth.vehicle.odometer.scale - vehicle.odometer.scale,
            0.004,
        ),
        (
            "gyroscope",
            gyroscopes.0.bias_radps - gyroscopes.1.bias_radps,
            1e-3,
        ),
        (
            "clock",
            truth.vehicle.receiver.angle_time_offset_s - vehicle.receiver.angle_time_offset_s,
            0.02,
        ),
        ("start, x", truth.given_start.x_m - at_start.x_m, 0.5),
        ("start, y", truth.given_start.y_m - at_start.y_m, 0.5),
        (
            "start, heading",
            truth.given_start.heading_rad - at_start.heading_rad,
            0.05,
        ),
    ]
}

#[test]
fn all_uncertain_values_are_drawn_independently_with_their_standard_deviation() {
    let scenario = uncertain(&[]);
    let world = World::new(&scenario).unwrap();
    let runs: Vec<_> = (0..RUNS)
        .map(|run| departures(&scenario, &world.draw(Streams::new(9, run))))
        .collect();
    let count = RUNS as f64;
    let quantities = runs[0].len();
    for first in 0..quantities {
        let (name, _, std) = runs[0][first];
        let mean = runs.iter().map(|run| run[first].1 / std).sum::<f64>() / count;
        // Four standard deviations of a sample mean.
        assert!(mean.abs() < 4.0 / count.sqrt(), "{name}: {mean}");
        for second in first..quantities {
            let product = |run: &Vec<(&str, f64, f64)>| {
                run[first].1 / run[first].2 * run[second].1 / run[second].2
            };
            let found = runs.iter().map(product).sum::<f64>() / count;
            // Four standard deviations of a sample variance and a sample covariance.
            let (expected, deviation) = if first == second {
                (1.0, (2.0 / count).sqrt())
            } else {
                (0.0, (1.0 / count).sqrt())
            };
            let other = runs[0][second].0;
            assert!(
                (found - expected).abs() < 4.0 * deviation,
                "{name}, {other}: {found}"
            );
        }
    }
}

#[test]
fn heights_and_values_without_a_standard_deviation_are_nominal() {
    let scenario = uncertain(&[]);
    let truth = draw(&scenario, 3);
    for (drawn, nominal) in (truth.site.radio_heads.iter()).zip(&scenario.site.radio_heads) {
        assert_eq!(drawn.position_m[2], nominal.position_m[2]);
    }
    assert_eq!(
        truth.site.radio_heads[1].eirp_dbm,
        scenario.site.radio_heads[1].eirp_dbm
    );
    assert_eq!(truth.vehicle.array.position_m[2], 0.0);
    let certain = unguarded("paper-real-odometry-2");
    let truth = draw(&certain, 3);
    assert_eq!(truth.site, certain.site);
    assert_eq!(truth.given_start, truth.path.at(0.0).pose);
}

#[test]
fn seeds_and_runs_determine_the_draws() {
    let scenario = uncertain(&[]);
    let world = World::new(&scenario).unwrap();
    let by = |seed, run| departures(&scenario, &world.draw(Streams::new(seed, run)));
    assert_eq!(by(9, 0), by(9, 0));
    let (first, next, other) = (by(9, 0), by(9, 1), by(10, 0));
    for ((first, next), other) in first.iter().zip(&next).zip(&other) {
        assert!(first.1 != next.1 && first.1 != other.1, "{}", first.0);
    }
}

#[test]
fn std_factor_scales_all_deviations_and_zero_removes_them() {
    let once = uncertain(&[]);
    let thrice = uncertain(&[("truth.std_factor", 3.0.into())]);
    let by = |scenario: &Scenario| departures(scenario, &draw(scenario, 1));
    for ((name, once, _), (_, thrice, _)) in by(&once).into_iter().zip(by(&thrice)) {
        assert!(
            (thrice - 3.0 * once).abs() < 1e-9,
            "{name}: {once} {thrice}"
        );
    }
    let none = uncertain(&[("truth.std_factor", 0.0.into())]);
    let truth = draw(&none, 1);
    assert_eq!((&truth.site, &truth.vehicle), (&none.site, &none.vehicle));
    assert_eq!(truth.given_start, truth.path.at(0.0).pose);
}

#[test]
fn a_given_true_value_applies_to_every_run() {
    let heads = "{ roadside.position_m = [200.0, 90.0, 5.0], all.eirp_dbm = 3.0 }";
    let scenario = uncertain(&[
        ("truth.site.radio_heads", value(heads)),
        ("truth.vehicle.array.mounting_rad", 0.1.into()),
        ("truth.vehicle.odometer.scale", 1.05.into()),
        ("truth.vehicle.receiver.angle_time_offset_s", 0.03.into()),
    ]);
    for run in 0..20 {
        let Truth { site, vehicle, .. } = draw(&scenario, run);
        let [first, second] = &site.radio_heads[..] else {
            panic!("{site:?}")
        };
        assert_eq!(first.position_m, [200.0, 90.0, 5.0]);
        assert_eq!((first.eirp_dbm, second.eirp_dbm), (3.0, 3.0));
        assert_eq!(
            (vehicle.array.mounting_rad, vehicle.odometer.scale),
            (0.1, 1.05)
        );
        assert_eq!(vehicle.receiver.angle_time_offset_s, 0.03);
        // Values that are not given are drawn.
        assert_ne!(second.position_m, scenario.site.radio_heads[1].position_m);
        assert_ne!(vehicle.array.phase_rad, 0.0);
    }
    // The nominal models do not change.
    let nominal = uncertain(&[]);
    assert_eq!(scenario.vehicle, nominal.vehicle);
    assert_eq!(scenario.site, nominal.site);
}

#[test]
fn a_true_value_with_a_standard_deviation_is_drawn_around_the_value() {
    let scenario = uncertain(&[
        ("truth.vehicle.array.mounting_rad", 0.1.into()),
        ("truth.vehicle.array.mounting_std_rad", 0.01.into()),
    ]);
    let world = World::new(&scenario).unwrap();
    let squares = (0..RUNS).map(|run| {
        let drawn_rad = world.draw(Streams::new(9, run)).vehicle.array.mounting_rad;
        (drawn_rad - 0.1).powi(2)
    });
    let ratio = squares.sum::<f64>() / RUNS as f64 / 0.01_f64.powi(2);
    assert!(
        (ratio - 1.0).abs() < 4.0 * (2.0 / RUNS as f64).sqrt(),
        "{ratio}"
    );
}

#[test]
fn deviations_change_the_simulated_signals() {
    let exact = [
        ("truth.std_factor", 0.0.into()),
        ("truth.vehicle.odometer.scale", 1.1.into()),
        ("truth.vehicle.odometer.noise_m_per_sqrt_m", 0.0.into()),
        ("truth.vehicle.lane_keeping.rms_m", 0.0.into()),
        ("truth.vehicle.top_speed_kmh", 7.5.into()),
        ("truth.vehicle.array.position_m", value("[2.0, 0.0, 0.0]")),
    ];
    let mut truth = draw(&changed("paper-real-odometry-2", exact), 0);
    let there = truth.path.at(50.0);
    assert!((there.speed_mps - 7.5 / 3.6).abs() < 1e-9 && there.lateral_m == 0.0);
    let sample = truth.odometer.sample(there).unwrap();
    assert!((sample.distance_m - 1.1 * there.along_m).abs() < 1e-9);
    assert!((sample.speed_mps - 1.1 * there.speed_mps).abs() < 1e-9);
    let received = truth.path.at_reception(50.0, 0.2);
    assert!((there.along_m - received.along_m - 0.2 * there.speed_mps).abs() < 1e-9);
    assert_eq!(received.time_s, 50.0);
    let sight = truth.array.line_of_sight(&there, &truth.heads[0]);
    let eye = there.pose.point_at(2.0, 0.0);
    assert!((sight.distance_m - eye.distance_m(truth.heads[0].position)).abs() < 1e-9);

    let road = value("[{ length_m = 120.0, turn_rad = 0.0 }]");
    let shorter = changed(
        "paper-real-odometry-2",
        [("truth.site.road.segments", road)],
    );
    assert_eq!(shorter.site, unguarded("paper-real-odometry-2").site);
    let end = draw(&shorter, 0).path.at(1e3);
    assert!((end.along_m - 120.0).abs() < 1e-9);
}

#[test]
fn angles_with_late_time_stamps_refer_to_earlier_positions() {
    const LATE_S: f64 = 0.2;
    for fidelity in ["snapshots", "iq"] {
        for configured_s in [0.0, LATE_S] {
            let scenario = changed(
                "paper-real-odometry-2",
                [
                    ("fidelity", fidelity.into()),
                    ("site.road.segments", value("[{ length_m = 60.0 }]")),
                    ("site.rician_k_db", 90.0.into()),
                    // A different SSB index gives a different reception time.
                    ("site.radio_heads[1].ssb_index", 2.into()),
                    ("vehicle.receiver.angle_time_offset_s", configured_s.into()),
                    ("truth.vehicle.receiver.angle_time_offset_s", LATE_S.into()),
                ],
            );
            let truth = draw(&scenario, 0);
            let [mut sum, mut information] = [0.0; 2];
            for angle_result in &common::run(&scenario, 9, 0).aoa_estimates {
                let measured = angle_result.measured.unwrap();
                // The vehicle subtracts the specified time offset.
                assert_eq!(measured.time_s, angle_result.ssb.time_s - configured_s);
                let head = truth.heads.iter().find(|it| it.pci == angle_result.ssb.pci);
                let phase_at = |time_s| {
                    let there = truth.path.at(time_s);
                    let sight = truth.array.line_of_sight(&there, head.unwrap());
                    PI * sight.towards[0]
                };
                let expected_rad = phase_at(measured.time_s);
                let rate_radps = (expected_rad - phase_at(measured.time_s - LATE_S)) / LATE_S;
                let error_rad = wrap_angle(measured.phase_rad - expected_rad);
                let weight = measured.phase_sigma_rad.powi(-2);
                sum -= weight * rate_radps * error_rad;
                information += weight * rate_radps * rate_radps;
            }
            // Least-squares estimate and its standard deviation.
            let (found_s, std_s) = (sum / information, information.sqrt().recip());
            assert!(std_s < 0.05 * LATE_S, "{fidelity}: {std_s}");
            assert!(
                (found_s - (LATE_S - configured_s)).abs() < 4.0 * std_s,
                "{fidelity}, configured {configured_s}: {found_s} ± {std_s}"
            );
        }
    }
}

#[test]
fn invalid_deviations_are_rejected() {
    for (name, key, value, rejected_key, allowed) in [
        (
            "yard",
            "truth.std_facto",
            Value::from(0.0),
            "truth.std_facto",
            "did you mean `std_factor`?",
        ),
        (
            "yard",
            "truth.std_factor",
            (-1.0).into(),
            "truth.std_factor",
            "it must be between 0 and 1000",
        ),
        (
            "yard",
            "truth.vehicle.array.mountng_rad",
            0.1.into(),
            "truth.vehicle.array.mountng_rad",
            "did you mean `mounting_rad`?",
        ),
        (
            "yard",
            "truth.vehicle.aray.mounting_rad",
            0.1.into(),
            "truth.vehicle.aray",
            "did you mean `array`?",
        ),
        (
            "yard",
            "truth.vehicle.array.mounting_rad",
            4.0.into(),
            "truth.vehicle.array.mounting_rad",
            "it must be between -3.2 and 3.2",
        ),
        (
            "yard",
            "truth.vehicle.receiver.angle_time_offset_s",
            0.5.into(),
            "truth.vehicle.receiver.angle_time_offset_s",
            "it must be between -1 and 0.4",
        ),
        (
            "yard",
            "truth.vehicle.receiver.angle_time_offset_std_s",
            (-0.1).into(),
            "truth.vehicle.receiver.angle_time_offset_std_s",
            "it must be between 0 and 0.5",
        ),
        (
            "yard",
            "truth.vehicle.array.gain_drift_db_per_sqrt_m",
            11.0.into(),
            "truth.vehicle.array.gain_drift_db_per_sqrt_m",
            "it must be between 0 and 10",
        ),
        (
            "yard",
            "truth.vehicle.gyroscope.bias_radps",
            0.01.into(),
            "truth.vehicle.gyroscope",
            "the nominal model has no such key",
        ),
        (
            "yard",
            "truth.vehicle.array.channel_gains",
            toml::Value::Array(vec![]),
            "truth.vehicle.array.channel_gains",
            "iq.channel_phase_rad",
        ),
        (
            "yard",
            "truth.vehicle.localizer.kind",
            "dead-reckoning".into(),
            "truth.vehicle.localizer",
            "only in physical keys: array, odometer",
        ),
        (
            "yard",
            "truth.vehicle.name",
            "other".into(),
            "truth.vehicle.name",
            "only in physical keys: array, odometer",
        ),
        (
            "yard",
            "truth.site.carrier_mhz",
            3600.0.into(),
            "truth.site.carrier_mhz",
            "only in physical keys: road, radio_heads, rician_k_db",
        ),
        (
            "yard",
            "truth.site.radio_heads.gaet.eirp_dbm",
            3.0.into(),
            "truth.site.radio_heads.gaet",
            "the entries are named gate, hall, dock, store, or all",
        ),
        (
            "yard",
            "truth.site.radio_heads.gate.eirp_dbn",
            3.0.into(),
            "truth.site.radio_heads[0].eirp_dbn",
            "did you mean `eirp_dbm`?",
        ),
        (
            "yard",
            "truth.site.radio_heads.gate",
            3.0.into(),
            "truth.site.radio_heads.gate",
            "it must be a table of the entry's keys",
        ),
    ] {
        let refused: SettingsError = shipped(name)
            .with_overrides([(key, value)], &Shipped)
            .unwrap_err();
        let message = refused.to_string();
        assert!(
            message.starts_with("yard with overrides: ")
                && message.contains(&format!("`{rejected_key}`")),
            "{key}: {message}"
        );
        assert!(message.contains(allowed), "{key}: {message}");
    }
}
