//! Accuracy on the converted real drives of `$ACCESS_AV_DATA/drives` and on the ray-traced street:
//! RMS position error at the times of the truth, fraction in state `ok`, errors that exceed the
//! protection level in state `ok`, NEES/2. Run with `cargo run --profile dev -p recording --example
//! real_drives`.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)]

mod street;

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use onboard::geometry::{Pose, wrap_angle};
use onboard::localize::IntegrityState;
use onboard::observation::OdometrySample;
use onboard::settings::{IntegritySettings, Shipped, Site, TomlFile, Vehicle};
use recording::replay::{LocatedDrive, LocatedPose, StartChoice, as_stated, locate_angles};
use recording::{AngleLog, OdometryLog, TimedPose, read_angle_log, read_odometry_csv, read_tum};

const MRCLAM: &str = "
name = \"robot\"
drive = \"differential\"
[odometer]
scale_std = 0.08
noise_m_per_sqrt_m = 0.05
[gyroscope]
noise_rad_per_sqrt_s = 0.04
bias_std_radps = 0.005
[receiver]
angle_time_offset_s = 0.04
[start]
position_std_m = 0.05
heading_std_rad = 0.05
[integrity]
[array]
mounting_std_rad = 0.02
";

const LITW: &str = "
name = \"robot\"
drive = \"differential\"
[odometer]
rate_hz = 10.0
scale_std = 0.02
noise_m_per_sqrt_m = 0.02
[gyroscope]
noise_rad_per_sqrt_s = 0.025
bias_std_radps = 0.003
[start]
position_std_m = 0.05
heading_std_rad = 0.05
[integrity]
[array]
mounting_std_rad = 0.01
";

const DEFAULTS: &str = "
name = \"robot\"
drive = \"differential\"
[start]
position_std_m = 0.05
heading_std_rad = 0.05
[integrity]
[array]
";

/// Recorded drive.
#[derive(Clone)]
struct Drive {
    name: String,
    site: String,
    odometry: OdometryLog,
    angles: AngleLog,
    truth: Vec<TimedPose>,
    start: Pose,
    mounting_rad: f64,
}

fn table(file: &Path) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(file).expect("a file of the drive");
    let numbers = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
    text.lines().skip(1).map(numbers).collect()
}

impl Drive {
    fn read(folder: &Path, angles: &str, odometry: &str) -> Self {
        let mut site = String::from("name = \"hall\"\n");
        let head_table = table(&folder.join("landmarks.csv"));
        let street = head_table[0].len() > 3;
        for head in &head_table {
            let z_m = head.get(3).copied().unwrap_or(0.0);
            let index = if street { head[0] - 1.0 } else { 0.0 };
            let _ = write!(
                site,
                "[[radio_heads]]\npci = {}\nssb_index = {index}\nposition_m = [{:?}, {:?}, {z_m:?}]\n",
                head[0], head[1], head[2]
            );
        }
        let start = &table(&folder.join("start.csv"))[0];
        Self {
            name: folder.file_name().unwrap().to_string_lossy().into_owned(),
            site,
            odometry: read_odometry_csv(&folder.join(odometry)).unwrap(),
            angles: read_angle_log(&folder.join(angles)).unwrap(),
            truth: read_tum(&folder.join("truth.tum")).unwrap(),
            start: Pose {
                x_m: start[0],
                y_m: start[1],
                heading_rad: start[2],
            },
            mounting_rad: start[3],
        }
    }

    fn true_pose(&self, time_s: f64) -> Option<Pose> {
        let after = self.truth.partition_point(|it| it.time_s <= time_s);
        let (a, b) = (
            self.truth.get(after.checked_sub(1)?)?,
            self.truth.get(after)?,
        );
        let share = (time_s - a.time_s) / (b.time_s - a.time_s);
        let mix = |a: f64, b: f64| a + share * (b - a);
        Some(Pose {
            x_m: mix(a.pose.x_m, b.pose.x_m),
            y_m: mix(a.pose.y_m, b.pose.y_m),
            heading_rad: a.pose.heading_rad
                + share * wrap_angle(b.pose.heading_rad - a.pose.heading_rad),
        })
    }

