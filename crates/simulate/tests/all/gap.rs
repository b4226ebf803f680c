//! Drive through an unsurveyed section of the road: the map contains a guess, and the true road
//! deviates from it by metres.

use crate::common;
use onboard::settings::{Shipped, TomlFile};
use recording::replay::{LocatedDrive, LocatedPose, StartChoice, locate_angles};
use simulate::RunRecord;
use simulate::scenario::Scenario;
use toml::Value;

use crate::common::{changed, value};

/// Length of the surveyed road on each side of the gap (m).
const SURVEYED_M: f64 = 90.0;
/// Radius of the four bends in the gap (m). With the angle a of each bend, the road leaves the
/// chord by `2 R (1 − cos a)` = 2.0 m and returns to its direction after `4 R sin a`.
const RADIUS_M: f64 = 200.0;
/// Angle of each bend in the gap (rad).
const TURN_RAD: f64 = 0.1;

fn with_road(scenario: &Scenario, gap: &str) -> Scenario {
    let surveyed = format!("{{ length_m = {SURVEYED_M}, turn_rad = 0.1 }}");
    let road = value(&format!("[{surveyed}, {gap}, {surveyed}]"));
    let changes = [("site.road.segments", road)];
    scenario.with_overrides(changes, &Shipped).unwrap()
}

fn gap_m() -> f64 {
    4.0 * RADIUS_M * TURN_RAD.sin()
}

/// Returns the paper's trip without a time offset. The curvature statistics match the bends in the
/// gap.
fn scenario() -> Scenario {
    changed(
        "paper-real-odometry-2",
        [
            (
                "vehicle.localizer.curvature_rms_per_m",
                Value::from(1.0 / RADIUS_M),
            ),
            (
                "vehicle.localizer.curvature_correlation_m",
                (2.0 * RADIUS_M * TURN_RAD).into(),
            ),
            ("vehicle.receiver.angle_time_offset_std_s", 0.0.into()),
        ],
    )
}

/// Simulates a drive on the true road, locates it with a map that contains the chord, and smooths
/// it.
fn drive(seed: u64, surveyed: bool) -> (LocatedDrive, RunRecord) {
    let scenario = scenario();
    let side = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
    let quarter = |sign: f64| {
        let (length_m, turn_rad) = (RADIUS_M * TURN_RAD, side * sign * TURN_RAD);
        format!("{{ length_m = {length_m:?}, turn_rad = {turn_rad:?} }}")
    };
    let bends = [1.0, -1.0, -1.0, 1.0].map(quarter).join(", ");
    let (odometry, angles, record) = common::logs(&with_road(&scenario, &bends), seed);

    let chord = format!("{{ length_m = {:?}, surveyed = {surveyed} }}", gap_m());
    let map = with_road(&scenario, &chord);
    let start = StartChoice::At(record.steps[0].truth);
    let (site, vehicle) = (&map.site, &map.vehicle);
    (
        locate_angles(site, vehicle, start, &odometry, &angles, true).unwrap(),
        record,
    )
}

/// Returns the squared error of a pose, normalised by its covariance (per dimension) and by the
/// larger of its principal variances.
fn error(pose: &LocatedPose, record: &RunRecord) -> (f64, f64) {
    let number = (pose.estimate.time_s / 0.02).round() as usize;
    let truth = record.steps[number].truth;
    let (dx, dy) = (
        pose.estimate.pose.x_m - truth.x_m,
        pose.estimate.pose.y_m - truth.y_m,
    );
    let [[xx, xy, _], [_, yy, _], _] = pose.estimate.covariance.unwrap();
    let nees = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
    let [larger, _] = pose.estimate.principal_variances();
    (0.5 * nees, (dx * dx + dy * dy) / larger)
}

#[test]
fn errors_in_the_gap_and_after_it_are_consistent() {
    let runs = 16;
    // The gap lasts from 24 to 46 s.
    let after_s = [47.0, 50.0, 55.0, 60.0, 65.0];
    let mut nees = [[0.0; 5]; 2];
    for seed in 0..runs {
        let (located, record) = drive(seed, false);
        let remarks: Vec<&str> = located.remarks.iter().map(|it| it.text.as_str()).collect();
        assert!(
            matches!(remarks[..], [one] if one.contains("not surveyed from 90.0 to 169.9 m")),
            "{remarks:?}"
        );
        // The start is known exactly, with a singular covariance.
        for pose in located.poses.iter().skip(50) {
            let (_, square) = error(pose, &record);
            assert!(square < 16.0, "{} s: {square}", pose.estimate.time_s);
        }
        for (nees, poses) in nees.iter_mut().zip([&located.poses, &located.smoothed]) {
            for (nees, time_s) in nees.iter_mut().zip(after_s) {
                let then = |it: &&LocatedPose| (it.estimate.time_s - time_s).abs() < 0.005;
                *nees += error(poses.iter().find(then).unwrap(), &record).0 / runs as f64;
            }
        }
    }
    // Half of a χ² variable with two degrees of freedom has mean one and standard deviation one.
    for (nees, time_s) in nees.iter().flat_map(|nees| nees.iter().zip(after_s)) {
        let deviation = (nees - 1.0).abs() * (runs as f64).sqrt();
        assert!(deviation < 4.0, "{time_s} s: {nees}");
    }
}

#[test]
fn a_guess_that_is_declared_as_surveyed_gives_inconsistent_errors() {
    for seed in 0..2 {
        let (located, record) = drive(seed, true);
        let squares = located.poses.iter().skip(50).map(|it| error(it, &record).1);
        assert!(squares.fold(0.0, f64::max) > 16.0);
    }
}
