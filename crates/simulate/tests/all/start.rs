//! Unknown starts: the vehicle is at an unknown position on its road.

use crate::common;
use onboard::gaussian::principal_variances;
use onboard::localize::IntegrityState;
use onboard::settings::{Check, SettingsError, Shipped, TomlFile};
use rand::Rng as _;
use recording::replay::{LocatedDrive, StartChoice, locate_angles};
use recording::{read_odometry_mcap, write_drive_mcap};
use simulate::RunRecord;
use simulate::random::{Purpose, Streams};
use simulate::scenario::Scenario;
use toml::Value;

use crate::common::{changed, logs, run, shipped, simulation, value};

fn unknown(name: &str) -> Scenario {
    changed(name, [("vehicle.start.known", false.into())])
}

/// Time after which the search has ended, unless it fails (s).
const SEARCHED_S: f64 = 40.0;

/// Simulates the beginning of a run that starts at a random position on the road except its last 60 m.
fn run_from_anywhere(scenario: &Scenario, seed: u64, number: u64) -> RunRecord {
    let mut random = Streams::new(seed, number).generator(Purpose::Start, 1);
    let share = f64::from(random.next_u32()) / f64::from(u32::MAX);
    let road = scenario.path(Check { file: "test" }).unwrap();
    let start_m = share * (road.length_m() - 60.0);
    let there = [("motion.start_at_m", Value::Float(start_m))];
    let there = scenario.with_overrides(there, &Shipped).unwrap();
    let beginning = simulation(&there).until(SEARCHED_S);
    beginning.run(seed, number, common::NONE).unwrap()
}

/// Whether the found position is within 2 m and within four standard deviations of the truth.
fn is_right(record: &RunRecord) -> bool {
    record.found().is_some_and(|found| {
        let (truth, estimate) = (found.step.truth.point(), found.step.estimate.point());
        let [[xx, xy, _], [_, yy, _], _] = found.step.covariance.unwrap();
        let [larger, _] = principal_variances(xx, xy, yy);
        let error_m = truth.distance_m(estimate);
        error_m < 2.0 && error_m < 4.0 * larger.sqrt()
    })
}

#[test]
fn a_vehicle_at_any_position_on_its_road_is_found() {
    let starts = 10;
    let mut right = 0;
    for name in ["paper-real-odometry-2", "yard"] {
        let scenario = unknown(name);
        let records = (0..starts).map(|number| run_from_anywhere(&scenario, 11, number));
        right += records.filter(is_right).count();
    }
    // If the success probability is 99 %, the probability of 17 or fewer successes out of 20 is 0.1 %.
    assert!(right > 17, "{right} of {}", 2 * starts);
}

#[test]
fn during_the_search_all_ssbs_are_received_and_no_pose_is_valid() {
    let road = value("[{ length_m = 60.0, turn_rad = 0.05 }]");
    let scenario = changed(
        "paper-real-odometry-2",
        [
            ("vehicle.start.known", false.into()),
            ("vehicle.integrity", value("{}")),
            ("vehicle.wake_up.policy", "uncertainty".into()),
            ("site.road.segments", road),
        ],
    );
    let record = run(&scenario, 3, 0);
    let found = record.found().unwrap();
    let until = record
        .steps
        .iter()
        .position(|step| !step.searching)
        .unwrap();
    assert!(found.step.time_s > 0.0 && until > 10, "{found:?}");
    // During the search, both radio heads are received at each SSB, for every policy.
    let before_found = |step: &&onboard::AngleResult| step.ssb.time_s < found.step.time_s;
    assert_eq!(
        record.aoa_estimates.iter().filter(before_found).count(),
        2 * until
    );
    for step in &record.steps[..until] {
        let integrity = step.integrity.unwrap();
        assert_eq!(integrity.state, IntegrityState::Unavailable);
        let error_m = step.truth.point().distance_m(step.estimate.point());
        assert!(error_m < integrity.protection_level_m, "{step:?}");
    }
    assert!(record.steps[until..].iter().all(|step| !step.searching));
    // After the search, the policy decides, and does not receive every burst.
    assert!(record.bursts_received < record.steps.len());
}

