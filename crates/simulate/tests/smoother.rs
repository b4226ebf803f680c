//! The smoother on simulated drives: better than the filter, and as good as it says.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "this is a test")]

mod common;

use access_av::geometry::Pose;
use access_av::localize::PoseEstimate;
use access_av::recording::Site;
use access_av::replay::{LocatedDrive, locate_angles};
use access_av::scenario::Scenario;
use access_av::simulate::Step;
use toml::Value;

use common::logs;

/// The site of a scenario, for a drive that starts at `pose`.
fn site(scenario: &Scenario, pose: Pose) -> Site {
    let text = Site::of_scenario(scenario, pose, [1.0.into(); 4]);
    Site::from_toml(&text, "site.toml").unwrap()
}

/// Located and smoothed drives of a scenario, beside their truths.
fn drives(scenario: &Scenario, runs: u64) -> Vec<(LocatedDrive, Vec<Step>)> {
    (0..runs)
        .map(|seed| {
            let (odometry, angles, record) = logs(scenario, 100 + seed);
            let site = site(scenario, record.steps[0].truth);
            let drive = locate_angles(&site, &odometry, &angles, true).unwrap();
            assert_eq!(drive.smoothed.len(), drive.poses.len());
            (drive, record.steps)
        })
        .collect()
}

fn error2_m2(estimate: &PoseEstimate, truth: &Step) -> f64 {
    estimate
        .pose
        .point()
        .distance_m(truth.truth.point())
        .powi(2)
}

fn variance_m2(estimate: &PoseEstimate) -> f64 {
    estimate.principal_variances().iter().sum()
}

/// Normalised squared error of the position.
fn nees(estimate: &PoseEstimate, truth: &Step) -> f64 {
    let (dx, dy) = (
        estimate.pose.x_m - truth.truth.x_m,
        estimate.pose.y_m - truth.truth.y_m,
    );
    let [[xx, xy, _], [_, yy, _], _] = estimate.covariance.unwrap();
    (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
}

#[test]
fn smoothed_drives_are_better_and_as_good_as_they_say() {
    let runs = 30;
    for name in ["paper-real-odometry", "paper-real-odometry-2"] {
        let drives = drives(&Scenario::load(name).unwrap(), runs);
        // Mean over a drive of what smoothing takes off the squared error, and ought to.
        let (mut gained, mut promised, mut filtered, mut smoothed) = (vec![], 0.0, 0.0, 0.0);
        for (drive, truths) in &drives {
            let mut gain = 0.0;
            for ((before, after), truth) in drive.poses.iter().zip(&drive.smoothed).zip(truths) {
                let (before, after) = (&before.estimate, &after.estimate);
                assert!(variance_m2(after) <= variance_m2(before) * (1.0 + 1e-9));
                filtered += error2_m2(before, truth);
                smoothed += error2_m2(after, truth);
                gain += error2_m2(before, truth) - error2_m2(after, truth);
                promised += variance_m2(before) - variance_m2(after);
            }
            gained.push(gain / truths.len() as f64);
        }
        let epochs = drives.iter().map(|it| it.1.len() as f64).sum::<f64>();
        let mean = gained.iter().sum::<f64>() / runs as f64;
        let spread = gained.iter().map(|it| (it - mean).powi(2)).sum::<f64>();
        let error = (spread / (runs as f64 * (runs as f64 - 1.0))).sqrt();
        println!(
            "{name}: RMS {:.3} m filtered, {:.3} m smoothed; gain {mean:.4} ± {error:.4} m², \
             promised {:.4} m²",
            (filtered / epochs).sqrt(),
            (smoothed / epochs).sqrt(),
            promised / epochs,
        );
        // The mean over drives, each paired with itself, is above zero, and what was promised.
        assert!(mean > 0.0 && mean > 2.0 * error);
        assert!((mean - promised / epochs).abs() < 4.0 * error);

        // NEES at times a tenth of the drive apart: χ² with two degrees of freedom for each run,
        // within its band of 99.9 % (Wilson and Hilferty), with nine such times 99 % in all.
        let freedom = 2.0 * runs as f64;
        let spread = 2.0 / (9.0 * freedom);
        let [low, high] = [-3.29, 3.29].map(|z: f64| (1.0 - spread + z * spread.sqrt()).powi(3));
        for tenth in 1..10 {
            let place = drives[0].1.len() * tenth / 10;
            let of_drive =
                |it: &(LocatedDrive, Vec<Step>)| nees(&it.0.smoothed[place].estimate, &it.1[place]);
            let mean = drives.iter().map(of_drive).sum::<f64>() / freedom;
            assert!((low..high).contains(&mean), "{name} {tenth}/10: {mean}");
        }
    }
}

#[test]
fn the_last_pose_is_the_filters() {
    let yaw = toml::from_str::<toml::Table>("g = { noise_rad_per_sqrt_s = 1e-3 }").unwrap();
    for changes in [
        vec![],
        vec![("odometer.gyro", yaw["g"].clone())],
        vec![("localizer.map", Value::from(false))],
        vec![("localizer.integrity", Value::from(true))],
    ] {
        let scenario = Scenario::load("paper-real-odometry-2")
            .unwrap()
            .with_overrides(changes)
            .unwrap();
        let (odometry, mut angles, record) = logs(&scenario, 1);
        let site = site(&scenario, record.steps[0].truth);
        let end_s = odometry.samples.last().unwrap().time_s;
        angles.angles.retain(|angle| angle.ssb.time_s < end_s);
        let drive = locate_angles(&site, &odometry, &angles, true).unwrap();
        let (last, smoothed) = (drive.poses.last().unwrap(), drive.smoothed.last().unwrap());
        assert_eq!(last.estimate.pose, smoothed.estimate.pose);
        assert_eq!(last.estimate.covariance, smoothed.estimate.covariance);
        let unasked = locate_angles(&site, &odometry, &angles, false).unwrap();
        assert_eq!(unasked.poses, drive.poses);
        assert!(unasked.smoothed.is_empty());
    }
}

#[test]
fn a_drive_that_was_found_is_smoothed_from_there() {
    let scenario = Scenario::load("paper-real-odometry-2")
        .unwrap()
        .with_overrides([("start.known", false.into())])
        .unwrap();
    let (odometry, angles, record) = logs(&scenario, 1);
    let site = site(&scenario, record.steps[0].truth);
    let drive = locate_angles(&site, &odometry, &angles, true).unwrap();
    let known: Vec<f64> = drive
        .poses
        .iter()
        .filter(|it| it.searching.is_none())
        .map(|it| it.estimate.time_s)
        .collect();
    let smoothed: Vec<f64> = drive.smoothed.iter().map(|it| it.estimate.time_s).collect();
    assert_eq!(smoothed, known);
}
