//! Tracker without angles on an unsurveyed stretch of the road.

use std::sync::Arc;

use onboard::localize::Ekf;
use onboard::localize::ekf::EkfConfig;
use onboard::localize::{InitialPose, OdometryResult};
use onboard::observation::OdometrySample;
use onboard::road::Gap;
use onboard::settings::{Shipped, Site, TomlFile, Vehicle};

/// Radius of the bends that the road may have in the gap (m).
const RADIUS_M: f64 = 200.0;
/// Heading change of the bends that the road may have in the gap (rad).
const TURN_RAD: f64 = 0.1;

/// Returns a tracker on a straight road: 90 m, 80 m unsurveyed, and 90 m.
fn tracker(at_m: f64, aside_m: f64, position_std_m: f64) -> (Ekf, Gap) {
    let gap_m = 4.0 * RADIUS_M * TURN_RAD.sin();
    let road = format!(
        "extends = 'trip-2'\n[road]\nsegments = [{{ length_m = 90.0 }}, \
         {{ length_m = {gap_m:?}, surveyed = false }}, {{ length_m = 90.0 }}]"
    );
    let site = Site::from_toml(&road, "site.toml", &Shipped).unwrap();
    let bends = [
        ("localizer.curvature_rms_per_m", (1.0 / RADIUS_M).into()),
        (
            "localizer.curvature_correlation_m",
            (2.0 * RADIUS_M * TURN_RAD).into(),
        ),
    ];
    let carrier = Vehicle::from_library("paper-carrier", &Shipped).unwrap();
    let vehicle = carrier.with_overrides(bends, &Shipped).unwrap();
    let map = Arc::new(site.build_road().unwrap().unwrap());
    let gap = map.gap_between(0.0, map.length_m()).unwrap();
    let start = InitialPose {
        pose: map.pose(at_m).offset_left(aside_m),
        position_std_m,
        heading_std_rad: 0.01,
    };
    let config = EkfConfig::new(&site, &vehicle);
    (Ekf::new(config, Some(map), &[], &start), gap)
}

/// Returns an odometry sample at 4 m/s.
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
fn the_gap_is_reported_and_increases_the_covariance_until_the_lane_is_followed_again() {
    let (mut tracker, gap) = tracker(60.0, 0.0, 0.1);
    assert_eq!(tracker.odometry(&sample(0)), OdometryResult::First);
    let lane_m2 = tracker.config().lane_keeping.stationary()[0];
    let (mut reported_m, mut before) = (Vec::new(), 0.0);
    for number in 1..(150 * 50 / 4) {
        let verdict = tracker.odometry(&sample(number));
        let along_m = 60.0 + 0.08 * f64::from(number);
        let [larger, smaller] = tracker.pose(0.02 * f64::from(number)).principal_variances();
        if verdict == OdometryResult::Accepted {
            // Across the road, the standard deviation is at most that of the lane keeping.
            assert!(smaller < (1.0 + 1e-9) * lane_m2, "{along_m} {smaller}");
        } else {
            let Gap { from_m, to_m } = gap;
            assert_eq!(verdict, OdometryResult::InMapGap { from_m, to_m });
            if !reported_m.is_empty() {
                assert!(larger > before, "{along_m}");
            }
            before = larger;
            reported_m.push(along_m);
        }
    }
    // At that time, the position error consists of 0.1 m of the start, a scale error of 0.003 and
    // 0.01 m per √m; the verdict follows one sample later.
    let margin_m =
        |driven_m: f64| 3.0 * (0.01 + (0.003 * driven_m).powi(2) + 1e-4 * driven_m).sqrt() + 0.08;
    let (first_m, last_m) = (reported_m[0], reported_m[reported_m.len() - 1]);
    let (early_m, late_m) = (gap.from_m - first_m, last_m - gap.to_m);
    assert!(early_m > 0.0 && early_m < margin_m(30.0), "{early_m}");
    assert!(late_m > 0.0 && late_m < margin_m(111.0), "{late_m}");
    // Standard deviation after 80 m of an unknown path.
    assert!(before > 1.0, "{before}");
}

#[test]
fn a_start_in_the_gap_is_not_biased_towards_the_assumed_road() {
    let (tracker, _) = tracker(130.0, 2.0, 0.5);
    let (on_the_guess, _) = self::tracker(130.0, 0.0, 0.5);
    let pose = tracker.pose(0.0);
    let moved_m = (pose.pose.point()).distance_m(on_the_guess.pose(0.0).pose.point());
    assert!((moved_m - 2.0).abs() < 1e-9, "{moved_m}");
    for variance in pose.principal_variances() {
        assert!((variance - 0.25).abs() < 1e-9, "{variance}");
    }
}
