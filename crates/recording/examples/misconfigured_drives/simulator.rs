//! A small simulator of logged drives, independent of the `simulate` crate: kinematics on straights
//! and arcs, ideal angles with noise and outliers, an odometer with errors.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use onboard::geometry::{Pose, wrap_angle};
use onboard::localize::{AngleMeasurement, MeasurementKind};
use onboard::observation::{OdometrySample, SsbDetection};
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use recording::replay::{LocatedDrive, StartChoice, as_stated, locate_angles};
use recording::{AngleLog, LoggedAngle, OdometryLog};

/// Kind of vehicle and course.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A road vehicle on the road of the site.
    OnRoad,
    /// A road vehicle on a site without a road.
    WithoutRoad,
    /// A robot on two driven wheels in a hall.
    Robot,
}

/// A drive: its settings, its logs, and the true poses.
#[derive(Clone)]
pub struct Drive {
    pub kind: Kind,
    pub site: Site,
    pub vehicle: Vehicle,
    pub odometry: OdometryLog,
    pub angles: AngleLog,
    pub start: Pose,
    /// True pose at each odometry sample.
    pub truth: Vec<Pose>,
}

fn uniform(rng: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    from + (to - from) * rng.random::<f64>()
}

fn normal(rng: &mut ChaCha8Rng, std: f64) -> f64 {
    std * rng.sample::<f64, _>(StandardNormal)
}

fn sign(rng: &mut ChaCha8Rng) -> f64 {
    if rng.random::<bool>() { 1.0 } else { -1.0 }
}

/// Returns the length (m) and the heading change (rad) of each straight and bend.
fn road(rng: &mut ChaCha8Rng) -> Vec<(f64, f64)> {
    let mut segments = vec![(uniform(rng, 30.0, 70.0), 0.0)];
    for _ in 0..2 {
        let turn_rad = sign(rng) * uniform(rng, 0.7, 1.4);
        let radius_m = uniform(rng, 12.0, 30.0);
        segments.push((radius_m * turn_rad.abs(), turn_rad));
        segments.push((uniform(rng, 50.0, 90.0), 0.0));
    }
    segments
}

/// Returns speed (m/s) and yaw rate (rad/s) of each sample of a vehicle that follows a road.
fn along_road(segments: &[(f64, f64)], rate_hz: f64, rng: &mut ChaCha8Rng) -> Vec<(f64, f64)> {
    let cruise_mps = uniform(rng, 1.5, 4.0);
    let length_m: f64 = segments.iter().map(|(length_m, _)| length_m).sum();
    let stop_m = uniform(rng, 0.3, 0.7) * length_m;
    let (mut at_m, mut speed_mps, mut stands_s) = (0.0, 0.0_f64, 0.0);
    let mut steps = Vec::new();
    while at_m < length_m - 5.0 && steps.len() < 200_000 {
        let before_stop_m = if stands_s < 4.0 {
            stop_m - at_m
        } else {
            f64::INFINITY
        };
        let max_mps = (2.0 * 0.8 * before_stop_m.max(0.0)).sqrt().min(cruise_mps);
        speed_mps = (speed_mps + 0.8 / rate_hz).min(max_mps);
        if before_stop_m < 0.05 {
            speed_mps = 0.0;
            stands_s += 1.0 / rate_hz;
        }
        let mut passed_m = 0.0;
        let here = segments.iter().find(|(length_m, _)| {
            passed_m += length_m;
            at_m < passed_m
        });
        let curvature = here.map_or(0.0, |(length_m, turn_rad)| turn_rad / length_m);
        steps.push((speed_mps, curvature * speed_mps));
        at_m += speed_mps / rate_hz;
    }
    steps
}

/// Returns speed (m/s) and yaw rate (rad/s) of each sample of a robot that drives to random goals in
/// a hall and turns on the spot.
fn through_hall(size_m: f64, start: Pose, rate_hz: f64, rng: &mut ChaCha8Rng) -> Vec<(f64, f64)> {
    let cruise_mps = uniform(rng, 0.4, 0.9);
    let (mut pose, mut steps) = (start, Vec::new());
    let mut goal = (0.0, 0.0);
    let mut speed_mps = 0.0_f64;
    for step in 0..(120.0 * rate_hz) as usize {
        let (dx, dy) = (goal.0 - pose.x_m, goal.1 - pose.y_m);
        if step == 0 || dx.hypot(dy) < 0.7 {
            let reach_m = 0.4 * size_m;
            goal = (
                uniform(rng, -reach_m, reach_m),
                uniform(rng, -reach_m, reach_m),
            );
        }
        let off_rad = wrap_angle(dy.atan2(dx) - pose.heading_rad);
        let yaw_radps = (1.5 * off_rad).clamp(-0.7, 0.7);
        let wanted_mps = if off_rad.abs() > 1.0 { 0.0 } else { cruise_mps };
        speed_mps += (wanted_mps - speed_mps).clamp(-0.5 / rate_hz, 0.5 / rate_hz);
        steps.push((speed_mps, yaw_radps));
        pose = moved(pose, speed_mps, yaw_radps, 1.0 / rate_hz);
    }
    steps
}

