//! Custom localizers, policies, estimators and channels, and arrays of other sizes.

use crate::common;
use crate::statistics::CampaignStatistics;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use num_complex::Complex64;
use onboard::estimator::{AngleEstimator, EstimatedAngle, built_in};
use onboard::geometry::{Pose, wrap_angle};
use onboard::localize::OdometryResult;
use onboard::localize::{
    AngleMeasurement, Localizer, PoseEstimate, UpdateReason, UpdateResult, copy_into,
};
use onboard::observation::{OdometrySample, SsbDetection, SsbObservation};
use onboard::radio_head::RadioHead;
use onboard::thermal::ThermalNoise;
use onboard::wake_up::{Situation, WakeUpPolicy};
use onboard::{BoxError, Custom};
use simulate::channel::Propagation;
use simulate::scenario::Scenario;
use simulate::world::{Antennas, LineOfSight};
use simulate::{MakeCustom, RunRecord, SimulationError, Step};
use toml::Value;

use crate::common::{NONE, changed, run, shipped, simulation, unguarded, value};

fn run_with(scenario: &Scenario, custom: &MakeCustom) -> Result<RunRecord, SimulationError> {
    simulation(scenario).run(2, 0, custom)
}

/// Localizer that drives straight ahead by the odometer and counts angles.
#[derive(Clone)]
struct StraightOn {
    start: Pose,
    driven_m: f64,
    now_s: f64,
    angles: usize,
    /// Number of angles after which it fails.
    patience: usize,
}

impl Localizer for StraightOn {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryResult, BoxError> {
        assert!(sample.time_s > self.now_s, "odometry comes in order");
        self.driven_m = sample.distance_m;
        self.now_s = sample.time_s;
        Ok(OdometryResult::Accepted)
    }

    fn update(
        &mut self,
        _: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        assert!(measured.time_s >= self.now_s, "late ones are put in order");
        self.angles += 1;
        if self.angles > self.patience {
            return Err(format!("the {}th angle was too many", self.angles).into());
        }
        Ok(UpdateResult::unused(UpdateReason::Excluded))
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        assert!(time_s >= self.now_s, "past poses are not requested");
        Ok(PoseEstimate {
            time_s,
            pose: self.start.along_arc(self.driven_m, 0.0),
            covariance: None,
            integrity: None,
        })
    }

    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        copy_into(self, slot)
    }
}

fn straight_on(patience: usize) -> impl Fn(Pose) -> Result<Custom, BoxError> {
    move |start| {
        Ok(Custom {
            localizer: Some(Box::new(StraightOn {
                start,
                driven_m: 0.0,
                now_s: f64::NEG_INFINITY,
                angles: 0,
                patience,
            })),
            ..Custom::default()
        })
    }
}

#[test]
fn a_custom_localizer_drives_and_may_fail() {
    for latency_ms in [0.0, 100.0] {
        // Algorithm 1 needs the position.
        let late = [
            ("ssb_latency_ms", Value::from(latency_ms)),
            ("vehicle.wake_up.policy", "pid".into()),
            ("vehicle.wake_up.base_ms", 20.0.into()),
        ];
        let scenario = changed("paper-real-odometry-2", late);
        let record = run_with(&scenario, &straight_on(usize::MAX)).unwrap();
        let reason = |it: &onboard::AngleResult| it.verdict.reason;
        assert!(
            record
                .aoa_estimates
                .iter()
                .all(|it| reason(it) == UpdateReason::Excluded)
        );
        let last = record.steps.last().unwrap();
        // The road's 300 m, measured with a scale error of a few thousandths.
        let straight_m = last
            .estimate
            .point()
            .distance_m(record.steps[0].truth.point());
        assert!((straight_m - 300.0).abs() < 5.0, "{straight_m}");
        assert_eq!((last.covariance, record.constants), (None, None));

        let error = run_with(&scenario, &straight_on(100)).unwrap_err();
        assert!(
            matches!(&error, SimulationError::Custom(it) if it.to_string().contains("101th")),
            "{error}"
        );
    }
}

/// Policy that estimates the angle of the strongest radio head at fixed intervals.
struct Strongest {
    every_s: f64,
    next_s: f64,
}

