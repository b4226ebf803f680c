//! Protection levels and alarms on simulated drives, nominal and under faults.
//!
//! The specified integrity risks are 1e-3 and 1e-2 of the epochs in state `ok`. The command `cargo
//! run --release -p simulate --example integrity_table` counts millions of epochs. Here, a few runs
//! are compared with the statistical limits for their number. The epochs of a run are correlated
//! over tens of seconds, so that a run has about eight independent epochs.

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

/// Returns the yard with integrity monitoring, a reception every 100 ms, and one changed key.
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

/// Returns the maximum number of runs with an exceeded protection level for the integrity risk
/// `risk`: the expected number with 8 independent epochs per run, plus four Poisson standard
/// deviations.
fn most_affected(runs: usize, risk: f64) -> usize {
    let expected = 8.0 * runs as f64 * risk;
    (expected + 4.0 * expected.sqrt()).ceil() as usize
}

#[test]
fn nominal_runs_are_ok_and_within_the_protection_level() {
    let runs = 10;
    let summaries = summaries(&scenario(Vec::new()), runs);
    let affected = (summaries.iter())
        .filter(|run| run.beyond > run.ok / 100)
        .count();
    assert!(affected <= most_affected(runs, 1e-3), "{affected}");
    let total = IntegritySummary::sum(&summaries);
    // Some alarms occur at departure, until the angles exclude slip. With estimated biases, this
    // takes some metres, and the protection level may exceed the alert limit more than once.
    assert!(total.alarms <= 3 * runs, "{}", total.alarms);
    let ok = total.ok as f64 / total.epochs as f64;
    assert!(ok > 0.98, "{ok}");
    // The median ratio of a run varies by a third, and of n runs by a third divided by √n.
    let ratio = total.median_ratio();
    let chance = 4.0 * 0.33 / (runs as f64).sqrt();
    assert!(ratio < 6.0 * (1.0 + chance) && ratio > 3.0, "{ratio}");
}

/// Noisier angles do not indicate a faulty radio head; the protection level grows.
#[test]
fn a_lower_rician_k_than_nominal_is_not_a_fault() {
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

/// Reflections multiply the error variance of some radio heads by thirty. The other radio heads
/// remain valid. The position must not jump to another hypothesis that explains a few angles
/// better.
#[test]
fn reflections_do_not_move_the_position_to_another_hypothesis() {
    let scenario = yard_every_100_ms("channel", value("{ model = 'inf-sh' }"));
    let errors_m = drives(&scenario, 1, 1);
    let errors_m = (errors_m.iter().flat_map(|it| &it.steps)).map(Step::error_m);
    let farthest_m = errors_m.fold(0.0, f64::max);
    assert!(farthest_m < 2.0, "{farthest_m}");
}

#[test]
fn a_moved_radio_head_is_bounded_or_reported_in_time() {
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

/// The biases of all radio heads explain the angles of an array with a stuck antenna. The
/// protection level bounds the error, or the state reports it.
#[test]
fn a_stuck_antenna_is_bounded_or_reported() {
    let stuck = fault(25.0, 60.0, FaultKind::StuckAntenna { antennas: [1] });
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

/// Two of four radio heads fail simultaneously. The faulty ones cannot be identified, and the
/// position becomes wrong.
#[test]
fn a_double_fault_is_reported_and_the_pose_recovers() {
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
        // An alarm may take one second (50 SSBs).
        assert!(
            unsaid <= 50,
            "run {}: {unsaid} SSBs, {worst_m} m",
            record.run
        );
        // 20 s after the last fault: recovery takes 5 s without a new detection, and twice as long
        // with a re-initialisation.
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

/// With a single radio head, only odometry and road can reveal a fault. Once the angles exclude
/// slip at departure, the protection level grows with the distance until it exceeds the alert
/// limit; if the bias of the radio head is estimated, its prior limits the level.
#[test]
fn one_radio_head_is_trusted_within_the_accuracy_of_odometry() {
    let alone = |faults| Scenario {
        faults,
        ..changed("paper-real-odometry", [("vehicle.integrity", value("{}"))])
    };
    let nominal = drives(&alone(Vec::new()), SEED, 2);
    let without_bias = changed(
        "paper-real-odometry",
        [
            ("vehicle.integrity", value("{}")),
            ("vehicle.receiver.multipath_bias_probability", value("0.0")),
        ],
    );
    let without_bias = drives(&without_bias, SEED, 2);
    for (record, is_limited) in
        (nominal.iter().map(|it| (it, true))).chain(without_bias.iter().map(|it| (it, false)))
    {
        let level_m = |time_s: f64| {
            let step = record
                .steps
                .iter()
                .find(|step| step.time_s >= time_s)
                .unwrap();
            step.integrity.unwrap().protection_level_m
        };
        assert!(level_m(25.0) < level_m(45.0));
        assert!(is_limited || level_m(45.0) < level_m(70.0));
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
