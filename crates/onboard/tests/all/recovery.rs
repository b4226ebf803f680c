//! A vehicle that was told wrongly where it starts finds back.

use std::f64::consts::{FRAC_PI_2, PI};

use onboard::geometry::Pose;
use onboard::localize::{AngleMeasurement, built_in};
use onboard::observation::OdometrySample;
use onboard::radio_head::RadioHead;
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const SITE: &str = "
name = 'hall'
rician_k_db = 200.0
radio_heads = [
    { pci = 1, position_m = [-5.0, -4.0, 0.0] },
    { pci = 2, position_m = [6.0, -4.0, 0.0] },
    { pci = 3, position_m = [5.0, 4.0, 0.0] },
    { pci = 4, position_m = [-4.0, 5.0, 0.0] },
    { pci = 5, position_m = [0.0, 6.0, 0.0] },
]
";

const VEHICLE: &str = "
name = 'robot'
drive = 'differential'
[start]
position_std_m = 0.05
heading_std_rad = 0.05
[gyroscope]
noise_rad_per_sqrt_s = 0.02
bias_std_radps = 0.002
[integrity]
[receiver]
phase_bias_share = 0.25
";

/// Ninety seconds of winding about the hall: the worst error from the sixtieth on, and whether it
/// was found anew.
fn drive(told: Pose) -> (f64, bool) {
    let site = Site::from_toml(SITE, "hall", &Shipped).unwrap();
    let vehicle = Vehicle::from_toml(VEHICLE, "robot", &Shipped).unwrap();
    let heads = RadioHead::heard(&site, &vehicle);
    let mut localizer = built_in(&site, &vehicle, told).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let (mut truth, mut worst_m) = (Pose::default(), 0.0);
    for step in 1..=1800 {
        let time_s = 0.05 * f64::from(step);
        let rate_radps = 0.4 * (0.3 * time_s).cos();
        truth = truth.along_chord(0.05 * 0.3, 0.05 * rate_radps);
        let sample = OdometrySample {
            time_s,
            distance_m: 0.3 * time_s,
            speed_mps: 0.3,
            yaw_rate_radps: Some(rate_radps + 0.02 * normal() / 0.05_f64.sqrt()),
        };
        localizer.odometry(&sample).unwrap();
        for head in heads.iter().filter(|_| step % 5 == 0) {
            let bearing_rad = truth.point().bearing_rad(head.position) - truth.heading_rad;
            let measured = AngleMeasurement {
                time_s,
                phase_rad: PI * bearing_rad.cos() + 0.05 * normal(),
                phase_sigma_rad: 0.05,
                angle_rad: f64::NAN,
                snr_db: 20.0,
                resolved: true,
            };
            localizer.update(head, &measured).unwrap();
        }
        let estimate = localizer.pose(time_s).unwrap();
        if time_s > 60.0 {
            let error_m = estimate.pose.point().distance_m(truth.point());
            worst_m = error_m.max(worst_m);
        }
    }
    (worst_m, localizer.recovered().is_some())
}

#[test]
fn a_wrong_start_is_noticed_and_left() {
    let (right_m, recovered) = drive(Pose::default());
    assert!(!recovered && right_m < 0.3, "{right_m}");
    for (x_m, y_m, heading_rad) in [
        (1.06, -1.06, 0.8),
        (-1.06, 1.06, -0.8),
        (0.0, 0.0, FRAC_PI_2),
        (0.0, 0.0, -FRAC_PI_2),
        (0.0, 0.0, PI),
    ] {
        let told = Pose {
            x_m,
            y_m,
            heading_rad,
        };
        let (wrong_m, recovered) = drive(told);
        assert!(
            recovered && wrong_m < 1.2 * right_m + 0.01,
            "{told:?}: {wrong_m}"
        );
    }
}
