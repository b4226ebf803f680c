//! Whole simulated drives: what they cost, that they repeat to the bit, and that the user's own code
//! takes part in them.

use crate::common;
use std::f64::consts::PI;

use onboard::estimator::{AngleEstimator, EstimatedAngle};
use onboard::observation::{SensedSsb, SsbObservation};
use onboard::wake_up::{Situation, WakeUpPolicy};
use onboard::{BoxError, Custom, Execution};
use simulate::{Campaign, CampaignOptions, Simulation, SimulationError, Step};
use toml::Value;

use crate::common::{NONE, changed, shipped};

fn simulation(overrides: &[(&str, Value)]) -> Simulation {
    common::simulation(&changed("paper", overrides.iter().cloned()))
}

fn campaign(simulation: &Simulation, runs: usize, threads: usize) -> Campaign {
    let options = CampaignOptions {
        seed: 7,
        runs,
        threads: Some(threads),
        keep_records: true,
        ..CampaignOptions::default()
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
        ("vehicle.wake_up.policy", "fixed".into()),
        ("vehicle.wake_up.interval_ms", interval_ms.into()),
        ("vehicle.estimator.method", method.into()),
    ]
}

#[test]
fn same_bytes_whatever_the_threads() {
    let simulation = simulation(&[
        ("vehicle.lane_keeping.rms_m", 0.1.into()),
        ("vehicle.odometer.scale_std", 0.003.into()),
        ("channel.shadowing_correlation_m", 5.0.into()),
        ("vehicle.receiver.snr_noise_db", 1.0.into()),
    ]);
    let one = campaign(&simulation, 18, 1);
    let two = campaign(&simulation, 18, 2);
    // NaN-free by construction, so equality is equality of bits but for the sign of zero.
    assert_eq!(one, two);
    let other = simulation.run(8, 0, NONE).unwrap();
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
    let every = simulation(&fixed("music", 20.0)).run(3, 0, NONE).unwrap();
    let fourth = simulation(&fixed("music", 80.0)).run(3, 0, NONE).unwrap();
    let mut compared = 0;
    for execution in &fourth.executions {
        let same_ssb = |other: &&Execution| (other.ssb.time_s - execution.ssb.time_s).abs() < 1e-9;
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
    let record = common::run(&shipped("paper-stop-and-go"), 1, 0);
    // It stops at 90 m, 90/(25/6) s and one ramp of 25/3 s after the start, for 8 s.
    let stop_s = 90.0 / (25.0 / 6.0) + 25.0 / 3.0;
    let standing: Vec<_> = record
        .steps
        .iter()
        .filter(|step| (stop_s + 0.1..stop_s + 7.9).contains(&step.time_s))
        .collect();
    assert_eq!(standing.len(), 390);
    let moved = |pair: &[&Step]| pair[0].truth.point().distance_m(pair[1].truth.point());
    assert!(standing.windows(2).all(|pair| moved(pair) < 1e-9));
    let (first, last) = (standing[0].estimate.point(), standing[389].estimate.point());
    assert!(first.distance_m(last) < 0.1, "{first:?} {last:?}");
    assert!((record.steps.last().unwrap().time_s - (241.0 / 3.0 + 50.0 / 3.0 + 13.0)).abs() < 0.02);
}

struct Sideways;

impl AngleEstimator for Sideways {
    fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<EstimatedAngle>, BoxError> {
        if observation.count() != 20 {
            return Err("not twenty".into());
        }
        Ok(Some(EstimatedAngle::Angle {
            phase_rad: PI * 1f64.cos(),
            phase_sigma_rad: None,
            snr_db: None,
            resolved: true,
        }))
    }
}

/// In order at the start of the drive, and never again.
struct Failing;

impl WakeUpPolicy for Failing {
    fn listens(&mut self, _: &Situation<'_>) -> Result<bool, BoxError> {
        Ok(true)
    }

    fn decide(
        &mut self,
        now: &Situation<'_>,
        _: &[SensedSsb],
        _: &mut [bool],
    ) -> Result<f64, BoxError> {
        if now.time_s > 0.0 {
            Err("out of order".into())
        } else {
            Ok(0.1)
        }
    }
}

#[test]
fn own_estimators_and_policies_take_part() {
    let simulation = simulation(&[]);
    let sideways = |_| {
        Ok(Custom {
            estimator: Some(Box::new(Sideways)),
            ..Custom::default()
        })
    };
    let record = simulation.run(1, 0, &sideways).unwrap();
    let mut angles = record
        .executions
        .iter()
        .filter_map(|execution| execution.measured);
    assert!(angles.all(|angle| angle.phase_rad == PI * 1f64.cos()));
    let failing = |_| {
        Ok(Custom {
            policy: Some(Box::new(Failing)),
            ..Custom::default()
        })
    };
    let error = simulation.run(1, 0, &failing).unwrap_err();
    assert!(
        matches!(&error, SimulationError::Custom(inner) if inner.to_string() == "out of order")
    );
}

#[test]
fn the_caller_can_stop() {
    let options = CampaignOptions {
        seed: 1,
        runs: 1000,
        threads: Some(1),
        progress: &|_| false,
        ..CampaignOptions::default()
    };
    let outcome = simulation(&[]).campaign(&options);
    assert!(matches!(outcome, Err(SimulationError::Stopped)));
}
