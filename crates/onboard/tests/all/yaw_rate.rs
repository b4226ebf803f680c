//! Use of a good gyroscope: in bends, and with lost samples.

use std::f64::consts::TAU;
use std::sync::Arc;

use onboard::geometry::wrap_angle;
use onboard::localize::Ekf;
use onboard::localize::InitialPose;
use onboard::localize::ekf::EkfConfig;
use onboard::observation::OdometrySample;
use onboard::road::Road;
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};

const PERIOD_S: f64 = 0.1;

/// Creates a road that consists of a straight and a bend of 30 m radius.
fn road() -> Road {
    let text = "name = 'bend'\nradio_heads = [{ position_m = [50.0, 50.0, 0.0] }]\n[road]\n\
                segments = [{ length_m = 40.0 }, { length_m = 45.0, turn_rad = 1.5 }]";
    let site = Site::from_toml(text, "site.toml", &Shipped).unwrap();
    site.build_road().unwrap().unwrap()
}

/// Creates a tracker with a good gyroscope and a poor odometer at the beginning of the road, with
/// or without a map of the road.
fn tracker(map: bool, position_std_m: f64) -> Ekf {
    let site = Site::from_library("trip-1", &Shipped).unwrap();
    let text = "name = 'tug'\n[gyroscope]\nnoise_rad_per_sqrt_s = 1e-4\n\
                [odometer]\nrate_hz = 10.0\nnoise_m_per_sqrt_m = 0.1\n\
                [lane_keeping]\nrms_m = 0.1\nwavelength_m = 30.0";
    let vehicle = Vehicle::from_toml(text, "vehicle.toml", &Shipped).unwrap();
    let mut config = EkfConfig::new(&site, &vehicle);
    config.yaw_rate_bias_std_radps = 0.0;
    let start = InitialPose {
        pose: road().pose(0.0),
        position_std_m,
        heading_std_rad: 0.001,
    };
    Ekf::new(config, map.then(|| Arc::new(road())), &[], &start)
}

#[test]
fn a_gyroscope_corrects_the_odometer_in_a_bend() {
    let (road, mut tracker) = (road(), tracker(true, 0.05));
    let (mut read_m, mut along_m) = (0.0, 0.0);
    for number in 0..800 {
        let time_s = PERIOD_S * f64::from(number);
        let turn_rad = road.pose(along_m).heading_rad - road.pose(along_m - 0.1).heading_rad;
        tracker.odometry(&OdometrySample {
            time_s,
            distance_m: read_m,
            speed_mps: 1.0,
            yaw_rate_radps: Some(wrap_angle(turn_rad) / PERIOD_S),
        });
        along_m += 0.1;
        // From the middle of the bend, the odometer measures 10 % too much for 5 m.
        let reads_more = (50.0..55.0).contains(&along_m);
        read_m += if reads_more { 0.11 } else { 0.1 };
    }
    let off_m = tracker
        .pose(80.0)
        .pose
        .point()
        .distance_m(road.pose(along_m - 0.1).point());
    assert!(
        off_m < 0.1,
        "{off_m} m off, of 0.5 m that the odometer read too much"
    );
}

#[test]
fn the_heading_change_during_lost_samples_is_unknown() {
    for map in [true, false] {
        let mut tracker = tracker(map, 0.05);
        // The heading oscillates by 0.05 rad with a period of 4 s; every fifth sample is lost.
        let heading_rad = |time_s: f64| 0.05 * (TAU * time_s / 4.0).sin();
        let mut worst_sigmas = 0.0_f64;
        for number in 0..350_u32 {
            let time_s = PERIOD_S * f64::from(number);
            if number % 5 == 4 {
                continue;
            }
            let turn_rad = heading_rad(time_s) - heading_rad(time_s - PERIOD_S);
            tracker.odometry(&OdometrySample {
                time_s,
                distance_m: time_s,
                speed_mps: 1.0,
                yaw_rate_radps: Some(turn_rad / PERIOD_S),
            });
            let belief = tracker.pose(time_s);
            let [_, _, [_, _, variance]] = belief.covariance.unwrap();
            let error_rad = belief.pose.heading_rad - heading_rad(time_s);
            worst_sigmas = worst_sigmas.max(error_rad.abs() / variance.sqrt());
        }
        assert!(worst_sigmas < 4.0, "map {map}: {worst_sigmas}");
    }
}

#[test]
fn ends_of_a_bend_determine_the_position() {
    for ahead_m in [-1.5, 1.5] {
        let (road, mut tracker) = (road(), tracker(true, 1.0));
        for number in 0..800 {
            let driven_m = 0.1 * f64::from(number);
            let at = |driven_m: f64| road.pose(ahead_m + driven_m);
            let turn_rad = at(driven_m).heading_rad - at(driven_m - 0.1).heading_rad;
            tracker.odometry(&OdometrySample {
                time_s: PERIOD_S * f64::from(number),
                distance_m: driven_m,
                speed_mps: 1.0,
                yaw_rate_radps: Some(wrap_angle(turn_rad) / PERIOD_S),
            });
        }
        let truth = road.pose(ahead_m + 79.9).point();
        let off_m = tracker.pose(79.9).pose.point().distance_m(truth);
        assert!(off_m < 0.75, "{off_m} m off, {ahead_m} m at first");
    }
}
