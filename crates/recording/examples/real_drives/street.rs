//! Ray-traced street of `$ACCESS_AV_DATA/street`.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use onboard::geometry::{Pose, wrap_angle};
use onboard::localize::IntegrityState;
use onboard::observation::OdometrySample;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::{Drive, report, table, why_not_ok};

const STREET: &str = "
name = \"car\"
[odometer]
scale_std = 0.003
noise_m_per_sqrt_m = 0.01
[gyroscope]
noise_rad_per_sqrt_s = 0.003
bias_std_radps = 0.002
[start]
position_std_m = 0.1
heading_std_rad = 0.02
[integrity]
[lane_keeping]
rms_m = 0.02
[array]
position_m = [0.0, 0.0, 1.5]
";

/// Locates the street with exact angles, every kind of map and speed, and with the ray tracer's
/// angles.
pub fn exact_and_real(folder: &Path) {
    let base = Drive::read(folder, "angles.csv", "odometry.csv");
    let raw = Drive::read(folder, "angles.csv", "odometry_rawspeed.csv");
    let sparse = Drive::read(folder, "angles_every2m.csv", "odometry.csv");
    // Exact angles from the true pose and the heights of the radio heads at the logged times.
    let heads = table(&folder.join("landmarks.csv"));
    let exact = |drive: &Drive| {
        let mut drive = drive.clone();
        let truth = drive.clone();
        drive.angles.angles.retain_mut(|it| {
            let Some(pose) = truth.true_pose(it.measured.time_s) else {
                return false;
            };
            let head = heads
                .iter()
                .find(|head| head[0] == f64::from(it.ssb.pci))
                .unwrap();
            let (dx, dy, dz) = (head[1] - pose.x_m, head[2] - pose.y_m, head[3] - 1.5);
            let ground = dx.hypot(dy);
            let level = ground / ground.hypot(dz);
            let phase_rad = PI * level * (dy.atan2(dx) - pose.heading_rad).cos();
            it.measured.phase_rad = phase_rad;
            it.measured.angle_rad = (phase_rad / PI).acos();
            true
        });
        drive
    };
    let road = fs::read_to_string(folder.join("road.toml")).unwrap();
    let segments = road.replace("[track]", "\n[road]");
    let polyline = |spacing_m: f64| {
        let mut points = vec![];
        let mut last: Option<Pose> = None;
        for it in &base.truth {
            if last.is_none_or(|last| last.point().distance_m(it.pose.point()) >= spacing_m) {
                points.push([it.pose.x_m, it.pose.y_m]);
                last = Some(it.pose);
            }
        }
        let end = base.truth.last().unwrap().pose;
        if last.unwrap().point().distance_m(end.point()) > 0.3 {
            points.push([end.x_m, end.y_m]);
        }
        format!("\n[road]\nwidth_m = 4.0\npolyline_m = {points:?}\n")
    };
    let with_road = |drive: &Drive, road: &str| Drive {
        site: format!("{}{road}", drive.site),
        ..drive.clone()
    };
    for (speeds, drive) in [("avg", exact(&base)), ("raw", exact(&raw))] {
        for (label, road) in [
            ("no map", String::new()),
            ("segments", segments.clone()),
            ("line 1 m", polyline(1.0)),
            ("line 2 m", polyline(2.0)),
            ("line 5 m", polyline(5.0)),
        ] {
            let drive = with_road(&drive, &road);
            report(
                &format!("exact {speeds} {label}"),
                &drive,
                &drive.locate(STREET, drive.start, true),
            );
        }
    }
    for (label, drive) in [("real", &base), ("real 2 m", &sparse), ("real raw", &raw)] {
        report(label, drive, &drive.locate(STREET, drive.start, true));
        let mapped = with_road(drive, &segments);
        report(
            &format!("{label} map"),
            &mapped,
            &mapped.locate(STREET, drive.start, true),
        );
    }
}

/// Locates the street with ten odometers according to its data sheet: median and maximum RMS error,
/// and fractions of the total time.
pub fn ten_odometers(folder: &Path) {
    let road = fs::read_to_string(folder.join("road.toml")).unwrap();
    let road = road.replace("[track]", "\n[road]");
    let demand = "[wake_up]\npolicy = \"uncertainty\"\ntarget_error_m = 0.2\n";
    for (label, angles, more) in [
        ("every burst", "angles.csv", ""),
        ("every 2 m", "angles_every2m.csv", ""),
        ("on demand", "angles.csv", demand),
    ] {
        if std::env::var("BURSTS").is_ok_and(|wanted| !label.contains(&wanted)) {
            continue;
        }
        let base = Drive::read(folder, angles, "odometry.csv");
        for map in [true, false] {
            let mut base = base.clone();
            if map {
                base.site += &road;
            }
            let drives = (0..10).map(|seed| with_odometry(&base, seed));
            let name = if map { "map" } else { "no map" };
            summary(
                &format!("{label:12} {name:6}"),
                &format!("{STREET}{more}"),
                drives,
            );
        }
    }
}

