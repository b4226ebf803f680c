//! No allocation after initialisation.

use std::f64::consts::PI;

use onboard::localize::{AngleMeasurement, MeasurementKind};
use onboard::observation::{OdometrySample, SsbDetection};
use onboard::radio_head::RadioHead;
use onboard::settings::{Check, Shipped, TomlFile, UncertaintySettings, WakeUpSettings};
use onboard::{Custom, Pipeline};
use recording::LoggedAngle;
use simulate::scenario::Scenario;
use simulate::world::MotionProfile;

use crate::common::{Burst, changed, shipped, simulation, unguarded, value};
use crate::counting::allocations;

#[test]
fn allocations_are_counted() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![0_u8; 9]))), 1);
}

#[test]
fn a_drive_allocates_nothing_after_initialisation() {
    let guarded = || ("vehicle.integrity", value("{}"));
    let adapts = ("vehicle.receiver.multipath_bias_probability", value("0.1"));
    // A target error so small that every angle is required.
    let mut demanding = unguarded("yard");
    demanding.vehicle.wake_up = Some(WakeUpSettings::Uncertainty(UncertaintySettings {
        target_error_m: 1e-3,
        min_variance_reduction_m2: 0.0,
        ..UncertaintySettings::default()
    }));
    for (scenario, min_accepted) in [
        (unguarded("paper-real-odometry-4"), 2000),
        (changed("paper-real-odometry-4", [guarded()]), 2000),
        (changed("paper-real-odometry-4", [guarded(), adapts]), 2000),
        (demanding, 2000),
        (unguarded("yard"), 20),
        (shipped("paper"), 200),
    ] {
        for map in [true, false] {
            let tracks = scenario.name != "paper";
            let changes = [("vehicle.localizer.map", map.into())];
            let changes = changes.into_iter().filter(|_| tracks);
            let scenario = scenario.with_overrides(changes, &Shipped).unwrap();
            let accepted = drive(&scenario);
            let guarded = scenario.vehicle.integrity_monitor().is_some();
            println!(
                "{}, integrity {guarded}, map {map}: {accepted}",
                scenario.name
            );
            assert!(accepted > min_accepted, "{}: {accepted}", scenario.name);
        }
    }
}

/// Drives for about 20 s, the last 16 s without allocation. Returns the number of accepted angles.
fn drive(scenario: &Scenario) -> u32 {
    let road = scenario.path(Check { file: "test" }).unwrap();
    let (site, vehicle) = (&scenario.site, &scenario.vehicle);
    let motion = MotionProfile::new(&scenario.motion, vehicle, road.length_m());
    let heads = RadioHead::received_by(site, vehicle);
    let simulation = simulation(scenario);
    let platform = simulation.platform();
    let start = road.pose(0.0);
    let mut onboard = Pipeline::new(site, vehicle, platform, start, Custom::default()).unwrap();

    let integrity = vehicle.integrity_monitor().is_some();
    let mut accepted = 0;
    let mut burst = Vec::with_capacity(heads.len());
    let mut step = |number: u32| {
        let time_s = 0.02 * f64::from(number);
        let now = motion.at(time_s);
        let sample = OdometrySample {
            time_s,
            distance_m: now.along_m,
            speed_mps: now.speed_mps,
            yaw_rate_radps: Some(now.speed_mps * road.curvature_per_m(now.along_m)),
        };
        onboard.odometry(&sample).unwrap().unwrap();
        let pose = road.pose(now.along_m);
        burst.clear();
        for head in &heads {
            let angle_rad = pose.point().bearing_rad(head.position) - pose.heading_rad;
            // Outliers and ambiguous angles are included. With integrity monitoring, outliers are
            // omitted because they would be faults.
            let outlier = if number % 50 == 49 && !integrity {
                1.5
            } else {
                0.0
            };
            burst.push(LoggedAngle {
                ssb: SsbDetection {
                    pci: head.pci,
                    ssb_index: head.ssb_index,
                    time_s,
                    snr_db: 20.0,
                },
                measured: AngleMeasurement {
                    kind: MeasurementKind::Angle,
                    time_s,
                    phase_rad: PI * angle_rad.cos() + outlier,
                    phase_sigma_rad: 0.05,
                    angle_rad,
                    snr_db: 20.0,
                    resolved: !number.is_multiple_of(7),
                },
            });
        }
        let result = onboard.process_burst(time_s, &mut Burst(&burst)).unwrap();
        let aoa_estimates = result.aoa_estimates.iter();
        accepted += aoa_estimates.filter(|it| it.verdict.accepted).count() as u32;
        std::hint::black_box(onboard.pose(time_s)).unwrap();
        accepted > 0
    };
    // Warm-up: a few seconds of driving, and one second after the first angle, which confirms the
    // start.
    let (mut number, mut since_angle) = (0, 0);
    while number < 200 || (since_angle < 50 && number < 1000) {
        since_angle += u32::from(step(number));
        number += 1;
    }
    let count = allocations(|| {
        for number in number..number + 800 {
            step(number);
        }
    });
    assert_eq!(count, 0, "{}, integrity {integrity}", scenario.name);
    accepted
}
