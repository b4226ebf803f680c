//! The smoother on simulated drives is more accurate than the filter and consistent.

use onboard::localize::PoseEstimate;
use recording::replay::{LocatedDrive, StartChoice, locate_angles};
use recording::{AngleLog, OdometryLog};
use simulate::scenario::Scenario;
use simulate::{RunRecord, Step};
use toml::Value;

use crate::common::{changed, logs, unguarded, value};

/// Locates a run of a scenario, from its true start if the start is known.
fn locate(
    scenario: &Scenario,
    (odometry, angles, record): &(OdometryLog, AngleLog, RunRecord),
    smooth: bool,
) -> LocatedDrive {
    let (site, vehicle) = (&scenario.site, &scenario.vehicle);
    let start = if vehicle.start.known {
        StartChoice::At(record.steps[0].truth)
    } else {
        StartChoice::Unknown
    };
    locate_angles(site, vehicle, start, odometry, angles, smooth).unwrap()
}

/// Returns located and smoothed drives of a scenario with their truths.
fn drives(scenario: &Scenario, runs: u64) -> Vec<(LocatedDrive, Vec<Step>)> {
    (0..runs)
        .map(|seed| {
            let logs = logs(scenario, 100 + seed);
            let drive = locate(scenario, &logs, true);
            assert_eq!(drive.smoothed.len(), drive.poses.len());
            (drive, logs.2.steps)
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

/// Returns the normalised squared error of the position (NEES).
fn nees(estimate: &PoseEstimate, truth: &Step) -> f64 {
    let (dx, dy) = (
        estimate.pose.x_m - truth.truth.x_m,
        estimate.pose.y_m - truth.truth.y_m,
    );
    let [[xx, xy, _], [_, yy, _], _] = estimate.covariance.unwrap();
    (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
}

#[test]
fn smoothed_drives_are_more_accurate_and_consistent() {
    let runs = 16;
    for name in ["paper-real-odometry", "paper-real-odometry-2"] {
        let drives = drives(&unguarded(name), runs);
        // Mean over a drive of the reduction of the squared error by smoothing, actual and
        // predicted.
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
        // The mean over drives of the paired difference is above zero and equals the predicted
        // reduction.
        assert!(mean > 0.0 && mean > 2.0 * error);
        assert!((mean - promised / epochs).abs() < 4.0 * error);

        // NEES at times a tenth of the drive apart: χ² with two degrees of freedom per run, within
        // its 99.9 % interval (Wilson and Hilferty). With nine times, the joint level is 99 %.
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
fn the_last_smoothed_pose_equals_the_filtered_pose() {
    let yaw = value("{ noise_rad_per_sqrt_s = 1e-3 }");
    // The covariance with integrity monitoring also includes alternative hypotheses. Here biases
    // and outliers are excluded. The part of the noisier odometer is proportional to its prior.
    let part = |prior: f64| 0.01 * prior / 3e-6;
    let precise = [
        ("vehicle.array.mounting_std_rad", 0.0.into()),
        ("vehicle.array.phase_std_rad", 0.0.into()),
        ("vehicle.receiver.multipath_bias_probability", 0.0.into()),
        (
            "vehicle.integrity",
            value("{ fault_probability = { odometer = 1e-9, site_frame_offset = 0 } }"),
        ),
    ];
    let mut rarely_noisy = precise.to_vec();
    rarely_noisy[3].1 = value("{ fault_probability = { odometer = 3e-6, site_frame_offset = 0 } }");
    for (changes, covered) in [
        (vec![], 0.0),
        (vec![("vehicle.gyroscope", yaw)], 0.0),
        (vec![("vehicle.localizer.map", Value::from(false))], 0.0),
        (precise.to_vec(), part(1e-9)),
        (rarely_noisy, part(3e-6)),
        (vec![("vehicle.integrity", value("{}"))], 1.0),
    ] {
        let scenario = changed("paper-real-odometry-2", changes);
        let mut logs = logs(&scenario, 1);
        let end_s = logs.0.samples.last().unwrap().time_s;
        logs.1.angles.retain(|angle| angle.ssb.time_s < end_s);
        let drive = locate(&scenario, &logs, true);
        let (last, smoothed) = (drive.poses.last().unwrap(), drive.smoothed.last().unwrap());
        assert_eq!(last.estimate.pose, smoothed.estimate.pose);
        let [filtered, smoothed_entry] = [last, smoothed].map(|it| it.estimate.covariance.unwrap());
        for (filtered, smoothed_entry) in filtered
            .as_flattened()
            .iter()
            .zip(smoothed_entry.as_flattened())
        {
            let most = covered * (smoothed_entry.abs() + 1e-3);
            assert!(
                (filtered - smoothed_entry).abs() <= most,
                "{covered}: {filtered} {smoothed_entry}"
            );
        }
        let filtered_only = locate(&scenario, &logs, false);
        assert_eq!(filtered_only.poses, drive.poses);
        assert!(filtered_only.smoothed.is_empty());
    }
}

#[test]
fn a_drive_with_an_unknown_start_is_smoothed_after_initialisation() {
    let unknown = [("vehicle.start.known", false.into())];
    let scenario = changed("paper-real-odometry-2", unknown);
    let drive = locate(&scenario, &logs(&scenario, 1), true);
    let known: Vec<f64> = drive
        .poses
        .iter()
        .filter(|it| it.searching.is_none())
        .map(|it| it.estimate.time_s)
        .collect();
    let smoothed: Vec<f64> = drive.smoothed.iter().map(|it| it.estimate.time_s).collect();
    assert_eq!(smoothed, known);
}
