//! Protection levels and alarms on simulated drives, nominal and under faults.
//!
//! The promises are 1e-3 and 1e-2 of the epochs in state `ok`; the command
//! `cargo run --release -p simulate --example integrity_table` counts them over millions. Here a
//! few runs are held to what chance allows for their number: the epochs of a run hang together over
//! tens of seconds, a run being worth about eight of them.

use crate::common;
use onboard::localize::IntegrityState;
use simulate::scenario::{FaultKind, FaultSettings, Scenario};
use simulate::{IntegritySummary, Step};
use toml::Value;

use crate::common::{changed, drives, shipped, value};

const SEED: u64 = 77;
const ALERT_LIMIT_M: f64 = 1.5;

fn scenario(faults: Vec<FaultSettings>) -> Scenario {
    Scenario {
        faults,
        ..shipped("nlos-and-faults")
    }
}

fn fault(from_s: f64, until_s: f64, what: FaultKind) -> FaultSettings {
    FaultSettings {
        from_s,
        until_s,
        what,
    }
}

fn summaries(scenario: &Scenario, runs: usize) -> Vec<IntegritySummary> {
    common::campaign(scenario, SEED, runs).integrity
}

/// The yard of a guarded vehicle that listens every 100 ms, and this otherwise.
fn yard_every_100_ms(key: &str, otherwise: Value) -> Scenario {
    let often = value("{ policy = 'fixed', interval_ms = 100.0 }");
    changed(
        "yard",
        [
            ("vehicle.integrity", value("{}")),
            ("vehicle.wake_up", often),
            (key, otherwise),
        ],
    )
}

/// Most runs of `runs` that may leave the protection level at all where the risk is `risk`: of 8
/// independent looks in each the expected number, and four deviations of its Poisson spread.
fn most_affected(runs: usize, risk: f64) -> usize {
    let expected = 8.0 * runs as f64 * risk;
    (expected + 4.0 * expected.sqrt()).ceil() as usize
}

#[test]
fn nominal_drives_are_ok_and_within_their_level() {
    let runs = 16;
    let summaries = summaries(&scenario(Vec::new()), runs);
    let affected = (summaries.iter())
        .filter(|run| run.beyond > run.ok / 100)
        .count();
    assert!(affected <= most_affected(runs, 1e-3), "{affected}");
    let total = IntegritySummary::sum(&summaries);
    // At departure, until the angles exclude slip: with estimated biases that takes some metres, in which the level may
    // pass the alert limit more than once.
    assert!(total.alarms <= 3 * runs, "{}", total.alarms);
    let ok = total.ok as f64 / total.epochs as f64;
    assert!(ok > 0.98, "{ok}");
    // The median over a run wanders by a third of itself; over n runs by that over √n.
    let ratio = total.median_ratio();
    let chance = 4.0 * 0.33 / (runs as f64).sqrt();
    assert!(ratio < 6.0 * (1.0 + chance) && ratio > 3.0, "{ratio}");
}

/// Noisier angles are no fault of a radio head: the level grows with them.
#[test]
fn less_k_than_believed_is_no_fault() {
    let scenario = yard_every_100_ms("truth.site.rician_k_db", value("5.0"));
    let (mut unavailable, mut beyond, mut all) = (0, 0, 0);
    for step in drives(&scenario, SEED, 2).iter().flat_map(|it| &it.steps) {
        let integrity = step.integrity.unwrap();
        let ok = integrity.state == IntegrityState::Ok;
        all += 1;
        unavailable += usize::from(integrity.state == IntegrityState::Unavailable);
        beyond += usize::from(ok && step.error_m() > integrity.protection_level_m);
    }
    assert!(20 * unavailable < all, "{unavailable} of {all}");
    assert!(1000 * beyond <= all, "{beyond} of {all}");
}

/// Reflections make the angles of some radio heads vary thirty times as much as stated: the others are as sound as
/// before, and the place at hand is not left for one that explains a few angles better.
#[test]
fn reflections_do_not_take_the_vehicle_elsewhere() {
    let scenario = yard_every_100_ms("channel", value("{ model = 'inf-sh' }"));
    let errors_m = drives(&scenario, 1, 1);
    let errors_m = (errors_m.iter().flat_map(|it| &it.steps)).map(Step::error_m);
    let farthest_m = errors_m.fold(0.0, f64::max);
    assert!(farthest_m < 2.0, "{farthest_m}");
}

