//! The channels of TR 38.901: comparison with another implementation, along a drive, and as
//! samples.

use crate::common;
use std::collections::BTreeMap;

use num_complex::Complex64;
use onboard::geometry::{Point, Pose};
use onboard::road::{Road, Segment};
use onboard::settings::{ArraySettings, Site, Vehicle};
use rand::RngExt;
use simulate::channel::tr38901::{Drop, Environment, LinkGeometry, draw_drops};
use simulate::channel::{Link, Propagation, Tr38901Propagation};
use simulate::random::{Purpose, Streams};
use simulate::scenario::{BlockageSettings, ChannelModel, ChannelSettings};
use simulate::world::{Antennas, LineOfSight};

use crate::common::{changed, run};

const DROPS: usize = 40_000;
const MODELS: [&str; 5] = ["umi", "inf-sl", "inf-dl", "inf-sh", "inf-dh"];

fn environment(model: &str) -> Environment {
    Environment::of(ChannelModel::named(model).unwrap(), 3.5, None).unwrap()
}

/// Returns the horizontal distances of `benches/tr38901_oracle.py`.
fn places(model: &str) -> Vec<LinkGeometry> {
    let (head_m, array_m, min_m, max_m) = match model {
        "umi" => (10.0, 1.5, 20.0, 120.0),
        "inf-sl" => (1.5, 1.5, 5.0, 60.0),
        "inf-dl" => (1.5, 1.5, 1.0, 10.0),
        "inf-sh" => (8.0, 1.5, 5.0, 120.0),
        _ => (8.0, 1.5, 1.0, 15.0),
    };
    let mut rng = Streams::new(3, 0).generator(Purpose::Start, 0);
    let place = |_| LinkGeometry {
        level_m: min_m + (max_m - min_m) * rng.random::<f64>(),
        head_m,
        array_m,
    };
    (0..DROPS).map(place).collect()
}

