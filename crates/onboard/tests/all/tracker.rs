//! The tracker with implausible inputs.

use std::sync::Arc;

use onboard::geometry::Pose;
use onboard::localize::ekf::EkfConfig;
use onboard::localize::{AngleMeasurement, Ekf, UpdateReason};
use onboard::localize::{InitialPose, OdometryResult};
use onboard::observation::OdometrySample;
use onboard::radio_head::RadioHead;
use onboard::road::Road;
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};

use crate::angle;

fn site() -> Site {
    Site::from_library("trip-1", &Shipped).unwrap()
}

fn road() -> Road {
    site().build_road().unwrap().unwrap()
}

fn tracker() -> (Ekf, RadioHead) {
    let vehicle = Vehicle::from_library("paper-carrier", &Shipped).unwrap();
    let heads = RadioHead::received_by(&site(), &vehicle);
    let start = InitialPose {
        pose: Pose::default(),
        position_std_m: 0.5,
        heading_std_rad: 0.01,
    };
    let mut config = EkfConfig::new(&site(), &vehicle);
    // A filter that estimates biases explains an outlier by a large one.
    config.multipath_bias_probability = 0.0;
    let mut tracker = Ekf::new(config, Some(Arc::new(road())), &heads, &start);
    assert_eq!(tracker.odometry(&sample(0.0, 0.0)), OdometryResult::First);
    assert_eq!(
        tracker.odometry(&sample(0.1, 0.4)),
        OdometryResult::Accepted
    );
    (tracker, heads[0])
}

fn sample(time_s: f64, distance_m: f64) -> OdometrySample {
    OdometrySample {
        time_s,
        distance_m,
        speed_mps: 4.0,
        yaw_rate_radps: None,
    }
}

#[test]
fn invalid_angles_are_reported_and_do_not_change_the_state() {
    let (mut tracker, head) = tracker();
    let before = tracker.clone();
    let unknown_head = RadioHead { pci: 999, ..head };
    let here = RadioHead {
        position: tracker.pose(0.1).pose.point(),
        ..head
    };
    let good = angle(0.12, 2.8, 0.01);
    for (head, measured, reason) in [
        (head, angle(0.12, f64::NAN, 0.01), UpdateReason::Unusable),
        (head, angle(f64::NAN, 2.8, 0.01), UpdateReason::Unusable),
        (head, angle(0.12, 2.8, f64::NAN), UpdateReason::Unusable),
        (head, angle(0.12, 2.8, -0.01), UpdateReason::Unusable),
        (head, angle(0.12, 2.8, 0.0), UpdateReason::Unusable),
        (head, angle(0.05, 2.8, 0.01), UpdateReason::TooLate),
        (head, angle(0.12, -1.0, 0.01), UpdateReason::Outlier),
        (unknown_head, good, UpdateReason::UnknownRadioHead),
    ] {
        let verdict = tracker.update(&head, &measured);
        assert_eq!(verdict.reason, reason);
        assert!(!verdict.accepted && verdict.threshold.is_some());
        assert_eq!(tracker, before);
    }
    tracker.set_excluded(&head, true);
    assert_eq!(tracker.update(&head, &good).reason, UpdateReason::Excluded);
    tracker.set_excluded(&head, false);
    assert!(
        tracker.update(&here, &good).accepted,
        "the survey counts, not the caller's place"
    );
    assert_ne!(tracker, before);
}

#[test]
fn an_unverified_angle_is_weighted_by_its_likelihood() {
    let precise = angle(0.12, 0.0, 0.01);
    let after = |off_rad: f64, resolved: bool| {
        let (mut tracker, head) = tracker();
        // The predicted angle plus a small deviation.
        let evidence = tracker.angle_evidence(&head, &precise).unwrap();
        let residual_rad = evidence.innovation.residual;
        let measured = AngleMeasurement {
            phase_rad: off_rad - residual_rad,
            resolved,
            ..precise
        };
        let before = tracker.pose(0.12);
        let verdict = tracker.update(&head, &measured);
        assert_eq!(verdict.accepted, resolved || off_rad < 0.2);
        let moved_m = tracker
            .pose(0.12)
            .pose
            .point()
            .distance_m(before.pose.point());
        (moved_m, tracker.pose(0.12).principal_variances()[0])
    };
    // An angle close to the prediction is most probably correct.
    let ((sure_m, sure_m2), (unsure_m, unsure_m2)) = (after(0.1, true), after(0.1, false));
    assert!(
        unsure_m < sure_m && unsure_m > 0.8 * sure_m,
        "{unsure_m} {sure_m}"
    );
    assert!(unsure_m2 > sure_m2);
    // An angle far from the prediction, but within the gate, contains no information.
    let ((sure_m, _), (unsure_m, _)) = (after(0.33, true), after(0.33, false));
    assert!(sure_m > 0.0);
    assert_eq!(unsure_m, 0.0);
}

