//! Complete simulated drives: cost, reproducibility and custom code.

use crate::common;
use std::f64::consts::PI;

use onboard::estimator::{AngleEstimator, EstimatedAngle};
use onboard::observation::{SsbDetection, SsbObservation};
use onboard::wake_up::{Situation, WakeUpPolicy};
use onboard::{AngleResult, BoxError, Custom};
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
fn statistics_do_not_depend_on_kept_records() {
    // More runs than are computed together, so that runs reuse the memory of earlier ones.
    let runs = 20;
    let simulation = simulation(&[("motion.start_at_m", 280.0.into())]);
    let [kept, dropped] = [true, false].map(|keep_records| {
        let options = CampaignOptions {
            seed: 7,
            runs,
            threads: Some(1),
            keep_records,
            errors_every: Some(3),
            ..CampaignOptions::default()
        };
        simulation.campaign(&options).unwrap()
    });
    assert_eq!(kept.records.len(), runs);
    let records = Vec::new();
    assert_eq!(Campaign { records, ..kept }, dropped);
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let simulation = simulation(&[
        ("vehicle.lane_keeping.rms_m", 0.1.into()),
        ("vehicle.odometer.scale_std", 0.003.into()),
        ("channel.shadowing_correlation_m", 5.0.into()),
        ("vehicle.receiver.snr_noise_db", 1.0.into()),
    ]);
    let one = campaign(&simulation, 18, 1);
    let two = campaign(&simulation, 18, 2);
    // The results contain no NaN, so that equality means equal bits apart from the sign of zero.
    assert_eq!(one, two);
    let other = simulation.run(8, 0, NONE).unwrap();
    assert_ne!(one.records[0], other);
}

#[test]
fn additional_runs_do_not_change_earlier_ones() {
    let simulation = simulation(&[]);
    let (few, more) = (campaign(&simulation, 2, 1), campaign(&simulation, 5, 2));
    assert_eq!(few.records[..], more.records[..2]);
}

#[test]
fn all_policies_receive_over_the_same_radio_channel() {
    let every = simulation(&fixed("music", 20.0)).run(3, 0, NONE).unwrap();
    let fourth = simulation(&fixed("music", 80.0)).run(3, 0, NONE).unwrap();
    let mut compared = 0;
    for angle_result in &fourth.aoa_estimates {
        let same_ssb =
            |other: &&AngleResult| (other.ssb.time_s - angle_result.ssb.time_s).abs() < 1e-9;
        let other = every.aoa_estimates.iter().find(same_ssb).unwrap();
        assert_eq!(other.measured, angle_result.measured);
        compared += 1;
    }
    assert_eq!(compared, 1005);
}

#[test]
fn trip_of_the_paper_has_the_errors_of_the_paper() {
    // The mean of |error| over n runs has a relative standard deviation of about 0.75/√n: 0.12
    // here. The limits are three times as large.
    let runs = 40;
    let theoretical = campaign(&simulation(&fixed("music", 20.0)), runs, 2);
    let esprit = campaign(&simulation(&fixed("esprit", 20.0)), runs, 2);
    let adaptive = campaign(&simulation(&[]), runs, 2);
    let (music_m, esprit_m) = (worst_m(&theoretical).1, worst_m(&esprit).1);
    let (x_m, y_m) = worst_m(&adaptive);
    assert!((0.35..0.95).contains(&music_m), "{music_m}");
    assert!(esprit_m > 1.3 * music_m, "{esprit_m} {music_m}");
    assert!(x_m < 0.04 && y_m < 0.25, "{x_m} {y_m}");
    let aoa_estimates: usize = adaptive.runs.iter().map(|run| run.aoa_estimates).sum();
    let mean = aoa_estimates as f64 / runs as f64;
    assert!((400.0..430.0).contains(&mean), "{mean}");
    assert_eq!(theoretical.runs[0].aoa_estimates, 4018);
    let energy_j = adaptive.runs[0].energy.unwrap().total_j();
    assert!((energy_j / adaptive.runs[0].aoa_estimates as f64 - 0.625).abs() < 0.005);
}

#[test]
fn a_standing_vehicle_keeps_its_position() {
    let record = common::run(&shipped("paper-stop-and-go"), 1, 0);
    // The vehicle stops at 90 m, 90/(25/6) s plus one ramp of 25/3 s after the start, for 8 s.
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

/// Policy that works at the start of the drive only.
struct Failing;

impl WakeUpPolicy for Failing {
    fn listens(&mut self, _: &Situation<'_>) -> Result<bool, BoxError> {
        Ok(true)
    }

    fn decide(
        &mut self,
        now: &Situation<'_>,
        _: &[SsbDetection],
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
fn custom_estimators_and_policies_are_used() {
    let simulation = simulation(&[]);
    let sideways = |_| {
        Ok(Custom {
            estimator: Some(Box::new(Sideways)),
            ..Custom::default()
        })
    };
    let record = simulation.run(1, 0, &sideways).unwrap();
    let mut angles = record
        .aoa_estimates
        .iter()
        .filter_map(|angle_result| angle_result.measured);
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
fn the_caller_can_stop_a_campaign() {
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