fn moved(pose: Pose, speed_mps: f64, yaw_radps: f64, duration_s: f64) -> Pose {
    let middle_rad = pose.heading_rad + 0.5 * yaw_radps * duration_s;
    Pose {
        x_m: pose.x_m + speed_mps * duration_s * middle_rad.cos(),
        y_m: pose.y_m + speed_mps * duration_s * middle_rad.sin(),
        heading_rad: pose.heading_rad + yaw_radps * duration_s,
    }
}

/// Returns positions (m) of radio heads: next to a road, or at the walls of a hall.
fn places(path: &[Pose], size_m: Option<f64>, rng: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
    let count = if size_m.is_some() {
        4 + rng.random_range(0..4)
    } else {
        3 + rng.random_range(0..3)
    };
    let mut places: Vec<[f64; 3]> = Vec::new();
    while places.len() < count {
        let share = (places.len() as f64 + uniform(rng, 0.1, 0.9)) / count as f64;
        let height_m = uniform(rng, 3.0, 8.0);
        let [x_m, y_m] = if let Some(size_m) = size_m {
            let round_rad = TAU * share;
            let far_m = 0.5 * size_m / round_rad.cos().abs().max(round_rad.sin().abs());
            [far_m * round_rad.cos(), far_m * round_rad.sin()]
        } else {
            let by = path[((path.len() - 1) as f64 * share) as usize];
            let aside_m = sign(rng) * uniform(rng, 6.0, 18.0);
            let (sin, cos) = by.heading_rad.sin_cos();
            [by.x_m - aside_m * sin, by.y_m + aside_m * cos]
        };
        let is_free = |it: &[f64; 3]| (it[0] - x_m).hypot(it[1] - y_m) > 4.0;
        let is_clear = |it: &Pose| (it.x_m - x_m).hypot(it.y_m - y_m) > 1.5;
        if places.iter().all(is_free) && path.iter().all(is_clear) {
            places.push([x_m, y_m, height_m]);
        }
    }
    places
}