/// Name and value of a quantity of a drop.
type Quantity = (&'static str, fn(&Drop) -> f64);

/// All quantities of the oracle's table.
const QUANTITIES: [Quantity; 8] = [
    ("path_loss_db", |drop| drop.path_loss_db),
    ("shadowing_db", |drop| drop.shadowing_db),
    ("k_db", |drop| drop.k_db),
    ("delay_spread_ns", |drop| 1e9 * drop.delay_spread_s),
    ("azimuth_spread_deg", |drop| drop.azimuth_spread_deg),
    ("zenith_spread_deg", |drop| drop.zenith_spread_deg),
    ("paths_delay_spread_ns", |drop| {
        1e9 * drop.paths_delay_spread_s
    }),
    ("paths_azimuth_spread_deg", |drop| {
        drop.paths_azimuth_spread_deg
    }),
];

/// Compares the quantiles with Sionna's drops (`benches/tr38901_oracle.py`). The tolerance is 3 %:
/// of the value for powers, lengths and angles, and of the range from 5 to 95 % for decibels. For
/// rare states, it is the statistical uncertainty of the quantile.
#[test]
fn drops_agree_with_another_implementation() {
    let table = include_str!("data/tr38901_sionna.txt");
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(' ').collect();
    let probabilities: Vec<f64> = header[3..].iter().map(|p| p.parse().unwrap()).collect();
    let drops: BTreeMap<&str, Vec<Drop>> = MODELS
        .map(|model| (model, draw_drops(&environment(model), &places(model), 1)))
        .into();
    let (mut rows, mut failed) = (0, Vec::new());
    for line in lines {
        let fields: Vec<&str> = line.split(' ').collect();
        let [model, state, name] = fields[..3].try_into().unwrap();
        let expected: Vec<f64> = fields[3..]
            .iter()
            .map(|value| value.parse().unwrap())
            .collect();
        let drops = &drops[model];
        rows += 1;
        if state == "all" {
            let share =
                drops.iter().filter(|drop| drop.line_of_sight).count() as f64 / DROPS as f64;
            assert!((share / expected[0] - 1.0).abs() < 0.03, "{line}: {share}");
            continue;
        }
        let quantity = QUANTITIES.iter().find(|it| it.0 == name).unwrap().1;
        let of_state = drops
            .iter()
            .filter(|drop| drop.line_of_sight == (state == "clear"));
        let mut values: Vec<f64> = of_state.map(quantity).collect();
        values.sort_by(f64::total_cmp);
        let range = expected[expected.len() - 1] - expected[0];
        let mut worst = 0.0f64;
        for (p, expected) in probabilities.iter().zip(&expected) {
            let found = values[(p * (values.len() - 1) as f64).round() as usize];
            let unit = if name.ends_with("db") {
                range
            } else {
                *expected
            };
            let apart = (found - expected) / unit;
            worst = worst.max(apart.abs());
            let rank = values.partition_point(|value| value < expected) as f64;
            let count = values.len() as f64;
            // Four standard deviations; the oracle has 2.5 times as many drops.
            let stray = 4.0 * (1.4 * p * (1.0 - p) / count).sqrt();
            if apart.abs() >= 0.03 && (rank / count - p).abs() >= stray {
                failed.push(format!("{model} {state} {name} at {p}: {found} {expected}"));
            }
        }
        println!("{model} {state} {name}: {worst:.4}");
    }
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(rows >= 4 * (1 + 7 + 7));
}

const LENGTH_M: f64 = 2000.0;
const ELEMENTS: usize = 4;

/// Returns the propagation along a straight road past a radio head.
fn along_a_road(model: &str, settings: &ChannelSettings, run: u64) -> Tr38901Propagation {
    let trip = changed("paper-real-odometry-4", []); // radio heads and antennas at one height
    let (mut site, vehicle): (Site, Vehicle) = (trip.site, trip.vehicle);
    site.radio_heads[0].position_m = [HEAD.x_m, HEAD.y_m, 0.0];
    let straight = Segment {
        length_m: LENGTH_M,
        turn_rad: 0.0,
        surveyed: true,
    };
    let road = Road::from_segments(Pose::default(), &[straight], 5.0).unwrap();
    let link = Link {
        site: &site,
        vehicle: &vehicle,
        road: &road,
        duration_s: LENGTH_M,
        head: 0,
        streams: Streams::new(7, run),
    };
    Tr38901Propagation::new(environment(model), settings, &link).unwrap()
}

const HEAD: Point = Point::new(1000.0, 20.0);

/// Returns the line of sight of an array in the forward direction at a speed of 1 m/s.
fn sight(along_m: f64) -> LineOfSight {
    let place = Point::new(along_m, 0.0);
    let distance_m = place.distance_m(HEAD);
    LineOfSight {
        towards: [(HEAD.x_m - along_m) / distance_m, HEAD.y_m / distance_m],
        distance_m,
        place,
        axis_rad: 0.0,
        along_m,
        time_s: along_m,
    }
}

fn gains(channel: &Tr38901Propagation, along_m: f64) -> [Complex64; ELEMENTS] {
    let mut gains = [Complex64::ZERO; ELEMENTS];
    let antennas = Antennas::new(&ArraySettings::default());
    channel.response(&sight(along_m), &antennas, 0.0, &mut gains);
    gains
}

#[test]
fn mean_power_is_one_and_the_field_decorrelates_over_half_a_wavelength() {
    for model in MODELS {
        let (mut power, mut same, mut half) = (0.0, Complex64::ZERO, Complex64::ZERO);
        let mut count = 0.0;
        for run in 0..12 {
            let channel = along_a_road(model, &ChannelSettings::default(), run);
            for step in 0..60 {
                // Clusters are constant over metres; positions 33 m apart have different clusters.
                let along_m = 15.0 + 33.0 * f64::from(step);
                let here = gains(&channel, along_m)[0];
                power += here.norm_sqr();
                same += here.conj() * gains(&channel, along_m + 1e-4)[0];
                half += here.conj() * gains(&channel, along_m + 0.5)[0];
                count += 1.0;
            }
        }
        let (power, same, half) = (power / count, same.norm() / count, half.norm() / count);
        println!("{model}: power {power:.3}, at 0.1 mm {same:.3}, at 0.5 m {half:.3}");
        // The power of a Rician channel has a relative standard deviation of at most one.
        assert!(
            (power - 1.0).abs() < 4.0 / f64::sqrt(count),
            "{model}: {power}"
        );
        assert!((same / power - 1.0).abs() < 1e-3, "{model}: {same}");
        // The phase of the line of sight rotates by hundreds of radians on the way past the radio
        // head.
        assert!(half < 0.2, "{model}: {half}");
    }
}

#[test]
fn clusters_are_correlated_over_metres_only() {
    // Far from the radio head and without a line of sight, the power of a beam depends on the
    // clusters in the beam.
    let beam = |channel: &Tr38901Propagation, along_m: f64| {
        // An average over two wavelengths removes the fading of single rays.
        let gains_db = (0..24).map(|number| {
            let gains = gains(channel, along_m + 0.0071 * f64::from(number));
            let total: f64 = gains.iter().map(Complex64::norm_sqr).sum();
            gains.iter().sum::<Complex64>().norm_sqr() / total
        });
        gains_db.sum::<f64>() / 24.0
    };
    let lags_m = [0.0, 2.0, 30.0];
    let mut pairs = vec![Vec::new(); lags_m.len()];
    for run in 0..60 {
        let channel = along_a_road("inf-dl", &ChannelSettings::default(), run);
        for at_m in [60.0, 250.0, 440.0] {
            let here = beam(&channel, at_m);
            for (pairs, lag_m) in pairs.iter_mut().zip(lags_m) {
                pairs.push((here, beam(&channel, at_m + lag_m)));
            }
        }
    }
    let correlation = |pairs: &[(f64, f64)]| {
        let count = pairs.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
        let (a, b) = (mean(|it| it.0), mean(|it| it.1));
        let shared = pairs.iter().map(|it| (it.0 - a) * (it.1 - b)).sum::<f64>();
        let own: f64 = pairs.iter().map(|it| (it.0 - a).powi(2)).sum();
        let other: f64 = pairs.iter().map(|it| (it.1 - b).powi(2)).sum();
        shared / (own * other).sqrt()
    };
    let found: Vec<f64> = pairs.iter().map(|pairs| correlation(pairs)).collect();
    println!("{found:?}");
    assert!(found[1] > 0.4 && found[2].abs() < 0.3, "{found:?}");
}

#[test]
fn a_blocked_line_of_sight_becomes_free_again() {
    let settings = ChannelSettings {
        blockage: Some(BlockageSettings {
            per_minute: 2.0,
            duration_s: 5.0,
            loss_db: 60.0,
        }),
        ..ChannelSettings::default()
    };
    let (mut blocked, mut count) = (0, 0);
    for run in 0..20 {
        let [with, without] =
            [&settings, &ChannelSettings::default()].map(|it| along_a_road("umi", it, run));
        // Times within the duration of a blockage are dependent.
        for along_m in (0..2000).step_by(4).map(f64::from) {
            let apart = (gains(&with, along_m)[0] - gains(&without, along_m)[0]).norm();
            blocked += usize::from(apart > 0.0);
            count += 1;
        }
    }
    // The fraction of unblocked time is e^(−2/min · 5 s). The tolerance is 0.02 for ten thousand
    // independent times.
    let share = f64::from(blocked as u32) / f64::from(count as u32);
    assert!(
        (share - (1.0 - (-1.0f64 / 6.0).exp())).abs() < 0.02,
        "{share}"
    );
}

#[test]
fn oracle_nlos_rejection_removes_ssbs_without_line_of_sight() {
    let rejecting = ChannelSettings {
        oracle_nlos_rejection: true,
        ..ChannelSettings::default()
    };
    let (mut received, mut expected, mut places) = (0.0, 0.0, 0.0);
    for run in 0..40 {
        let [mut rejecting, mut all] =
            [&rejecting, &ChannelSettings::default()].map(|it| along_a_road("umi", it, run));
        // The line of sight exists at some of these positions.
        for along_m in (800..1200).map(f64::from) {
            let sight = sight(along_m);
            let [here, of_all] = [&mut rejecting, &mut all].map(|it| it.next_gain_db(&sight));
            let place = LinkGeometry {
                level_m: sight.distance_m,
                head_m: 10.0,
                array_m: 1.5,
            };
            places += 1.0;
            expected += environment("umi").line_of_sight_probability(&place);
            if here > f64::NEG_INFINITY {
                assert_eq!(here.to_bits(), of_all.to_bits());
                received += 1.0;
            }
        }
    }
    // Eight correlation distances in each of 40 drives: a standard deviation of at most 0.5/√320.
    // The limit is three of them.
    let (received, expected): (f64, f64) = (received / places, expected / places);
    println!("{received:.3} of the way, {expected:.3} expected");
    assert!((received - expected).abs() < 0.084 && expected > 0.2);
}

#[test]
fn a_drive_is_reproducible_and_works_with_samples() {
    for model in ["umi", "inf-sh"] {
        let short = [
            (
                "site.road.polyline_m",
                common::value("[[-140.0, 0.0], [-125.0, 0.0]]"),
            ),
            ("motion.stops", common::value("[]")),
            ("channel.model", model.into()),
        ];
        let snapshots = changed("yard", short.clone());
        let record = run(&snapshots, 4, 0);
        assert_eq!(record.steps, run(&snapshots, 4, 0).steps);
        let mut by_samples = snapshots;
        by_samples.fidelity = simulate::scenario::Fidelity::Iq;
        for (index, head) in by_samples.site.radio_heads.iter_mut().enumerate() {
            head.ssb_index = index as u8;
        }
        let samples = run(&by_samples, 4, 0);
        let angles = [&record, &samples].map(|it| it.aoa_estimates.len());
        println!("{model}: {angles:?} angles");
        assert!(
            angles.iter().all(|count| *count > 20),
            "{model}: {angles:?}"
        );
        // The mean SNR depends on the position only, not on the fidelity.
        for (a, b) in record.steps.iter().zip(&samples.steps) {
            assert_eq!(a.snr_db, b.snr_db);
        }
    }
}

#[test]
fn keys_without_a_meaning_for_the_model_are_rejected() {
    use onboard::settings::Shipped;
    use onboard::settings::TomlFile;
    let hall = "{ size_m = [50.0, 0.0, 8.0], clutter_density = 0.3, clutter_size_m = 3.0, \
                clutter_height_m = 2.0 }";
    let yard = common::unguarded("yard");
    for (key, value, message) in [
        (
            "channel.hall",
            hall.replace(" 0.0,", " 30.0,"),
            "allowed with an InF",
        ),
        ("channel.rays", "9".to_owned(), "remove these keys"),
        ("channel.model", "\"inf-xl\"".to_owned(), "inf-sl"),
        (
            "channel.blockage",
            "{ per_minute = -1.0 }".to_owned(),
            "channel.blockage.per_minute",
        ),
    ] {
        let mut overrides = vec![("channel.model", "umi".into())];
        overrides.push((key, common::value(&value)));
        let error = yard
            .with_overrides(overrides, &Shipped)
            .unwrap_err()
            .to_string();
        assert!(error.contains(message), "{error}");
    }
    let overrides = [("channel.oracle_nlos_rejection", true.into())];
    let error = yard.with_overrides(overrides, &Shipped).unwrap_err();
    assert!(error.to_string().contains("TR 38.901"), "{error}");
    let overrides = [
        ("channel.model", "inf-sl".into()),
        ("channel.hall", common::value(hall)),
    ];
    let error = yard
        .with_overrides(overrides, &Shipped)
        .unwrap_err()
        .to_string();
    assert!(error.contains("channel.hall.size_m"), "{error}");
}