    fn locate(&self, vehicle: &str, start: Pose, smooth: bool) -> LocatedDrive {
        let mounting = format!("mounting_rad = {:?}\n", self.mounting_rad);
        let mut text = vehicle.replace("[array]\n", &format!("[array]\n{mounting}"));
        for table in [
            "receiver",
            "odometer",
            "gyroscope",
            "array",
            "integrity",
            "localizer",
        ] {
            // Environment variables add settings: RECEIVER="noise_correlation_time_s = 2.0".
            let Ok(keys) = std::env::var(table.to_uppercase()) else {
                continue;
            };
            let head = format!("[{table}]\n");
            if !text.contains(&head) {
                text += &head;
            }
            text = text.replace(&head, &format!("{head}{}\n", keys.replace(';', "\n")));
        }
        let vehicle = Vehicle::from_toml(&text, "vehicle", &Shipped).expect("a vehicle");
        let site = Site::from_toml(&self.site, "site", &Shipped).expect("a site");
        let (odometry, angles) = (&self.odometry, &self.angles);
        let (site, vehicle) = as_stated(&site, &vehicle);
        locate_angles(
            &site,
            &vehicle,
            StartChoice::At(start),
            odometry,
            angles,
            smooth,
        )
        .expect("a located drive")
    }

    /// Returns the RMS error in a time interval.
    fn rms_m(&self, poses: &[LocatedPose], from_s: f64, to_s: f64) -> f64 {
        let errors = poses
            .iter()
            .filter(|pose| pose.estimate.time_s >= from_s && pose.estimate.time_s <= to_s);
        let squares: Vec<f64> = errors
            .filter_map(|pose| {
                let truth = self.true_pose(pose.estimate.time_s)?;
                Some(pose.estimate.pose.point().distance_m(truth.point()).powi(2))
            })
            .collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    /// Returns half of the squared position error normalised by its covariance.
    fn half_nees(&self, pose: &LocatedPose) -> Option<f64> {
        let truth = self.true_pose(pose.estimate.time_s)?;
        let [[xx, xy, _], [_, yy, _], _] = pose.estimate.covariance?;
        let at = pose.estimate.pose;
        let (dx, dy) = (at.x_m - truth.x_m, at.y_m - truth.y_m);
        Some(0.5 * (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy))
    }

    fn summary(&self, located: &LocatedDrive) -> String {
        let (mut ok, mut beyond, mut all, mut nees) = (0, 0, 0, 0.0);
        let mut nees_heading = 0.0;
        for pose in &located.poses {
            let Some(truth) = self.true_pose(pose.estimate.time_s) else {
                continue;
            };
            all += 1;
            let at = pose.estimate.pose;
            let (dx, dy) = (at.x_m - truth.x_m, at.y_m - truth.y_m);
            nees += self.half_nees(pose).unwrap_or(0.0);
            if let Some([_, _, [_, _, hh]]) = pose.estimate.covariance {
                nees_heading += wrap_angle(at.heading_rad - truth.heading_rad).powi(2) / hh;
            }
            if let Some(integrity) = pose.estimate.integrity
                && integrity.state == IntegrityState::Ok
            {
                ok += 1;
                beyond += u32::from(dx.hypot(dy) > integrity.protection_level_m);
            }
        }
        let share = |part: u32| 100.0 * f64::from(part) / f64::from(all.max(1));
        let accepted = (located.aoa_estimates.iter())
            .filter(|it| it.verdict.accepted)
            .count();
        let mut text = format!(
            "rms {:8.3}",
            self.rms_m(&located.poses, f64::NEG_INFINITY, f64::INFINITY)
        );
        if !located.smoothed.is_empty() {
            let smoothed = &located.smoothed;
            let rms_m = self.rms_m(smoothed, f64::NEG_INFINITY, f64::INFINITY);
            let bad = smoothed.iter().filter(|it| {
                let covariance = it.estimate.covariance.unwrap_or_default();
                (0..3).any(|i| !(covariance[i][i] > 0.0 && covariance[i][i] < 1e6))
            });
            let _ = write!(text, " smooth {rms_m:6.3} bad {:5}", bad.count());
        }
        let _ = write!(
            text,
            " nis {:4.2} ok {:5.1}% beyond {:5.2}% nees/2 {:6.2} heading {:6.2} taken {:5.1}% remarks {}",
            {
                let seen = located
                    .aoa_estimates
                    .iter()
                    .filter(|it| it.verdict.accepted);
                seen.filter_map(|it| it.verdict.mahalanobis_squared)
                    .sum::<f64>()
                    / accepted.max(1) as f64
            },
            share(ok),
            share(beyond),
            nees / f64::from(all),
            nees_heading / f64::from(all),
            100.0 * accepted as f64 / located.aoa_estimates.len().max(1) as f64,
            located.remarks.len()
        );
        text
    }
}

/// Returns the reasons for states other than `ok`: fractions of the time lost, above the alert
/// limit, and with a doubted source.
fn why_not_ok(poses: &[LocatedPose]) -> String {
    let alert_limit_m = IntegritySettings::default().alert_limit_m;
    let (mut lost, mut wide, mut doubted) = (0, 0, 0);
    for pose in poses {
        let Some(it) = pose.estimate.integrity else {
            continue;
        };
        match it.state {
            IntegrityState::Ok => {}
            _ if pose.is_lost => lost += 1,
            _ if it.protection_level_m > alert_limit_m => wide += 1,
            _ => doubted += 1,
        }
    }
    let share = |part: u32| f64::from(part) / poses.len().max(1) as f64;
    format!(
        "lost {:.3} wide {:.3} doubted {:.3}",
        share(lost),
        share(wide),
        share(doubted)
    )
}

/// Prints the first remarks of each kind.
fn print_remarks(located: &LocatedDrive) {
    if std::env::var_os("REMARKS").is_some() {
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        for remark in &located.remarks {
            let key: String = remark
                .text
                .chars()
                .filter(|c| !c.is_ascii_digit())
                .collect();
            let count = seen.entry(key).or_default();
            *count += 1;
            if *count <= 3 {
                println!("      {}", remark.text);
            }
        }
    }
}

/// Prints the first minute in steps of three seconds.
fn print_trace(drive: &Drive, poses: &[LocatedPose]) {
    if std::env::var_os("TRACE").is_none() {
        return;
    }
    let mut next_s = 0.0;
    for pose in poses.iter().filter(|it| it.estimate.time_s < 90.0) {
        let at_s = pose.estimate.time_s;
        let (true, Some(truth)) = (at_s >= next_s, drive.true_pose(at_s)) else {
            continue;
        };
        next_s = at_s + 3.0;
        let (is, c) = (
            pose.estimate.pose,
            pose.estimate.covariance.unwrap_or_default(),
        );
        println!(
            "  {at_s:6.1} x {:6.3} ({:.3}) y {:6.3} ({:.3}) heading {:6.3} ({:.3}) mounting {:?}",
            is.x_m - truth.x_m,
            c[0][0].sqrt(),
            is.y_m - truth.y_m,
            c[1][1].sqrt(),
            wrap_angle(is.heading_rad - truth.heading_rad),
            c[2][2].sqrt(),
            pose.constants.map(|it| it.mounting_rad.departure()),
        );
    }
}

/// Prints the RMS error in each minute, and NEES/2.
fn print_minutes(drive: &Drive, poses: &[LocatedPose]) {
    if std::env::var_os("MINUTES").is_none() {
        return;
    }
    let end_s = poses.last().map_or(0.0, |pose| pose.estimate.time_s);
    let (mut rms_m, mut nees) = (String::new(), String::new());
    for minute in 0..(end_s / 60.0).ceil() as u32 {
        let from_s = f64::from(minute) * 60.0;
        let _ = write!(rms_m, " {:5.2}", drive.rms_m(poses, from_s, from_s + 60.0));
        let within = poses
            .iter()
            .filter(|it| (from_s..from_s + 60.0).contains(&it.estimate.time_s));
        let all: Vec<f64> = within.filter_map(|it| drive.half_nees(it)).collect();
        let _ = write!(
            nees,
            " {:5.2}",
            all.iter().sum::<f64>() / all.len().max(1) as f64
        );
    }
    println!("   rms   {rms_m}\n   nees/2{nees}");
}

fn report(label: &str, drive: &Drive, located: &LocatedDrive) {
    let why = why_not_ok(&located.poses);
    println!(
        "{:10} {label:18} {} {why}",
        drive.name,
        drive.summary(located)
    );
    print_remarks(located);
    print_minutes(drive, &located.poses);
    print_minutes(drive, &located.smoothed);
    print_trace(drive, &located.poses);
}

fn main() {
    let data = std::env::var_os("ACCESS_AV_DATA").map_or("../shared/data".into(), PathBuf::from);
    if !data.join("drives").is_dir() {
        println!("skipped: no drives in {}", data.display());
        return;
    }
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let wants = |name: &str| wanted.is_empty() || wanted.iter().any(|it| it == name);
    let mut folders: Vec<PathBuf> = fs::read_dir(data.join("drives"))
        .unwrap()
        .map(|it| it.unwrap().path())
        .filter(|it| it.is_dir())
        .collect();
    folders.sort();
    let only = std::env::var("DRIVE").ok();
    for folder in folders {
        let drive = Drive::read(&folder, "angles.csv", "odometry.csv");
        if only.as_ref().is_some_and(|only| *only != drive.name) {
            continue;
        }
        let vehicle = if drive.name.starts_with("litw") {
            LITW
        } else {
            MRCLAM
        };
        if wants("configured") {
            report(
                "configured",
                &drive,
                &drive.locate(vehicle, drive.start, true),
            );
        }
        if wants("defaults") {
            report(
                "defaults",
                &drive,
                &drive.locate(DEFAULTS, drive.start, true),
            );
        }
        if wanted.iter().any(|it| it == "parts") {
            parts(&drive, vehicle);
        }
        if wants("faults") {
            faults(&drive, vehicle);
        }
    }
    if wants("street") && only.is_none() {
        street::exact_and_real(&data.join("street"));
    }
    if wants("seeds") && only.is_none() {
        street::ten_odometers(&data.join("street"));
    }
    if wants("starts") && only.is_none() {
        street::starts(&data.join("street"));
    }
}

/// Locates parts of the drive from several starts, for comparison with the whole drive.
fn parts(drive: &Drive, vehicle: &str) {
    const LENGTH_S: f64 = 300.0;
    let end_s = drive.truth.last().map_or(0.0, |last| last.time_s);
    let mut from_s = 30.0;
    while from_s + LENGTH_S < end_s {
        let within = from_s..from_s + LENGTH_S;
        let mut part = drive.clone();
        part.odometry
            .samples
            .retain(|it| within.contains(&it.time_s));
        part.angles
            .angles
            .retain(|it| within.contains(&it.measured.time_s));
        part.start = drive
            .true_pose(part.odometry.samples[0].time_s)
            .unwrap_or(drive.start);
        report(
            &format!("from {from_s} s"),
            &part,
            &part.locate(vehicle, part.start, false),
        );
        from_s += 90.0;
    }
}

fn faults(drive: &Drive, vehicle: &str) {
    let good = drive.locate(vehicle, drive.start, false);
    let end_s = f64::INFINITY;
    let compare = |label: &str, drive: &Drive, start: Pose, from_s: f64| {
        if std::env::var("FAULT").is_ok_and(|fault| !label.contains(&fault)) {
            return;
        }
        let bad = drive.locate(vehicle, start, false);
        let (is, was) = (
            drive.rms_m(&bad.poses, from_s, end_s),
            drive.rms_m(&good.poses, from_s, end_s),
        );
        println!(
            "{:10} {label:18} rms {is:8.3} against {was:.3} ({:.2}) remarks {}",
            drive.name,
            is / was,
            bad.remarks.len()
        );
        print_remarks(&bad);
        print_minutes(drive, &bad.poses);
    };
    let off = |dx: f64, dy: f64, turn: f64| Pose {
        x_m: drive.start.x_m + dx,
        y_m: drive.start.y_m + dy,
        heading_rad: drive.start.heading_rad + turn,
    };
    compare("start 1.5 m 0.8", drive, off(1.06, -1.06, 0.8), 60.0);
    compare("start -1.5 m -0.8", drive, off(-1.06, 1.06, -0.8), 60.0);
    compare("heading +1.57", drive, off(0.0, 0.0, 1.57), 60.0);
    compare("heading -1.57", drive, off(0.0, 0.0, -1.57), 60.0);
    compare("heading 3.14", drive, off(0.0, 0.0, PI), 60.0);
    let edit = |samples: &mut dyn FnMut(usize, &mut OdometrySample)| {
        let mut drive = drive.clone();
        for (index, sample) in drive.odometry.samples.iter_mut().enumerate() {
            samples(index, sample);
        }
        drive
    };
    let middle = drive.odometry.samples.len() / 3;
    let at_s = drive.odometry.samples[middle].time_s;
    let spiked = edit(&mut |index, sample| {
        if index == middle {
            sample.yaw_rate_radps = Some(20.0);
        }
    });
    compare("yaw 20 rad/s", &spiked, drive.start, at_s + 30.0);
    let mut deaf = drive.clone();
    deaf.angles
        .angles
        .retain(|it| !(at_s..at_s + 60.0).contains(&it.measured.time_s));
    // Recovery within 30 s of the first angle after the interruption.
    let mut times_s = deaf.angles.angles.iter().map(|it| it.measured.time_s);
    let received_s = times_s.find(|time_s| *time_s > at_s).unwrap_or(at_s);
    compare("a minute deaf", &deaf, drive.start, received_s + 30.0);
    for factor in [1.1, 0.9] {
        let scaled = edit(&mut |_, sample| {
            sample.distance_m *= factor;
            sample.speed_mps *= factor;
        });
        compare(&format!("scale {factor}"), &scaled, drive.start, 30.0);
    }
    let mut late = drive.clone();
    for angle in &mut late.angles.angles {
        angle.measured.time_s += 0.1;
        angle.ssb.time_s += 0.1;
    }
    compare("late 100 ms", &late, drive.start, 30.0);
}
