//! Recovery of a vehicle from a wrong given start.

use std::f64::consts::{FRAC_PI_2, PI};

use onboard::geometry::Pose;
use onboard::localize::{Localizer, built_in};
use onboard::observation::OdometrySample;
use onboard::radio_head::RadioHead;
use onboard::range::RangeMeasurement;
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::angle;

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
correlated_noise_fraction = 0.25
";

/// Time from one odometry sample to the next (s).
const STEP_S: f64 = 0.05;

/// A vehicle in the hall.
struct Drive {
    heads: Vec<RadioHead>,
    localizer: Box<dyn Localizer>,
    rng: ChaCha8Rng,
    truth: Pose,
    steps: u32,
    distance_m: f64,
}

impl Drive {
    /// Creates a drive that starts at the origin with a configured start.
    fn new(start: Pose) -> Self {
        Self::with(VEHICLE, start)
    }

    fn with(vehicle: &str, start: Pose) -> Self {
        let site = Site::from_toml(SITE, "hall", &Shipped).unwrap();
        let vehicle = Vehicle::from_toml(vehicle, "robot", &Shipped).unwrap();
        Self {
            heads: RadioHead::received_by(&site, &vehicle),
            localizer: built_in(&site, &vehicle, start).unwrap(),
            rng: ChaCha8Rng::seed_from_u64(1),
            truth: Pose::default(),
            steps: 0,
            distance_m: 0.0,
        }
    }

    fn normal(&mut self) -> f64 {
        self.rng.sample(StandardNormal)
    }

    fn time_s(&self) -> f64 {
        STEP_S * f64::from(self.steps)
    }

    /// Advances by one step; every fifth step has an angle of each radio head.
    fn step(&mut self, speed_mps: f64, rate_radps: f64) {
        self.steps += 1;
        self.distance_m += STEP_S * speed_mps;
        self.truth = (self.truth).along_chord(STEP_S * speed_mps, STEP_S * rate_radps);
        let sample = OdometrySample {
            time_s: self.time_s(),
            distance_m: self.distance_m,
            speed_mps,
            yaw_rate_radps: Some(rate_radps + 0.02 * self.normal() / STEP_S.sqrt()),
        };
        self.localizer.odometry(&sample).unwrap();
        if !self.steps.is_multiple_of(5) {
            return;
        }
        for head in self.heads.clone() {
            let bearing_rad = self.truth.point().bearing_rad(head.position);
            let phase_rad =
                PI * (bearing_rad - self.truth.heading_rad).cos() + 0.05 * self.normal();
            let measured = angle(self.time_s(), phase_rad, 0.05);
            self.localizer.update(&head, &measured).unwrap();
        }
    }

    /// Drives along a winding path until a time: returns the maximum error after `from_s` (m).
    fn wind(&mut self, until_s: f64, from_s: f64) -> f64 {
        let mut worst_m: f64 = 0.0;
        while self.time_s() < until_s {
            self.step(0.3, 0.4 * (0.3 * self.time_s()).cos());
            if self.time_s() > from_s {
                worst_m = worst_m.max(self.error_m());
            }
        }
        worst_m
    }

    fn error_m(&self) -> f64 {
        let estimate = self.localizer.pose(self.time_s()).unwrap();
        estimate.pose.point().distance_m(self.truth.point())
    }
}

/// Drives a winding path in the hall for 90 s: returns the maximum error after 60 s, and whether a
/// search relocated the vehicle.
fn drive(start: Pose) -> (f64, bool) {
    let mut drive = Drive::new(start);
    let worst_m = drive.wind(90.0, 60.0);
    (worst_m, drive.localizer.recovered().is_some())
}

#[test]
fn a_wrong_start_is_detected_and_corrected() {
    let (right_m, recovered) = drive(Pose::default());
    assert!(!recovered && right_m < 0.3, "{right_m}");
    for (x_m, y_m, heading_rad) in [
        (1.06, -1.06, 0.8),
        (-1.06, 1.06, -0.8),
        (0.0, 0.0, FRAC_PI_2),
        (0.0, 0.0, -FRAC_PI_2),
        (0.0, 0.0, PI),
    ] {
        let start = Pose {
            x_m,
            y_m,
            heading_rad,
        };
        let (wrong_m, recovered) = drive(start);
        assert!(
            recovered && wrong_m < 1.2 * right_m + 0.01,
            "{start:?}: {wrong_m}"
        );
    }
}

#[test]
fn no_search_runs_after_a_restart() {
    let mut drive = Drive::new(Pose::default());
    // At standstill, no result of a search is accepted.
    let mut lost_s = |seconds: f64| {
        let until_s = drive.time_s() + seconds;
        let mut lost_s = 0.0;
        while drive.time_s() < until_s {
            drive.step(0.0, 0.8);
            lost_s += STEP_S * f64::from(u8::from(drive.localizer.is_lost()));
        }
        drive.truth.heading_rad += 0.7; // no sensor measures this rotation
        lost_s
    };
    let (before_s, after_s) = (lost_s(10.0), lost_s(30.0));
    assert!(
        before_s == 0.0 && (1.0..10.0).contains(&after_s),
        "{after_s}"
    );
    assert!(drive.localizer.recovered().is_none() && drive.error_m() < 0.1);
}

/// The ranges are those of the opposite heading. The search for the heading compares ranges only, and angles contradict its
/// result.
#[test]
fn ranges_do_not_replace_a_heading_that_angles_measure() {
    let vehicle = format!("{VEHICLE}[ranging]\nkind = 'two-way'\nsigma_m = 0.1\n");
    let mut drive = Drive::with(&vehicle, Pose::default());
    while drive.time_s() < 20.0 {
        drive.wind(drive.time_s() + 5.0 * STEP_S, 0.0);
        let opposite = Pose {
            x_m: -drive.truth.x_m,
            y_m: -drive.truth.y_m,
            ..drive.truth
        };
        for head in drive.heads.clone() {
            let range_m = opposite.point().distance_m(head.position);
            let measured = RangeMeasurement::range(drive.time_s(), range_m, Some(0.1));
            drive.localizer.update_range(&head, &measured).unwrap();
        }
        assert!(drive.error_m() < 0.5, "{}", drive.error_m());
    }
}
