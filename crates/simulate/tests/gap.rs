//! A drive through a stretch of road that was not surveyed: what the map gives there is a guess,
//! and the road leaves it by metres.
#![allow(clippy::unwrap_used, reason = "this is a test")]

mod common;

use std::sync::Arc;

use access_av::localize::Tracker;
use access_av::localize::tracker::{InitialPose, OdometryVerdict, TrackerConfig};
use access_av::observation::OdometrySample;
use access_av::recording::Site;
use access_av::replay::{LocatedDrive, LocatedPose, locate_angles};
use access_av::scenario::{LocalizerSettings, Scenario};
use access_av::simulate::RunRecord;
use access_av::world::Gap;

/// Road on both sides of the gap (m) ...
const SURVEYED_M: f64 = 90.0;
/// ... and the gap's bends to and fro: quarters of this radius (m) and turn (rad), which leave the
/// chord by `2 R (1 − cos a)`, 2.0 m, and come back to it in its direction after `4 R sin a`.
const RADIUS_M: f64 = 200.0;
const TURN_RAD: f64 = 0.1;

fn with_road(scenario: &Scenario, turn_rad: f64, gap: &str) -> Scenario {
    let surveyed = format!("{{ length_m = {SURVEYED_M}, turn_rad = {turn_rad:?} }}");
    let road = format!("it = [{surveyed}, {gap}, {surveyed}]");
    let road = toml::from_str::<toml::Table>(&road).unwrap()["it"].clone();
    scenario.with_overrides([("track.segments", road)]).unwrap()
}

fn gap_m() -> f64 {
    4.0 * RADIUS_M * TURN_RAD.sin()
}

/// The paper's trip; the road bends by about as much as it does in the gap.
fn scenario() -> Scenario {
    Scenario::load("paper-real-odometry-2")
        .unwrap()
        .with_overrides([
            ("localizer.curvature_rms_per_m", (1.0 / RADIUS_M).into()),
            (
                "localizer.curvature_correlation_m",
                (2.0 * RADIUS_M * TURN_RAD).into(),
            ),
        ])
        .unwrap()
}

/// A drive on the true road, located by a map that has the chord instead, and smoothed.
fn drive(seed: u64, surveyed: bool) -> (LocatedDrive, RunRecord) {
    let scenario = scenario();
    let side = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
    let quarter = |sign: f64| {
        let (length_m, turn_rad) = (RADIUS_M * TURN_RAD, side * sign * TURN_RAD);
        format!("{{ length_m = {length_m:?}, turn_rad = {turn_rad:?} }}")
    };
    let bends = [1.0, -1.0, -1.0, 1.0].map(quarter).join(", ");
    let (odometry, angles, record) = common::logs(&with_road(&scenario, 0.1, &bends), seed);

    let chord = format!("{{ length_m = {:?}, surveyed = {surveyed} }}", gap_m());
    let map = with_road(&scenario, 0.1, &chord);
    let text = Site::of_scenario(&map, record.steps[0].truth, [1.0.into(); 4]);
    let site = Site::from_toml(&text, "site.toml").unwrap();
    (
        locate_angles(&site, &odometry, &angles, true).unwrap(),
        record,
    )
}

/// Squared error of a pose against its covariance, per dimension, and against the larger
/// of its principal variances.
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
fn through_the_gap_and_after_it_as_wrong_as_it_says() {
    let runs = 64;
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
        // The start is known exactly.
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
    // Half a χ² of two degrees of freedom has mean and deviation one.
    for (nees, time_s) in nees.iter().flat_map(|nees| nees.iter().zip(after_s)) {
        let deviation = (nees - 1.0).abs() * (runs as f64).sqrt();
        assert!(deviation < 4.0, "{time_s} s: {nees}");
    }
}

