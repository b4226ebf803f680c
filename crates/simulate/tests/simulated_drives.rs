//! Whole simulated drives: what they cost, that they repeat to the bit, and that the user's own code
//! takes part in them.
#![allow(clippy::unwrap_used)] // helpers of tests

use access_av::BoxError;
use access_av::estimator::CustomEstimator;
use access_av::observation::Snapshot;
use access_av::onboard::Custom;
use access_av::platform::Platform;
use access_av::scenario::Scenario;
use access_av::simulate::{Campaign, CampaignOptions, Simulation, SimulationError};
use access_av::wake_up::Controller;
use toml::Value;

fn simulation(overrides: &[(&str, Value)]) -> Simulation {
    let paper = Scenario::load("paper").unwrap();
    let scenario = paper.with_overrides(overrides.iter().cloned()).unwrap();
    Simulation::new(scenario, Platform::load("jetson-agx-xavier").unwrap()).unwrap()
}

fn campaign(simulation: &Simulation, runs: usize, threads: usize) -> Campaign {
    let options = CampaignOptions {
        seed: 7,
        first_run: 0,
        runs,
        threads: Some(threads),
        keep_records: true,
        custom: &Custom::default,
        progress: &|_| true,
    };
    simulation.campaign(&options).unwrap()
}

fn worst_m(campaign: &Campaign) -> (f64, f64) {
    campaign
        .steps
        .iter()
        .fold((0.0, 0.0), |worst: (f64, f64), step| {
            (
                worst.0.max(step.mean_abs_error_x_m),
                worst.1.max(step.mean_abs_error_y_m),
            )
        })
}

fn fixed(method: &str, interval_ms: f64) -> Vec<(&'static str, Value)> {
    vec![
        ("wake_up.policy", "fixed".into()),
        ("wake_up.interval_ms", interval_ms.into()),
        ("estimator.method", method.into()),
    ]
}

#[test]
fn same_bytes_whatever_the_threads() {
    let simulation = simulation(&[
        ("motion.lateral_wander.rms_m", 0.1.into()),
        ("odometer.scale_error_std", 0.003.into()),
        ("channel.shadowing_correlation_m", 5.0.into()),
        ("receiver.snr_noise_db", 1.0.into()),
    ]);
    let one = campaign(&simulation, 18, 1);
    let two = campaign(&simulation, 18, 2);
    // NaN-free by construction, so equality is equality of bits but for the sign of zero.
    assert_eq!(one, two);
    let other = simulation.run(8, 0, Custom::default()).unwrap();
    assert_ne!(one.records[0], other);
}

#[test]
fn adding_runs_keeps_the_ones_before() {
    let simulation = simulation(&[]);
    let (few, more) = (campaign(&simulation, 2, 1), campaign(&simulation, 5, 2));
    assert_eq!(few.records[..], more.records[..2]);
}

#[test]
fn policies_meet_the_same_radio_channel() {
    let every = simulation(&fixed("music", 20.0))
        .run(3, 0, Custom::default())
        .unwrap();
    let fourth = simulation(&fixed("music", 80.0))
        .run(3, 0, Custom::default())
        .unwrap();
    let mut compared = 0;
    for execution in &fourth.executions {
        let same_ssb = |other: &&access_av::onboard::Execution| {
            (other.ssb.time_s - execution.ssb.time_s).abs() < 1e-9
        };
        let other = every.executions.iter().find(same_ssb).unwrap();
        assert_eq!(other.measured, execution.measured);
        compared += 1;
    }
    assert_eq!(compared, 1005);
}