#[test]
fn a_moved_radio_head_is_bounded_or_told_in_time() {
    let runs = 8;
    for by_m in [[25.0, 0.0], [3.0, 0.0]] {
        let what = FaultKind::MovedHead {
            radio_head: 2,
            by_m,
        };
        let summaries = summaries(&scenario(vec![fault(25.0, 60.0, what)]), runs);
        let affected = (summaries.iter())
            .filter(|run| run.beyond > run.ok / 100)
            .count();
        assert!(
            affected <= most_affected(runs, 1e-2),
            "{by_m:?}: {affected}"
        );
        let total = IntegritySummary::sum(&summaries);
        assert!(
            total.longest_silence_s <= 1.0,
            "{}",
            total.longest_silence_s
        );
    }
}

/// The biases of all radio heads explain the angles of an array with a stuck antenna: the level covers the error, or the
/// state reports it.
#[test]
fn an_antenna_that_sticks_is_covered_or_reported() {
    let stuck = fault(25.0, 60.0, FaultKind::StuckAntenna { antenna: 1 });
    for record in drives(&scenario(vec![stuck]), SEED, 3) {
        let during = record
            .steps
            .iter()
            .filter(|step| (27.0..60.0).contains(&step.time_s));
        let (mut beyond, mut all) = (0, 0);
        for step in during {
            let integrity = step.integrity.unwrap();
            let is_ok = integrity.state == IntegrityState::Ok;
            all += 1;
            beyond += usize::from(is_ok && step.error_m() > integrity.protection_level_m);
        }
        assert!(100 * beyond <= all, "run {}: {beyond} of {all}", record.run);
    }
}

/// Two of four at once: nobody can tell which, and the position is carried away.
#[test]
fn led_astray_it_says_so_and_finds_back() {
    let wall = |radio_head, bias_rad| {
        let what = FaultKind::NonLineOfSight {
            radio_head,
            bias_rad,
        };
        fault(20.0, 30.0, what)
    };
    let scenario = scenario(vec![wall(0, 0.9), wall(1, -0.9)]);
    for record in drives(&scenario, SEED, 6) {
        let worst_m = record.steps.iter().map(Step::error_m).fold(0.0, f64::max);
        let unsaid = (record.steps.iter())
            .filter(|step| step.error_m() > ALERT_LIMIT_M)
            .filter(|step| step.integrity.unwrap().state == IntegrityState::Ok)
            .count();
        // One second of 50 SSBs is allowed for an alarm.
        assert!(
            unsaid <= 50,
            "run {}: {unsaid} SSBs, {worst_m} m",
            record.run
        );
        // 20 s after the last fault: recovery takes 5 s of peace, twice where a restart is needed.
        for step in record.steps.iter().filter(|step| step.time_s > 50.0) {
            let error_m = step.error_m();
            assert!(
                error_m < ALERT_LIMIT_M,
                "run {}: {error_m} m at {} s",
                record.run,
                step.time_s
            );
        }
        let last = record.steps.last().unwrap().integrity.unwrap();
        assert_eq!(last.state, IntegrityState::Ok, "run {}", record.run);
    }
}

/// Without a second radio head odometry and road are the only witnesses: what they can vouch for
/// grows with the distance, once the angles have told that the wheels did not slip as it set off, until
/// it is told that it is too much.
#[test]
fn one_radio_head_is_trusted_as_far_as_odometry_goes() {
    let alone = |faults| Scenario {
        faults,
        ..changed("paper-real-odometry", [("vehicle.integrity", value("{}"))])
    };
    let nominal = drives(&alone(Vec::new()), SEED, 2);
    for record in &nominal {
        let level_m = |time_s: f64| {
            let step = record
                .steps
                .iter()
                .find(|step| step.time_s >= time_s)
                .unwrap();
            step.integrity.unwrap().protection_level_m
        };
        assert!(level_m(25.0) < level_m(45.0) && level_m(45.0) < level_m(70.0));
    }
    let what = FaultKind::MovedHead {
        radio_head: 0,
        by_m: [10.0, 0.0],
    };
    let runs = 8;
    let summaries = summaries(&alone(vec![fault(10.0, 90.0, what)]), runs);
    let affected = (summaries.iter())
        .filter(|run| run.beyond > run.ok / 100)
        .count();
    assert!(affected <= most_affected(runs, 1e-2), "{affected}");
    let total = IntegritySummary::sum(&summaries);
    assert!(
        total.worst_m > 1.0,
        "the fault does something: {} m",
        total.worst_m
    );
    assert!(
        total.longest_silence_s <= 1.0,
        "{}",
        total.longest_silence_s
    );
}
