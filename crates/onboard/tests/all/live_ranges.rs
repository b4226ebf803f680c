//! Ranges of a live drive: a vehicle is located by two-way ranges alone, and ranges of another kind
//! or unit are rejected.

use onboard::geometry::Pose;
use onboard::live::{LiveError, RangeObservation, RangeValue, State};
use onboard::localize::UpdateReason;
use onboard::observation::OdometrySample;
use onboard::settings::{Platform, Shipped, Site, TomlFile, Vehicle};
use onboard::{Custom, Live};

const HEADS: [(u16, [f64; 3]); 3] = [
    (1, [-20.0, 12.0, 5.0]),
    (2, [20.0, -10.0, 5.0]),
    (3, [60.0, 14.0, 5.0]),
];
const SPEED_MPS: f64 = 1.5;

fn live(ranging: &str) -> Live {
    let head = |(pci, position): &(u16, [f64; 3])| {
        format!("[[radio_heads]]\npci = {pci}\nposition_m = {position:?}\n")
    };
    let heads: Vec<String> = HEADS.iter().map(head).collect();
    let site = "name = \"hall\"\n".to_owned() + &heads.concat();
    let vehicle = "name = \"cart\"\ndrive = \"differential\"\n".to_owned() + ranging;
    let site = Site::from_toml(&site, "site", &Shipped).unwrap();
    let vehicle = Vehicle::from_toml(&vehicle, "vehicle", &Shipped).unwrap();
    let platform = Platform::from_library(&vehicle.platform.name, &Shipped).unwrap();
    let start = Some(Pose::default());
    Live::new(&site, &vehicle, &platform, start, None, Custom::default()).unwrap()
}

fn range(time_s: f64, head: usize, value: RangeValue) -> RangeObservation {
    RangeObservation {
        pci: HEADS[head].0,
        ssb_index: 0,
        time_s,
        value,
        sigma: None,
    }
}

#[test]
fn ranges_locate_a_vehicle() {
    let mut live = live("[ranging]\nsigma_m = 0.1\nscale_std = 0.0\noffset_std_m = 0.1\n");
    for step in 0..300 {
        let time_s = 0.1 * f64::from(step);
        // The odometer measures 3 % too much.
        let mut sample = OdometrySample::of_speed(time_s, 1.03 * SPEED_MPS, Some(0.0));
        sample.distance_m = 1.03 * SPEED_MPS * time_s;
        live.odometry(&sample).unwrap();
        // The range was measured 30 ms before the odometry.
        let (head, measured_s) = (step as usize % 3, time_s - 0.03);
        if measured_s > 0.0 {
            let [x_m, y_m, z_m] = HEADS[head].1;
            let range_m = (SPEED_MPS * measured_s - x_m).hypot(y_m).hypot(z_m);
            let verdict = live
                .range(&range(measured_s, head, RangeValue::RangeM(range_m)))
                .unwrap();
            assert_eq!(verdict.reason, UpdateReason::Consistent, "{time_s}");
        }
    }
    let status = live.status(29.9).unwrap();
    let pose = status.pose.unwrap();
    // Dead reckoning would be 1.3 m off.
    assert!((pose.x_m - SPEED_MPS * 29.9).abs() < 0.3, "{}", pose.x_m);
    assert!(pose.y_m.abs() < 0.3, "{}", pose.y_m);
    assert_eq!(status.state, State::Ok, "{}", status.reason);
}

#[test]
fn unknown_kinds_and_units_are_rejected() {
    let rejected = |live: &mut Live, value| match live.range(&range(0.0, 0, value)) {
        Err(LiveError::Value { allowed, .. }) => allowed,
        other => panic!("{other:?}"),
    };
    let mut without = live("");
    without
        .odometry(&OdometrySample::of_speed(0.0, 1.0, Some(0.0)))
        .unwrap();
    assert!(rejected(&mut without, RangeValue::RangeM(20.0)).contains("two-way"));
    let mut one_way = live("[ranging]\nkind = \"one-way\"\nsigma_m = 1.0\n");
    one_way
        .odometry(&OdometrySample::of_speed(0.0, 1.0, Some(0.0)))
        .unwrap();
    assert!(rejected(&mut one_way, RangeValue::RangeM(20.0)).contains("two-way"));
    assert!(rejected(&mut one_way, RangeValue::DelayNs(6.7e-8)).contains("in seconds"));
    assert!(rejected(&mut one_way, RangeValue::DelayNs(1e12)).contains("unit"));
    let mut decreasing = range(0.0, 0, RangeValue::DelayNs(f64::NAN));
    assert!(one_way.range(&decreasing).is_err());
    decreasing.value = RangeValue::DelayNs(70.0);
    decreasing.time_s = f64::NAN;
    assert!(one_way.range(&decreasing).is_err());
}