#[test]
fn settings_that_prevent_a_start_search_are_rejected() {
    let refused = |name: &str, changes: &[(&str, Value)], why: &str| {
        let changes = changes.iter().cloned();
        let unknown = changes.chain([("vehicle.start.known", false.into())]);
        match shipped(name).with_overrides(unknown, &Shipped) {
            Err(SettingsError::Value { key, allowed, .. }) => {
                assert_eq!(key, "vehicle.start.known");
                assert!(allowed.contains(why), "{allowed}");
            }
            other => panic!("{other:?}"),
        }
    };
    refused("paper", &[], "tracker");
    let tracker = [("vehicle.localizer.kind", Value::from("tracker"))];
    refused("paper", &tracker, "two radio heads");
    let no_map = [("vehicle.localizer.map", false.into())];
    refused("paper-real-odometry-2", &no_map, "elsewhere three");
}

/// Returns the errors of the published poses in metres and in standard deviations.
fn errors(drive: &LocatedDrive, record: &RunRecord) -> Vec<(f64, f64)> {
    let both = drive.poses.iter().zip(&record.steps);
    both.filter(|(pose, _)| pose.searching.is_none())
        .map(|(pose, step)| {
            let error_m = pose.estimate.pose.point().distance_m(step.truth.point());
            let [larger, _] = pose.estimate.principal_variances();
            (error_m, error_m / larger.sqrt())
        })
        .collect()
}

#[test]
fn a_recorded_drive_in_either_direction_needs_no_initial_pose() {
    // The paper's road is driven from its end to its beginning. The site does not specify the
    // direction.
    let mut scenario = unknown("paper-real-odometry-2");
    let road = scenario.path(Check { file: "test" }).unwrap();
    let end = Value::try_from(road.reversed().pose(0.0)).unwrap();
    let segments = value("[{ length_m = 300.0, turn_rad = -0.25 }]");
    let against = [("site.road.start", end), ("site.road.segments", segments)];
    let (odometry, angles, record) = logs(&changed("paper-real-odometry-2", against), 5);

    scenario.vehicle.start.either_direction = true;
    let locate = |scenario: &Scenario| {
        let (site, vehicle) = (&scenario.site, &scenario.vehicle);
        locate_angles(site, vehicle, StartChoice::AsSet, &odometry, &angles, false).unwrap()
    };
    assert_eq!(scenario.vehicle.start.pose, None);
    let drive = locate(&scenario);
    let errors = errors(&drive, &record);
    // The vehicle is found within a few metres of 300 m, and the errors are then consistent.
    assert!(
        errors.len() * 10 > drive.poses.len() * 8,
        "{}",
        errors.len()
    );
    let worst = errors
        .iter()
        .fold(0.0, |most: f64, error| most.max(error.1));
    assert!(worst < 4.5, "{worst}");
    let rms_m =
        (errors.iter().map(|error| error.0.powi(2)).sum::<f64>() / errors.len() as f64).sqrt();
    println!(
        "found after {} epochs, RMS {rms_m:.3} m from there",
        drive.poses.len() - errors.len()
    );

    // With the wrong assumption of a one-way road, the vehicle is not found, and the state reports
    // this. With the correct assumption, the pose stays valid to the end.
    assert!(!drive.poses.last().unwrap().is_lost);
    scenario.vehicle.start.either_direction = false;
    let misled = locate(&scenario);
    let lost = misled.poses.iter().filter(|it| it.is_lost).count();
    println!("{lost} poses of {} known to be lost", misled.poses.len());
    assert!(lost * 20 > misled.poses.len());

    // No pose is published before initialisation.
    let dir = common::scratch("start-mcap");
    write_drive_mcap(&dir.join("drive.mcap"), &drive).unwrap();
    let published = read_odometry_mcap(&dir.join("drive.mcap"), None, None).unwrap();
    assert_eq!(published.samples.len(), errors.len());
}
