//! A vehicle with two driven wheels.

use onboard::geometry::Pose;
use onboard::localize::built_in;
use onboard::localize::ekf::EkfConfig;
use onboard::observation::OdometrySample;
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};

const VEHICLE: &str = "
name = 'agv'
drive = 'differential'
[odometer]
scale_std = 0.003
noise_m_per_sqrt_m = 0.01
[gyroscope]
noise_rad_per_sqrt_s = 0.002
bias_std_radps = 0.002
[start]
position_std_m = 0.01
heading_std_rad = 0.005
";

/// Returns the odometry of three sections, at 50 samples per second: five metres, a left turn by
/// 90° on the spot, and five metres.
fn legs(sees_turns: bool) -> Vec<OdometrySample> {
    let (mut samples, mut distance_m) = (Vec::new(), 0.0);
    for (seconds, speed_mps, yaw_rate_radps) in [
        (5.0, 1.0, 0.0),
        (3.0, 0.0, std::f64::consts::FRAC_PI_2 / 3.0),
        (5.0, 1.0, 0.0),
    ] {
        for _ in 0..(50.0 * seconds) as usize {
            distance_m += 0.02 * speed_mps;
            samples.push(OdometrySample {
                time_s: 0.02 * (samples.len() + 1) as f64,
                distance_m,
                speed_mps,
                yaw_rate_radps: sees_turns.then_some(yaw_rate_radps),
            });
        }
    }
    samples
}

fn end(sees_turns: bool) -> (Pose, [f64; 3]) {
    let site = Site::from_library("trip-2", &Shipped).unwrap();
    let vehicle = Vehicle::from_toml(VEHICLE, "agv", &Shipped).unwrap();
    let mut localizer = built_in(&site, &vehicle, Pose::default()).unwrap();
    let standing = OdometrySample {
        time_s: 0.0,
        distance_m: 0.0,
        speed_mps: 0.0,
        yaw_rate_radps: sees_turns.then_some(0.0),
    };
    for sample in [standing].iter().chain(&legs(sees_turns)) {
        assert!(localizer.odometry(sample).unwrap().accepted());
    }
    let estimate = localizer.pose(13.0).unwrap();
    let covariance = estimate.covariance.unwrap();
    (estimate.pose, [0, 1, 2].map(|i| covariance[i][i].sqrt()))
}

#[test]
fn a_vehicle_that_turns_on_the_spot_is_tracked() {
    let (pose, [x_std_m, y_std_m, heading_std_rad]) = end(true);
    assert!((pose.heading_rad - std::f64::consts::FRAC_PI_2).abs() < 3.0 * heading_std_rad);
    assert!((pose.x_m - 5.0).abs() < 3.0 * x_std_m && (pose.y_m - 5.0).abs() < 3.0 * y_std_m);
    // Error according to the data sheet after thirteen seconds: bias, standard deviation of the
    // noise, and scale of the wheels, which measure the turn and the distance. The times at which
    // the turn began and ended between two samples are uniformly distributed.
    let change_rad = 0.02 * std::f64::consts::FRAC_PI_2 / 3.0;
    let heading_rad = (0.005_f64.powi(2)
        + (0.002 * 13.0_f64).powi(2)
        + (0.003 * std::f64::consts::FRAC_PI_2).powi(2)
        + 0.002_f64.powi(2) * 13.0
        + 2.0 * change_rad.powi(2) / 12.0)
        .sqrt();
    assert!(
        (heading_std_rad / heading_rad - 1.0).abs() < 1e-6,
        "{heading_std_rad}"
    );
}

#[test]
fn without_a_yaw_rate_the_heading_is_uncertain() {
    let (pose, [_, y_std_m, heading_std_rad]) = end(false);
    assert!(heading_std_rad > 1.5 && (pose.y_m - 5.0).abs() < 3.0 * y_std_m);
}

#[test]
fn the_odometer_scale_is_constant_only_if_its_deviation_and_noise_are_configured() {
    let site = Site::from_library("trip-2", &Shipped).unwrap();
    let walk_of = |vehicle: &str| {
        let vehicle = Vehicle::from_toml(vehicle, "agv", &Shipped).unwrap();
        EkfConfig::new(&site, &vehicle).noise.scale_per_sqrt_m
    };
    assert_eq!(walk_of(VEHICLE), 0.0);
    for key in ["scale_std = 0.003\n", "noise_m_per_sqrt_m = 0.01\n"] {
        assert!(walk_of(&VEHICLE.replace(key, "")) > 0.0, "{key}");
    }
}
