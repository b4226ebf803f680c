//! Late signals in drives with delays of the SSBs: a step of the vehicle's clock, a blocked first path, and clocks that
//! are worse than specified.

use simulate::RunRecord;
use toml::Value;

use crate::common::{self, shipped, value};

/// Start of the faults (s).
const FROM_S: f64 = 8.0;

/// Returns a drive of 60 m past four radio heads on one oscillator. The receiver measures angles, delays and range
/// rates in the samples.
fn drive(more: &[(&'static str, Value)]) -> RunRecord {
    let heads = shipped("paper-real-odometry-4").site.radio_heads;
    let heads = heads.iter().map(|head| {
        let mut head = toml::Table::try_from(head).unwrap();
        head.insert("clock_group".into(), 1.into());
        head.insert("clock_offset_std_ns".into(), 50.0.into());
        head.insert("clock_wander_ns_per_sqrt_s".into(), 0.05.into());
        Value::Table(head)
    });
    let mut overrides = vec![
        ("fidelity", Value::from("iq")),
        ("site.radio_heads", Value::Array(heads.collect())),
        (
            "site.road.segments",
            value("[{ length_m = 60.0, turn_rad = 0.1 }]"),
        ),
        ("vehicle.wake_up.interval_ms", Value::from(100.0)),
        ("vehicle.ranging.kind", Value::from("one-way")),
        ("vehicle.integrity.enabled", Value::from(true)),
    ];
    overrides.extend(more.iter().cloned());
    common::run(&common::changed("paper-real-odometry-4", overrides), 5, 0)
}

fn rms_m(record: &RunRecord) -> f64 {
    let square: f64 = record.steps.iter().map(|step| step.error_m().powi(2)).sum();
    (square / record.steps.len() as f64).sqrt()
}

/// Returns the number of `ok` steps, and of those whose error exceeds the protection level.
fn ok_and_beyond(record: &RunRecord) -> [usize; 2] {
    let of_step = |step: &simulate::Step| {
        let level_m = step.level_while_ok_m()?;
        Some(step.error_m() > f64::from(level_m))
    };
    let ok: Vec<bool> = record.steps.iter().filter_map(of_step).collect();
    [ok.len(), ok.iter().filter(|it| **it).count()]
}

#[test]
fn late_signals_and_poor_clocks_displace_no_pose_beyond_its_level() {
    let angles = drive(&[("vehicle.ranging.kind", Value::from("two-way"))]);
    assert_eq!(angles.ranges, 0);
    let usual = drive(&[]);
    let late = |which: &str, by_ns: f64| {
        let fault = format!("kind = 'late-arrival', by_ns = {by_ns:?}{which}");
        value(&format!(
            "[{{ from_s = {FROM_S:?}, until_s = 100.0, what = {{ {fault} }} }}]"
        ))
    };
    let faults: [&[(&str, Value)]; 4] = [
        &[("faults", late("", 100.0))],
        &[("faults", late(", radio_head = 1", 66.7))],
        &[("iq.clock_error_scale", Value::from(3.0))],
        &[("iq.clock_error_scale", Value::from(10.0))],
    ];
    let describe = |name: &str, record: &RunRecord| {
        let [ok, beyond] = ok_and_beyond(record);
        println!(
            "{name}: RMS {:.3} m, {ok} of {} steps ok, {beyond} beyond, {} of {} ranges used",
            rms_m(record),
            record.steps.len(),
            record.accepted_ranges,
            record.ranges
        );
    };
    describe("angles", &angles);
    describe("delays", &usual);
    let faulty = faults.map(drive);
    for record in &faulty {
        describe("fault", record);
    }
    for record in &faulty {
        let [ok, beyond] = ok_and_beyond(record);
        assert!(100 * beyond <= ok, "{beyond} of {ok}");
        // The fault has an effect, and the ranges are used again.
        assert!((rms_m(record) - rms_m(&usual)).abs() > 1e-6);
        assert!(record.accepted_ranges > usual.accepted_ranges / 2);
    }
    for record in &faulty {
        assert!(rms_m(record) < 1.1 * rms_m(&angles));
        assert_eq!(ok_and_beyond(record)[0], ok_and_beyond(&angles)[0]);
    }
}