impl WakeUpPolicy for Strongest {
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError> {
        Ok(now.time_s + 1e-9 >= self.next_s)
    }

    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SsbDetection],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        // The expected SNR differs from the measured one by shadowing and scatter.
        for ssb in sensed {
            let promised_db = now.expected_snr_db(now.head(ssb).ok_or("a stranger")?)?;
            if (promised_db - ssb.snr_db).abs() > 60.0 {
                return Err("no radio head fades by 60 dB".into());
            }
        }
        let strongest = sensed.iter().enumerate();
        let strongest = strongest.max_by(|a, b| a.1.snr_db.total_cmp(&b.1.snr_db));
        let (index, _) = strongest.ok_or("nothing to choose from")?;
        chosen[index] = true;
        self.next_s = now.time_s + self.every_s;
        Ok(self.every_s)
    }
}

#[test]
fn a_custom_policy_selects_radio_heads() {
    let strongest = |_| {
        Ok(Custom {
            policy: Some(Box::new(Strongest {
                every_s: 0.1,
                next_s: 0.0,
            })),
            ..Custom::default()
        })
    };
    let scenario = unguarded("paper-real-odometry-2");
    let record = run_with(&scenario, &strongest).unwrap();
    assert_eq!(record.aoa_estimates.len(), record.steps.len().div_ceil(5));
    assert_eq!(record.bursts_received, record.aoa_estimates.len());
    let intervals = record.aoa_estimates.iter().map(|it| it.wake_up_time_s);
    assert!(intervals.into_iter().all(|interval_s| interval_s == 0.1));
    for pci in [1, 2] {
        assert!(record.aoa_estimates.iter().any(|it| it.ssb.pci == pci));
    }
    assert!(record.steps.last().unwrap().error_m() < 1.0);
}

/// Custom estimator that modifies the angle of a built-in one.
struct ModifiedEstimator<F>(Box<dyn AngleEstimator>, F);

impl<F> AngleEstimator for ModifiedEstimator<F>
where
    F: FnMut(f64, f64) -> Result<Option<EstimatedAngle>, BoxError> + Send,
{
    fn estimate(
        &mut self,
        observation: &SsbObservation,
    ) -> Result<Option<EstimatedAngle>, BoxError> {
        match self.0.estimate(observation)? {
            Some(EstimatedAngle::Angle {
                phase_rad,
                phase_sigma_rad: Some(sigma_rad),
                ..
            }) => (self.1)(phase_rad, sigma_rad),
            other => Ok(other),
        }
    }
}

fn run_modified<F>(scenario: &Scenario, modify: F) -> Result<RunRecord, SimulationError>
where
    F: Fn(f64, f64) -> Result<Option<EstimatedAngle>, BoxError> + Clone + Send + Sync + 'static,
{
    let vehicle = scenario.vehicle.clone();
    let custom = move |_| {
        Ok(Custom {
            estimator: Some(Box::new(ModifiedEstimator(
                built_in(&vehicle)?,
                modify.clone(),
            ))),
            ..Custom::default()
        })
    };
    run_with(scenario, &custom)
}

#[test]
fn an_estimator_without_a_standard_deviation_gets_the_bound_at_its_snr() {
    let scenario = unguarded("paper-real-odometry-2");
    let bare = |phase_rad, _| {
        Ok(Some(EstimatedAngle::Angle {
            phase_rad,
            phase_sigma_rad: None,
            snr_db: None,
            resolved: true,
        }))
    };
    let record = run_modified(&scenario, bare).unwrap();
    let bound = ThermalNoise::new(&scenario.site, &scenario.vehicle);
    for angle_result in &record.aoa_estimates {
        let measured = angle_result.measured.unwrap();
        // Bound for 254 known resource elements at four antennas: 1/√(2 · SNR · 254 · 5).
        let snr = 10f64.powf(0.1 * angle_result.ssb.snr_db);
        let by_hand_rad = (2.0 * snr * 254.0 * 5.0).sqrt().recip();
        assert!((measured.phase_sigma_rad / by_hand_rad - 1.0).abs() < 1e-9);
        assert_eq!(
            measured.phase_sigma_rad,
            bound.sigma_rad(angle_result.ssb.snr_db)
        );
        assert_eq!(measured.snr_db, angle_result.ssb.snr_db);
        assert!((measured.angle_rad.cos() * PI - measured.phase_rad).abs() < 1e-9);
    }
    assert!(record.steps.last().unwrap().error_m() < 1.0);
}

