//! Errors in the files of a drive, and their expected diagnoses.

use std::f64::consts::TAU;

use onboard::settings::DriveKind;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::simulator::{Drive, Kind};

/// Name of an error, and a function that applies it to a drive and returns the words of the
/// expected diagnosis.
pub type Misconfiguration = (&'static str, fn(&mut Drive, &mut ChaCha8Rng) -> Vec<String>);

fn words(text: &[&str]) -> Vec<String> {
    text.iter().map(|it| (*it).to_owned()).collect()
}

fn odometry(drive: &mut Drive, distance: f64, yaw_rate: Option<f64>) {
    for sample in &mut drive.odometry.samples {
        sample.distance_m *= distance;
        sample.speed_mps *= distance;
        sample.yaw_rate_radps = sample.yaw_rate_radps.zip(yaw_rate).map(|(it, by)| it * by);
    }
}

fn any_head(drive: &Drive, rng: &mut ChaCha8Rng) -> usize {
    rng.random_range(0..drive.site.radio_heads.len())
}

fn move_head(drive: &mut Drive, rng: &mut ChaCha8Rng) -> Vec<String> {
    let head = any_head(drive, rng);
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    let head = &mut drive.site.radio_heads[head];
    head.position_m[0] += 10.0 * cos;
    head.position_m[1] += 10.0 * sin;
    vec![format!("pci {} is near", head.pci)]
}

fn exchange_axes(drive: &mut Drive, rng: &mut ChaCha8Rng) -> Vec<String> {
    let head = any_head(drive, rng);
    let head = &mut drive.site.radio_heads[head];
    head.position_m.swap(0, 1);
    vec![format!("x and y of pci {} are exchanged", head.pci)]
}

fn mirror_head(drive: &mut Drive, rng: &mut ChaCha8Rng) -> Vec<String> {
    let head = any_head(drive, rng);
    let head = &mut drive.site.radio_heads[head];
    head.position_m[0] = -head.position_m[0];
    vec![format!("x of pci {} is mirrored", head.pci)]
}

fn exchange_pcis(drive: &mut Drive, rng: &mut ChaCha8Rng) -> Vec<String> {
    let one = any_head(drive, rng);
    let other = (one + 1 + rng.random_range(0..drive.site.radio_heads.len() - 1))
        % drive.site.radio_heads.len();
    let heads = &mut drive.site.radio_heads;
    let mut pcis = [heads[one].pci, heads[other].pci];
    (heads[one].pci, heads[other].pci) = (pcis[1], pcis[0]);
    pcis.sort_unstable();
    vec![format!("pci {} and pci {} are exchanged", pcis[0], pcis[1])]
}

/// Errors of road vehicles and robots.
pub const MISCONFIGURATIONS: [Misconfiguration; 12] = [
    ("one head 10 m off", move_head),
    ("x and y of one head", exchange_axes),
    ("x of one head mirrored", mirror_head),
    ("PCIs exchanged", exchange_pcis),
    ("x and y of all heads", |drive, _| {
        for head in &mut drive.site.radio_heads {
            head.position_m.swap(0, 1);
        }
        words(&["the radio heads' x and y are exchanged"])
    }),
    ("y of all heads mirrored", |drive, _| {
        for head in &mut drive.site.radio_heads {
            head.position_m[1] = -head.position_m[1];
        }
        words(&["the radio heads' y is mirrored"])
    }),
    ("yaw rate zero", |drive, _| {
        odometry(drive, 1.0, Some(0.0));
        words(&["yaw_rate_radps, which is 0 throughout"])
    }),
    ("yaw rate missing", |drive, _| {
        odometry(drive, 1.0, None);
        words(&["no yaw_rate_radps"])
    }),
    ("yaw rate in degrees", |drive, _| {
        odometry(drive, 1.0, Some(1f64.to_degrees()));
        words(&["yaw_rate_radps is in degrees per second"])
    }),
    ("odometer in mm", |drive, _| {
        odometry(drive, 1e3, Some(1.0));
        words(&["in millimetres"])
    }),
    ("sign of the phase", |drive, _| {
        for it in &mut drive.angles.angles {
            it.measured.phase_rad = -it.measured.phase_rad;
        }
        words(&["order of the array's antennas is reversed"])
    }),
    ("robot as road vehicle", |drive, _| {
        drive.vehicle.drive = DriveKind::Road;
        words(&["drive = \"differential\""])
    }),
];

/// Returns the drive with one error and the words of the expected diagnosis; `None` if the error
/// does not apply.
pub fn misconfigured(sound: &Drive, number: usize, seed: u64) -> Option<(Drive, Vec<String>)> {
    let (name, spoil) = MISCONFIGURATIONS[number];
    if name == "robot as road vehicle" && sound.kind != Kind::Robot {
        return None;
    }
    let mut drive = sound.clone();
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let named = spoil(&mut drive, &mut rng);
    Some((drive, named))
}