#[test]
fn the_guess_taken_for_the_road_leads_astray() {
    for seed in 0..2 {
        let (located, record) = drive(seed, true);
        let squares = located.poses.iter().skip(50).map(|it| error(it, &record).1);
        assert!(squares.fold(0.0, f64::max) > 16.0);
    }
}

/// A tracker that hears nothing, on a straight road.
fn tracker(at_m: f64, aside_m: f64, position_std_m: f64) -> (Tracker, Gap) {
    let chord = format!("{{ length_m = {:?}, surveyed = false }}", gap_m());
    let scenario = with_road(&scenario(), 0.0, &chord);
    let LocalizerSettings::Tracker(settings) = scenario.localizer else {
        unreachable!("the scenario uses the tracker");
    };
    let map = Arc::new(scenario.build_track().unwrap());
    let gap = map.gap_between(0.0, map.length_m()).unwrap();
    let start = InitialPose {
        pose: map.pose(at_m).offset_left(aside_m),
        position_std_m,
        heading_std_rad: 0.01,
    };
    let config = TrackerConfig::new(&scenario, &settings);
    (Tracker::new(config, Some(map), &[], &start), gap)
}

/// Odometry at 4 m/s.
fn sample(number: u32) -> OdometrySample {
    let time_s = 0.02 * f64::from(number);
    OdometrySample {
        time_s,
        distance_m: 4.0 * time_s,
        speed_mps: 4.0,
        yaw_rate_radps: None,
    }
}

#[test]
fn the_gap_is_told_and_costs_certainty_until_the_lane_is_kept_again() {
    let (mut tracker, gap) = tracker(60.0, 0.0, 0.1);
    assert_eq!(tracker.odometry(&sample(0)), OdometryVerdict::First);
    let lane_m2 = tracker.config().lane_keeping.stationary()[0];
    let (mut told_m, mut before) = (Vec::new(), 0.0);
    for number in 1..(150 * 50 / 4) {
        let verdict = tracker.odometry(&sample(number));
        let along_m = 60.0 + 0.08 * f64::from(number);
        let [larger, smaller] = tracker.pose(0.02 * f64::from(number)).principal_variances();
        if verdict == OdometryVerdict::Accepted {
            // Across the road it is as sure as the lane is kept, or surer.
            assert!(smaller < (1.0 + 1e-9) * lane_m2, "{along_m} {smaller}");
        } else {
            let Gap { from_m, to_m } = gap;
            assert_eq!(verdict, OdometryVerdict::InMapGap { from_m, to_m });
            if !told_m.is_empty() {
                assert!(larger > before, "{along_m}");
            }
            before = larger;
            told_m.push(along_m);
        }
    }
    // By then the place is known to 0.1 m of start, 0.003 of scale and 0.01 m per √m, and the
    // verdict comes a sample later.
    let margin_m =
        |driven_m: f64| 3.0 * (0.01 + (0.003 * driven_m).powi(2) + 1e-4 * driven_m).sqrt() + 0.08;
    let (first_m, last_m) = (told_m[0], told_m[told_m.len() - 1]);
    let (early_m, late_m) = (gap.from_m - first_m, last_m - gap.to_m);
    assert!(early_m > 0.0 && early_m < margin_m(30.0), "{early_m}");
    assert!(late_m > 0.0 && late_m < margin_m(111.0), "{late_m}");
    // Eighty metres of a path that bends as it likes.
    assert!(before > 1.0, "{before}");
}

#[test]
fn a_start_in_the_gap_is_not_drawn_to_the_guess() {
    let (tracker, _) = tracker(130.0, 2.0, 0.5);
    let (on_the_guess, _) = self::tracker(130.0, 0.0, 0.5);
    let pose = tracker.pose(0.0);
    let moved_m = (pose.pose.point()).distance_m(on_the_guess.pose(0.0).pose.point());
    assert!((moved_m - 2.0).abs() < 1e-9, "{moved_m}");
    for variance in pose.principal_variances() {
        assert!((variance - 0.25).abs() < 1e-9, "{variance}");
    }
}