/// Locates the street without a road from starts along it, with two odometers each.
pub fn starts(folder: &Path) {
    let base = Drive::read(folder, "angles.csv", "odometry.csv");
    let end_s = base.truth.last().map_or(0.0, |last| last.time_s);
    let mut start_s = 0.0;
    while start_s < 0.75 * end_s {
        let drives = (0..2).map(|seed| from(start_s, with_odometry(&base, seed)));
        summary(&format!("from {start_s:4.1} s"), STREET, drives);
        start_s += 2.0;
    }
}

/// Returns the part of the drive from `start_s` (s) on; the start is its true pose.
fn from(start_s: f64, mut drive: Drive) -> Drive {
    let odometry = &mut drive.odometry.samples;
    odometry.retain(|it| it.time_s >= start_s);
    let first_s = odometry[0].time_s;
    (drive.angles.angles).retain(|it| it.measured.time_s > first_s);
    drive.start = drive.true_pose(first_s).unwrap();
    drive
}

fn with_odometry(base: &Drive, seed: u64) -> Drive {
    let mut drive = base.clone();
    drive.odometry.samples = odometry(base, seed);
    drive
}

/// Locates the drives, and prints median and maximum RMS error, and fractions of the total time.
fn summary(label: &str, vehicle: &str, drives: impl Iterator<Item = Drive>) {
    let mut poses = vec![];
    let (mut rms_m, mut shares, mut aoa_estimates) = (vec![], [0.0; 4], 0);
    for drive in drives {
        let located = drive.locate(vehicle, drive.start, false);
        rms_m.push(drive.rms_m(&located.poses, f64::NEG_INFINITY, f64::INFINITY));
        aoa_estimates += located.aoa_estimates.len();
        poses.extend_from_slice(&located.poses);
        for pose in &located.poses {
            let Some(truth) = drive.true_pose(pose.estimate.time_s) else {
                continue;
            };
            let error_m = pose.estimate.pose.point().distance_m(truth.point());
            let within = drive.half_nees(pose).is_some_and(|it| it < 2.996);
            let integrity = pose.estimate.integrity;
            let ok = integrity.is_some_and(|it| it.state == IntegrityState::Ok);
            let beyond = integrity.is_some_and(|it| error_m > it.protection_level_m);
            let of = [true, within, ok, ok && beyond];
            for (share, of) in shares.iter_mut().zip(of) {
                *share += f64::from(u8::from(of));
            }
        }
    }
    rms_m.sort_by(f64::total_cmp);
    let last = rms_m.len() - 1;
    println!(
        "street {label} rms {:.3} (worst {:.3}) in 95 % {:.3} ok {:.3} beyond while ok {:.1e} angles {aoa_estimates} {}",
        0.5 * (rms_m[last / 2] + rms_m[last.div_ceil(2)]),
        rms_m[last],
        shares[1] / shares[0],
        shares[2] / shares[0],
        shares[3] / f64::max(shares[2], 1.0),
        why_not_ok(&poses),
    );
}

/// Simulates the odometry of the true drive according to the street's data sheet.
fn odometry(drive: &Drive, seed: u64) -> Vec<OdometrySample> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { random.sample(StandardNormal) };
    let (scale, bias_radps) = (1.0 + 0.003 * normal(), 0.002 * normal());
    let mut read_m = vec![0.0];
    let mut samples = vec![];
    let mut before: Option<Pose> = None;
    for sample in &drive.odometry.samples {
        let Some(pose) = drive.true_pose(sample.time_s) else {
            continue;
        };
        let (mut yaw_rate_radps, period_s) = (0.0, 0.02);
        let mut distance_m = read_m[read_m.len() - 1];
        if let Some(before) = before {
            let step_m = pose.point().distance_m(before.point());
            distance_m += scale * step_m + 0.01 * step_m.sqrt() * normal();
            yaw_rate_radps = wrap_angle(pose.heading_rad - before.heading_rad) / period_s;
        }
        yaw_rate_radps += bias_radps + 0.003 / f64::sqrt(period_s) * normal();
        read_m.push(distance_m);
        let earlier_m = read_m[read_m.len().saturating_sub(11)];
        let over_s = period_s * (read_m.len() - 1).min(10) as f64;
        samples.push(OdometrySample {
            time_s: sample.time_s,
            distance_m,
            speed_mps: (distance_m - earlier_m) / over_s,
            yaw_rate_radps: Some(yaw_rate_radps),
        });
        before = Some(pose);
    }
    samples
}