/// Returns a drive without misconfiguration. Course, radio heads, speeds and rates depend on the seed.
pub fn drive(kind: Kind, seed: u64, guarded: bool) -> Drive {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let rng = &mut rng;
    let rate_hz = [20.0, 50.0][rng.random_range(0..2)];
    let start = Pose {
        x_m: uniform(rng, -20.0, 20.0),
        y_m: uniform(rng, -20.0, 20.0),
        heading_rad: uniform(rng, -PI, PI),
    };
    let size_m = (kind == Kind::Robot).then(|| uniform(rng, 14.0, 40.0));
    let start = if size_m.is_some() {
        Pose {
            x_m: 0.0,
            y_m: 0.0,
            ..start
        }
    } else {
        start
    };
    let segments = road(rng);
    let steps = match size_m {
        Some(size_m) => through_hall(size_m, start, rate_hz, rng),
        None => along_road(&segments, rate_hz, rng),
    };
    let mut truth = vec![start];
    for (speed_mps, yaw_radps) in &steps {
        let last = truth[truth.len() - 1];
        truth.push(moved(last, *speed_mps, *yaw_radps, 1.0 / rate_hz));
    }
    let heads = places(&truth, size_m, rng);

    // The odometer errors agree with the data sheet; the array is across the road or along it.
    let (scale_std, noise) = if size_m.is_some() {
        (0.02, 0.02)
    } else {
        (0.01, 0.01)
    };
    let scale = 1.0 + normal(rng, scale_std);
    let (yaw_noise, yaw_bias_std) = (0.005, 0.002);
    let yaw_bias_radps = normal(rng, yaw_bias_std);
    let mounting_rad = [0.0, PI / 2.0][rng.random_range(0..2)];
    let mut distance_m = 0.0;
    let mut samples = Vec::new();
    for (step, (speed_mps, yaw_radps)) in std::iter::once(&(0.0, 0.0)).chain(&steps).enumerate() {
        let true_m = speed_mps / rate_hz;
        let read_m = scale * true_m + normal(rng, noise * true_m.abs().sqrt());
        distance_m += read_m;
        let read_radps = yaw_radps + yaw_bias_radps + normal(rng, yaw_noise * rate_hz.sqrt());
        samples.push(OdometrySample {
            time_s: step as f64 / rate_hz,
            distance_m,
            speed_mps: read_m * rate_hz,
            yaw_rate_radps: Some(read_radps),
        });
    }

    let sigma_rad = uniform(rng, 0.03, 0.08);
    let every = (rate_hz / [2.5, 5.0][rng.random_range(0..2)]) as usize;
    let reach_m = if size_m.is_some() {
        f64::INFINITY
    } else {
        uniform(rng, 80.0, 200.0)
    };
    let mut angles = Vec::new();
    for (step, pose) in truth.iter().enumerate().step_by(every) {
        for (number, [x_m, y_m, z_m]) in heads.iter().enumerate() {
            let (dx, dy) = (x_m - pose.x_m, y_m - pose.y_m);
            let ground_m = dx.hypot(dy);
            if ground_m > reach_m || rng.random::<f64>() < 0.1 {
                continue;
            }
            let level = ground_m / ground_m.hypot(*z_m);
            let angle_rad = dy.atan2(dx) - pose.heading_rad - mounting_rad;
            let mut phase_rad = PI * level * angle_rad.cos() + normal(rng, sigma_rad);
            if rng.random::<f64>() < 0.03 {
                phase_rad = uniform(rng, -PI, PI);
            }
            angles.push(LoggedAngle {
                ssb: SsbDetection {
                    pci: 10 + number as u16,
                    ssb_index: 0,
                    time_s: step as f64 / rate_hz,
                    snr_db: 15.0,
                },
                measured: AngleMeasurement {
                    kind: MeasurementKind::Angle,
                    time_s: step as f64 / rate_hz,
                    phase_rad,
                    phase_sigma_rad: sigma_rad,
                    angle_rad: f64::NAN,
                    snr_db: 15.0,
                    resolved: true,
                },
            });
        }
    }

    let mut site = String::from("name = \"plant\"\n");
    for (number, [x_m, y_m, z_m]) in heads.iter().enumerate() {
        let _ = write!(
            site,
            "[[radio_heads]]\npci = {}\nposition_m = [{x_m:?}, {y_m:?}, {z_m:?}]\n\
             position_std_m = 0.05\n",
            10 + number
        );
    }
    if kind == Kind::OnRoad {
        let _ = write!(
            site,
            "[road]\nwidth_m = 4.0\nposition_std_m = 0.1\nstart = {{ x_m = {:?}, y_m = {:?}, \
             heading_rad = {:?} }}\n",
            start.x_m, start.y_m, start.heading_rad
        );
        for (length_m, turn_rad) in &segments {
            let _ = write!(
                site,
                "[[road.segments]]\nlength_m = {length_m:?}\nturn_rad = {turn_rad:?}\n"
            );
        }
    }
    let drive = if size_m.is_some() {
        "differential"
    } else {
        "road"
    };
    let integrity = if guarded { "[integrity]\n" } else { "" };
    let vehicle = format!(
        "name = \"vehicle\"\ndrive = \"{drive}\"\n\
         array = {{ mounting_rad = {mounting_rad:?}, mounting_std_rad = 0.01 }}\n\
         odometer = {{ scale_std = {scale_std:?}, noise_m_per_sqrt_m = {noise:?} }}\n\
         gyroscope = {{ noise_rad_per_sqrt_s = {yaw_noise:?}, bias_std_radps = {yaw_bias_std:?} }}\n\
         start = {{ position_std_m = 0.1, heading_std_rad = 0.05 }}\n{integrity}"
    );
    Drive {
        kind,
        site: Site::from_toml(&site, "site.toml", &Shipped).unwrap(),
        vehicle: Vehicle::from_toml(&vehicle, "vehicle.toml", &Shipped).unwrap(),
        odometry: OdometryLog {
            samples,
            ..OdometryLog::default()
        },
        angles: AngleLog {
            angles,
            remarks: Vec::new(),
        },
        start,
        truth,
    }
}

impl Drive {
    /// Locates the drive as an angle log is located.
    pub fn locate(&self) -> LocatedDrive {
        let (site, vehicle) = as_stated(&self.site, &self.vehicle);
        let start = StartChoice::At(self.start);
        locate_angles(&site, &vehicle, start, &self.odometry, &self.angles, false).unwrap()
    }

    /// Returns the RMS horizontal error (m).
    pub fn rms_error_m(&self, located: &LocatedDrive) -> f64 {
        let pairs = located.poses.iter().zip(&self.truth);
        let squares = pairs.map(|(pose, truth)| {
            let estimated = pose.estimate.pose;
            estimated.point().distance_m(truth.point()).powi(2)
        });
        (squares.sum::<f64>() / located.poses.len().max(1) as f64).sqrt()
    }
}