#[test]
fn a_likelihood_gives_the_same_position_as_its_angle() {
    let scenario = unguarded("paper-real-odometry-2");
    let built_in = run_with(&scenario, NONE).unwrap();
    // Likelihood on a grid of 1/1000 cycle.
    let likelihood = |phase_rad: f64, sigma_rad: f64| {
        let log = (0..1000).map(|index| {
            let angle_rad = TAU * f64::from(index) / 1000.0 - PI;
            let off = wrap_angle(angle_rad - phase_rad) / sigma_rad.max(0.01);
            -0.5 * off * off
        });
        Ok(Some(EstimatedAngle::LogLikelihood(log.collect())))
    };
    let record = run_modified(&scenario, likelihood).unwrap();
    for (found, expected) in record.aoa_estimates.iter().zip(&built_in.aoa_estimates) {
        let (found, expected) = (found.measured.unwrap(), expected.measured.unwrap());
        assert!(wrap_angle(found.phase_rad - expected.phase_rad).abs() < 1e-6);
        let sigma_rad = expected.phase_sigma_rad.max(0.01);
        assert!(
            (found.phase_sigma_rad / sigma_rad - 1.0).abs() < 1e-3,
            "{found:?}"
        );
    }
    let apart_m = record
        .steps
        .iter()
        .zip(&built_in.steps)
        .map(|(found, expected)| found.estimate.point().distance_m(expected.estimate.point()));
    assert!(apart_m.fold(0.0, f64::max) < 0.1);
}

#[test]
fn an_estimator_may_return_nothing_or_fail() {
    let scenario = unguarded("paper-real-odometry-2");
    let record = run_modified(&scenario, |_, _| Ok(None)).unwrap();
    for angle_result in &record.aoa_estimates {
        assert_eq!(angle_result.measured, None);
        assert_eq!(angle_result.verdict.reason, UpdateReason::Unusable);
    }
    for nonsense in [EstimatedAngle::LogLikelihood(Vec::new()), not_finite()] {
        let record = run_modified(&scenario, move |_, _| Ok(Some(nonsense.clone()))).unwrap();
        let reasons = record.aoa_estimates.iter().map(|it| it.verdict.reason);
        assert!(
            reasons
                .into_iter()
                .all(|reason| reason == UpdateReason::Unusable)
        );
    }
    let error = run_modified(&scenario, |_, _| Err("no eigenvectors".into())).unwrap_err();
    assert!(
        matches!(&error, SimulationError::Custom(it) if it.to_string() == "no eigenvectors"),
        "{error}"
    );
}

fn not_finite() -> EstimatedAngle {
    EstimatedAngle::Angle {
        phase_rad: f64::NAN,
        phase_sigma_rad: Some(f64::NAN),
        snr_db: Some(f64::NAN),
        resolved: true,
    }
}

#[test]
fn an_error_of_the_factory_ends_the_run() {
    let error = run_with(&shipped("paper"), &|_| Err("no such module".into())).unwrap_err();
    assert_eq!(error.to_string(), "no such module");
}

/// Line of sight without scatter, with a loss relative to free space.
struct Clear {
    loss_db: f64,
}

impl Propagation for Clear {
    fn next_gain_db(&mut self, _: &LineOfSight) -> f64 {
        -self.loss_db
    }

    fn response(&self, sight: &LineOfSight, antennas: &Antennas, _: f64, into: &mut [Complex64]) {
        into.fill(Complex64::ZERO);
        for gains in into.chunks_exact_mut(antennas.elements()) {
            antennas.add(Complex64::ONE, sight.towards, gains);
        }
    }
}