#[test]
fn the_papers_trip() {
    // Means of |error| over n runs scatter by about 0.75/√n of themselves: 0.12 here, three times
    // that is allowed below.
    let runs = 40;
    let theoretical = campaign(&simulation(&fixed("music", 20.0)), runs, 2);
    let esprit = campaign(&simulation(&fixed("esprit", 20.0)), runs, 2);
    let adaptive = campaign(&simulation(&[]), runs, 2);
    let (music_m, esprit_m) = (worst_m(&theoretical).1, worst_m(&esprit).1);
    let (x_m, y_m) = worst_m(&adaptive);
    assert!((0.35..0.95).contains(&music_m), "{music_m}");
    assert!(esprit_m > 1.3 * music_m, "{esprit_m} {music_m}");
    assert!(x_m < 0.04 && y_m < 0.25, "{x_m} {y_m}");
    let executions: usize = adaptive.runs.iter().map(|run| run.executions).sum();
    let mean = executions as f64 / runs as f64;
    assert!((400.0..430.0).contains(&mean), "{mean}");
    assert_eq!(theoretical.runs[0].executions, 4018);
    let energy_j = adaptive.runs[0].energy.unwrap().total_j();
    assert!((energy_j / adaptive.runs[0].executions as f64 - 0.625).abs() < 0.005);
}

#[test]
fn a_standing_vehicle_stays_where_it_is() {
    let platform = Platform::load("jetson-agx-xavier").unwrap();
    let scenario = Scenario::load("paper-stop-and-go").unwrap();
    let simulation = Simulation::new(scenario, platform).unwrap();
    let record = simulation.run(1, 0, Custom::default()).unwrap();
    // It stops at 90 m, 90/(25/6) s and one ramp of 25/3 s after the start, for 8 s.
    let stop_s = 90.0 / (25.0 / 6.0) + 25.0 / 3.0;
    let standing: Vec<_> = record
        .steps
        .iter()
        .filter(|step| (stop_s + 0.1..stop_s + 7.9).contains(&step.time_s))
        .collect();
    assert_eq!(standing.len(), 390);
    let moved = |pair: &[&access_av::simulate::Step]| {
        pair[0].truth.point().distance_m(pair[1].truth.point())
    };
    assert!(standing.windows(2).all(|pair| moved(pair) < 1e-9));
    let (first, last) = (standing[0].estimate.point(), standing[389].estimate.point());
    assert!(first.distance_m(last) < 0.1, "{first:?} {last:?}");
    assert!((record.steps.last().unwrap().time_s - (241.0 / 3.0 + 50.0 / 3.0 + 13.0)).abs() < 0.02);
}

struct Sideways;

impl CustomEstimator for Sideways {
    fn angle_rad(&mut self, snapshots: &[Snapshot]) -> Result<f64, BoxError> {
        if snapshots.len() == 20 {
            Ok(1.0)
        } else {
            Err("not twenty".into())
        }
    }
}

#[derive(Debug)]
struct Failing;

impl Controller for Failing {
    fn wake_up_time_s(&mut self, _: f64, _: f64, interval_s: f64) -> Result<f64, BoxError> {
        if interval_s > 0.0 {
            Err("out of order".into())
        } else {
            Ok(0.1)
        }
    }
}

#[test]
fn own_estimators_and_controllers_take_part() {
    let simulation = simulation(&[]);
    let custom = Custom {
        estimator: Some(Box::new(Sideways)),
        ..Custom::default()
    };
    let record = simulation.run(1, 0, custom).unwrap();
    let angles = record
        .executions
        .iter()
        .filter_map(|execution| execution.measured);
    assert!(
        angles
            .map(|angle| angle.angle_rad)
            .all(|angle_rad| angle_rad == 1.0)
    );
    let custom = Custom {
        controller: Some(Box::new(Failing)),
        ..Custom::default()
    };
    let error = simulation.run(1, 0, custom).unwrap_err();
    assert!(
        matches!(&error, SimulationError::Custom(inner) if inner.to_string() == "out of order")
    );
}

#[test]
fn the_caller_can_stop() {
    let options = CampaignOptions {
        seed: 1,
        first_run: 0,
        runs: 1000,
        threads: Some(1),
        keep_records: false,
        custom: &Custom::default,
        progress: &|_| false,
    };
    let outcome = simulation(&[]).campaign(&options);
    assert!(matches!(outcome, Err(SimulationError::Stopped)));
}
