//! Recorded drives of `$ACCESS_AV_DATA` with the specifications of their data sheets.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use onboard::geometry::Pose;
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};
use recording::{read_angle_log, read_odometry_csv, read_tum};

use super::simulator::{Drive, Kind};

/// Data sheet of the MRCLAM robots.
const MRCLAM: &str = "drive = \"differential\"
odometer = { scale_std = 0.08, noise_m_per_sqrt_m = 0.05 }
gyroscope = { noise_rad_per_sqrt_s = 0.04, bias_std_radps = 0.005 }
receiver = { angle_time_offset_s = 0.04 }
start = { position_std_m = 0.05, heading_std_rad = 0.05 }
array = { mounting_std_rad = 0.02, mounting_rad = ";
/// Data sheet of the robot of "lost in the woods".
const WOODS: &str = "drive = \"differential\"
odometer = { rate_hz = 10.0, scale_std = 0.02, noise_m_per_sqrt_m = 0.02 }
gyroscope = { noise_rad_per_sqrt_s = 0.025, bias_std_radps = 0.003 }
start = { position_std_m = 0.05, heading_std_rad = 0.05 }
array = { mounting_std_rad = 0.01, mounting_rad = ";
/// Data sheet of the car of the ray-traced street.
const STREET: &str = "odometer = { scale_std = 0.003, noise_m_per_sqrt_m = 0.01 }
gyroscope = { noise_rad_per_sqrt_s = 0.003, bias_std_radps = 0.002 }
start = { position_std_m = 0.1, heading_std_rad = 0.02 }
array = { position_m = [0.0, 0.0, 1.5], mounting_rad = ";

fn numbers(file: &Path) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(file).unwrap();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
    text.lines().skip(1).map(row).collect()
}

/// Returns the drives with their names.
pub fn drives(guarded: bool) -> Vec<(String, Drive)> {
    let data = PathBuf::from(std::env::var_os("ACCESS_AV_DATA").unwrap());
    let folders = fs::read_dir(data.join("drives")).unwrap();
    let mut folders: Vec<PathBuf> = folders.map(|it| it.unwrap().path()).collect();
    folders.retain(|it| it.is_dir());
    folders.push(data.join("street"));
    folders.sort();
    let drive = |folder: PathBuf| {
        let name = folder
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let drive = read(&folder, &name, guarded);
        (name, drive)
    };
    folders.into_iter().map(drive).collect()
}

fn read(folder: &Path, name: &str, guarded: bool) -> Drive {
    let (kind, sheet) = match name {
        "street" => (Kind::WithoutRoad, STREET),
        _ if name.starts_with("litw") => (Kind::Robot, WOODS),
        _ => (Kind::Robot, MRCLAM),
    };
    let mut site = String::from("name = \"site\"\n");
    for head in numbers(&folder.join("landmarks.csv")) {
        let z_m = head.get(3).copied().unwrap_or(0.0);
        let index = if name == "street" { head[0] - 1.0 } else { 0.0 };
        let _ = write!(
            site,
            "[[radio_heads]]\npci = {}\nssb_index = {index}\nposition_m = [{:?}, {:?}, {z_m:?}]\n",
            head[0], head[1], head[2]
        );
    }
    let start = &numbers(&folder.join("start.csv"))[0];
    let integrity = if guarded { "[integrity]\n" } else { "" };
    let vehicle = format!("name = \"vehicle\"\n{sheet}{:?} }}\n{integrity}", start[3]);
    let odometry = read_odometry_csv(&folder.join("odometry.csv")).unwrap();
    let poses = read_tum(&folder.join("truth.tum")).unwrap();
    let truth = odometry.samples.iter().map(|sample| {
        let nearest = poses.partition_point(|it| it.time_s < sample.time_s);
        poses[nearest.min(poses.len() - 1)].pose
    });
    Drive {
        kind,
        site: Site::from_toml(&site, "site.toml", &Shipped).unwrap(),
        vehicle: Vehicle::from_toml(&vehicle, "vehicle.toml", &Shipped).unwrap(),
        truth: truth.collect(),
        odometry,
        angles: read_angle_log(&folder.join("angles.csv")).unwrap(),
        start: Pose {
            x_m: start[0],
            y_m: start[1],
            heading_rad: start[2],
        },
    }
}