#[test]
fn a_custom_propagation_works_with_snapshots_and_samples() {
    for fidelity in ["snapshots", "iq"] {
        let short = value("[{ length_m = 40.0, turn_rad = 0.05 }]");
        let scenario = changed(
            "paper-real-odometry-2",
            [
                ("fidelity", fidelity.into()),
                ("site.road.segments", short),
                ("site.radio_heads[1].ssb_index", 2.into()),
            ],
        );
        let clear = simulation(&scenario).with_propagation(Arc::new(|link| {
            let loss_db = 6.0 * link.head as f64;
            Box::new(Clear { loss_db })
        }));
        let record = clear.run(2, 0, NONE).unwrap();
        let world = simulate::truth::World::new(&scenario).unwrap();
        let budget = onboard::link_budget::LinkBudget::new(&scenario.site, &scenario.vehicle);
        let truth = world.draw(simulate::random::Streams::new(2, 0));
        let (mut squares, mut apart_db) = (Vec::new(), Vec::new());
        for angle_result in &record.aoa_estimates {
            let (ssb, measured) = (angle_result.ssb, angle_result.measured.unwrap());
            let heads = truth.heads.iter().enumerate();
            let (index, head) = heads.into_iter().find(|it| it.1.pci == ssb.pci).unwrap();
            let there = truth.path.at(ssb.time_s);
            let sight = truth.array.line_of_sight(&there, head);
            let snr_db = budget.snr_db(head, sight.distance_m) - 6.0 * index as f64;
            apart_db.push(ssb.snr_db - snr_db);
            let error_rad = wrap_angle(measured.phase_rad - PI * sight.towards[0]);
            squares.push((error_rad / measured.phase_sigma_rad).powi(2));
        }
        // Noise only: four standard deviations of a sample variance, plus the loss of the
        // converter.
        let count = squares.len() as f64;
        let mean_db = apart_db.iter().sum::<f64>() / count;
        let worst_db = apart_db
            .iter()
            .fold(0.0, |worst: f64, it| worst.max(it.abs()));
        // The SNR estimate of a single SSB from samples has an error of about 1 dB.
        assert!(mean_db.abs() < 0.2, "{fidelity}: {mean_db}");
        assert!(worst_db < 1.5, "{fidelity}: {worst_db}");
        let mean = squares.iter().sum::<f64>() / count;
        println!("{fidelity}: {count} angles, normalised error variance {mean:.3}");
        assert!(count > 1.9 * (record.steps.len() as f64));
        assert!(
            (mean - 1.0).abs() < 0.05 + 4.0 * (2.0 / count).sqrt(),
            "{fidelity}: {mean}"
        );
    }
}

#[test]
fn arrays_of_any_size_are_consistent() {
    let runs = 24;
    let mut by_size = Vec::new();
    // Fewest, odd and many antennas.
    for elements in [2, 3, 8] {
        let array = ("vehicle.array.elements", Value::from(elements));
        // A run counts as one independent sample, so that the second half of the road suffices.
        let half = ("motion.start_at_m", Value::from(150.0));
        let scenario = changed("paper-real-odometry-2", [array.clone(), half]);
        let found = common::campaign(&scenario, 8, runs).consistency(50);
        println!("{elements} antennas: {found:?}");
        // As in the tests of the tracker, a run counts as one independent sample.
        let bound = 4.0 / (runs as f64).sqrt();
        assert!(
            (found.mean_nees / 2.0 - 1.0).abs() < bound,
            "{elements}: {found:?}"
        );
        by_size.push(found.rms_m);

        let short = value("[{ length_m = 60.0, turn_rad = 0.05 }]");
        let road = ("site.road.segments", short);
        let iq = [
            ("fidelity", Value::from("iq")),
            ("site.radio_heads[1].ssb_index", 2.into()),
            array,
            road,
        ];
        let record = run(&changed("paper-real-odometry-2", iq), 8, 0);
        assert!(record.aoa_estimates.len() * 100 > 2 * record.steps.len() * 98);
        let accepted = record.aoa_estimates.iter().filter(|it| it.verdict.accepted);
        assert!(accepted.count() * 100 > record.aoa_estimates.len() * 97);
        let worst_m = record.steps.iter().map(Step::error_m).fold(0.0, f64::max);
        assert!(worst_m < 1.0, "{elements}: {worst_m} m with samples");
    }
    // The error decreases with the number of antennas.
    assert!(
        by_size.is_sorted_by(|fewer, more| fewer > more),
        "{by_size:?}"
    );
}