#[test]
fn invalid_odometry_is_reported_and_does_not_change_the_state() {
    let (mut tracker, _) = tracker();
    let before = tracker.clone();
    for (sample, verdict) in [
        (sample(0.1, 0.4), OdometryResult::Duplicate),
        (sample(0.05, 0.3), OdometryResult::TimeBackwards),
        (sample(f64::NAN, 0.5), OdometryResult::NotFinite),
        (sample(0.2, f64::INFINITY), OdometryResult::NotFinite),
    ] {
        assert_eq!(tracker.odometry(&sample), verdict);
        assert_eq!(tracker, before);
    }
}

#[test]
fn a_vehicle_leaves_the_map_and_returns() {
    let length_m = road().length_m();
    let (mut tracker, _) = tracker();
    let (mut beyond, mut before) = (0, [0.0; 2]);
    let across = |tracker: &Ekf, time_s: f64| tracker.pose(time_s).principal_variances();
    // Out to 60 m beyond the end and back again, backwards.
    let turn_s = (length_m + 60.0) / 4.0;
    for number in 6..(2.0 * turn_s / 0.02) as u32 {
        let time_s = 0.02 * f64::from(number);
        let place_m = 4.0 * (turn_s - (time_s - turn_s).abs());
        let verdict = tracker.odometry(&sample(time_s, place_m));
        assert!(verdict.accepted(), "{verdict:?}");
        if let OdometryResult::BeyondMap { by_m } = verdict {
            beyond += 1;
            assert!(
                (by_m - (place_m - length_m)).abs() < 1.0,
                "{by_m} {place_m}"
            );
            if beyond > 1 && time_s < turn_s {
                let now = across(&tracker, time_s);
                assert!(
                    now[0] >= before[0] && now[1] >= before[1],
                    "{now:?} {before:?}"
                );
            }
            before = across(&tracker, time_s);
        }
    }
    // The vehicle is beyond the end by more than three standard deviations of the position (0.9 m
    // of scale, 0.5 m of start).
    assert!(beyond > 2 * 50 * 13 && beyond < 2 * 50 * 15, "{beyond}");
    // After sixty metres without a lane, the lateral variance is again that of the lane.
    let lane_m2 = across(&tracker, 2.0 * turn_s)[1];
    assert!(
        before[1] > 2.0 * lane_m2 && lane_m2 < 0.1_f64.powi(2),
        "{before:?} {lane_m2}"
    );
}

#[test]
fn a_gap_is_bridged_and_a_jump_increases_the_covariance() {
    let (mut gap, _) = tracker();
    assert!(matches!(
        gap.odometry(&sample(2.1, 8.4)),
        OdometryResult::AfterGap { .. }
    ));
    let at_m = gap.pose(2.1).pose.x_m;
    assert!((at_m - 8.4).abs() < 0.05, "{at_m}");

    let (mut jump, _) = tracker();
    assert!(matches!(
        jump.odometry(&sample(2.1, 5000.0)),
        OdometryResult::DistanceJump { .. }
    ));
    // The counter is invalid, the speed is valid: 2 s at 4 m/s.
    assert!((jump.pose(2.1).pose.x_m - 8.4).abs() < 0.05);
    let variance = |tracker: &Ekf| tracker.pose(2.1).principal_variances()[0];
    assert!(variance(&jump) > variance(&gap) + 1.0);
}

#[test]
fn the_transition_matrix_propagates_a_covariance_as_the_filter_does() {
    let (tracker, _) = tracker();
    let belief = *tracker.belief();
    for travelled_m in [0.0, 0.2, 4.0, 30.0] {
        let found = (tracker.transition(&belief, travelled_m)).principal_variances(&belief);
        let expected = Ekf::principal_variances(&tracker.carry(belief, travelled_m));
        for (found, expected) in found.into_iter().zip(expected) {
            let ratio = found / expected;
            assert!((ratio - 1.0).abs() < 1e-9, "{travelled_m} m: {ratio}");
        }
    }
}
