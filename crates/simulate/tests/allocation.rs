//! A vehicle that drives for years allocates nothing once under way.
#![allow(clippy::unwrap_used, reason = "this is a test")]

#[path = "../../nr-ssb/tests/counting/mod.rs"]
mod counting;

use std::f64::consts::PI;

use access_av::localize::AngleMeasurement;
use access_av::observation::{OdometrySample, SensedSsb};
use access_av::onboard::{Custom, Onboard};
use access_av::platform::Platform;
use access_av::scenario::Scenario;
use access_av::world::{MotionProfile, RadioHead};

use counting::allocations;

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![0_u8; 9]))), 1);
}

#[test]
fn a_drive_under_way_allocates_nothing() {
    for (name, integrity) in [
        ("paper-real-odometry-4", false),
        ("paper-real-odometry-4", true),
        ("yard", false),
    ] {
        for map in [true, false] {
            let scenario = Scenario::load(name)
                .unwrap()
                .with_overrides([
                    ("localizer.integrity", toml::Value::from(integrity)),
                    ("localizer.map", map.into()),
                ])
                .unwrap();
            let track = scenario.build_track().unwrap();
            let motion = MotionProfile::new(&scenario.motion, track.length_m());
            let heads: Vec<RadioHead> = scenario.radio_heads.iter().map(RadioHead::from).collect();
            let platform = Platform::load(&scenario.platform.name).unwrap();
            let mut onboard =
                Onboard::new(&scenario, &platform, track.pose(0.0), Custom::default()).unwrap();

            let mut accepted = 0;
            let mut step = |number: u32| {
                let time_s = 0.02 * f64::from(number);
                let now = motion.at(time_s);
                let sample = OdometrySample {
                    time_s,
                    distance_m: now.along_m,
                    speed_mps: now.speed_mps,
                    yaw_rate_radps: Some(now.speed_mps * track.curvature_per_m(now.along_m)),
                };
                onboard.odometry(&sample).unwrap();
                let pose = track.pose(now.along_m);
                for head in &heads {
                    let ssb = SensedSsb {
                        pci: head.pci,
                        ssb_index: head.ssb_index,
                        time_s,
                        snr_db: 20.0,
                    };
                    onboard.listens(time_s);
                    onboard.consider(time_s, &[ssb]).unwrap();
                    let angle_rad = pose.point().bearing_rad(head.position) - pose.heading_rad;
                    // Outliers and angles of which nothing is sure are part of it; to a guard,
                    // outliers are a fault.
                    let outlier = if number % 50 == 49 && !integrity {
                        1.5
                    } else {
                        0.0
                    };
                    let measured = AngleMeasurement {
                        time_s,
                        phase_rad: PI * angle_rad.cos() + outlier,
                        phase_sigma_rad: 0.05,
                        angle_rad,
                        snr_db: 20.0,
                        resolved: !number.is_multiple_of(7),
                    };
                    let execution = onboard.take_in(ssb, Some(measured));
                    accepted += u32::from(execution.verdict.accepted);
                }
                std::hint::black_box(onboard.pose());
            };
            // Once warm: a few seconds of driving.
            (0..200).for_each(&mut step);
            let count = allocations(|| (200..1000).for_each(&mut step));
            assert_eq!(count, 0, "{name}, integrity {integrity}, map {map}");
            assert!(accepted > 2000, "{name}: {accepted}");
        }
    }
}
