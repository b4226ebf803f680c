//! The pipeline on the vehicle: odometry and SSBs in; poses, verdicts and the next wake-up out.
//!
//! For each SSB burst: [`Onboard::listens`] says whether the receiver need be on at all,
//! [`Onboard::consider`] whether what it sensed is worth estimating, [`Onboard::estimate`] turns an
//! SSB into an angle and the angle into a better pose. Simulation and vehicle call the same three.
//! Nothing is allocated after construction.

use std::sync::Arc;

use crate::BoxError;
use crate::channel::LinkBudget;
use crate::estimator::{AngleEstimator, CustomEstimator};
use crate::geometry::Pose;
use crate::localize::integrity::IntegrityConfig;
use crate::localize::tracker::{Calibration, InitialPose, OdometryVerdict, Tracker, TrackerConfig};
use crate::localize::{
    AngleMeasurement, DeadReckoning, Initialiser, Localizer, OdometryStep, PoseEstimate,
    UpdateReason, UpdateVerdict,
};
use crate::observation::{OdometrySample, SensedSsb, SsbObservation};
use crate::platform::Platform;
use crate::scenario::{
    Check, LocalizerSettings, PidSettings, Scenario, ScenarioError, WakeUpSettings,
};
use crate::wake_up::{
    Adaptive, Controller, FixedInterval, Pid, Policy, UncertaintyDriven, WakeUpDecision,
    WakeUpInputs,
};
use crate::world::RadioHead;

/// The pipeline on the vehicle.
pub struct Onboard {
    heads: Vec<RadioHead>,
    budget: LinkBudget,
    estimator: AngleEstimator,
    localizer: Localizer,
    trigger: Trigger,
    wake_up_time_s: f64,
    odometry: Option<OdometrySample>,
    reached: Reached,
}

/// What decides when to wake up.
#[derive(Debug)]
enum Trigger {
    /// A policy that looks at the clock, the SNR and the speed.
    Policy(Policy),
    /// The tracker's own error.
    Uncertainty(Box<UncertaintyDriven>),
}

/// How far the localizer has been moved.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reached {
    time_s: f64,
    distance_m: f64,
}

/// The user's own code in place of parts of the pipeline.
#[derive(Default)]
pub struct Custom {
    /// In place of the scenario's angle estimator.
    pub estimator: Option<Box<dyn CustomEstimator>>,
    /// In place of Algorithm 1. Where the scenario's policy is another one, the settings of
    /// Algorithm 1 around it are their defaults.
    pub controller: Option<Box<dyn Controller>>,
}

/// One estimated angle and what became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Execution {
    /// The SSB.
    pub ssb: SensedSsb,
    /// Its angle; `None` when its snapshots carry none.
    pub measured: Option<AngleMeasurement>,
    /// What the localizer did with it.
    pub verdict: UpdateVerdict,
    /// The wake-up time that was in force, in seconds.
    pub wake_up_time_s: f64,
}

/// Why an odometry sample was left out; the pipeline goes on from what it had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum OdometryDefect {
    /// Not later than the sample before.
    #[error("its time is not after the last sample's")]
    TimeReversed,
    /// A value that is not a number.
    #[error("a value is not a finite number")]
    NotFinite,
}

impl Onboard {
    /// The scenario's pipeline on `platform`, at 0 s and `start`, or in search of its start where
    /// the scenario says that it is not known.
    ///
    /// # Errors
    /// [`ScenarioError`] when the platform lacks what the scenario asks of it.
    pub fn new(
        scenario: &Scenario,
        platform: &Platform,
        start: Pose,
        custom: Custom,
    ) -> Result<Self, ScenarioError> {
        let check = Check {
            file: &scenario.name,
        };
        let estimator = AngleEstimator::new(scenario, custom.estimator).map_err(|error| {
            let spacing = scenario.array.spacing_wavelengths;
            check.error("array.spacing_wavelengths", spacing, &error.to_string())
        })?;
        let heads: Vec<RadioHead> = scenario.radio_heads.iter().map(RadioHead::from).collect();
        let localizer = match scenario.localizer {
            LocalizerSettings::DeadReckoning(settings) => {
                Localizer::DeadReckoning(DeadReckoning::new(
                    start,
                    settings.heading_between,
                    scenario.array.mounting_angle_rad,
                ))
            }
            LocalizerSettings::Tracker(settings) => {
                let config = TrackerConfig::new(scenario, &settings);
                let integrity = settings.integrity.then(|| IntegrityConfig {
                    alert_limit_m: settings.alert_limit_m,
                    risk: settings.integrity_risk,
                    ..IntegrityConfig::default()
                });
                let settled = &scenario.start;
                if settled.known {
                    let map = settings.map.then(|| scenario.build_track()).transpose()?;
                    let start = InitialPose {
                        pose: start,
                        position_std_m: settled.position_std_m,
                        heading_std_rad: settled.heading_std_rad,
                    };
                    let tracker = Tracker::new(config, map.map(Arc::new), &heads, &start);
                    Localizer::tracking(tracker, &heads, integrity)
                } else {
                    let road = scenario.build_track()?;
                    let either = settled.either_direction;
                    let search = Initialiser::new(config, road, either, &heads);
                    Localizer::searching(search, integrity)
                }
            }
        };
        Ok(Self {
            heads,
            budget: LinkBudget::new(scenario),
            estimator,
            localizer,
            trigger: trigger(scenario, platform, custom.controller)?,
            wake_up_time_s: 0.0,
            odometry: None,
            reached: Reached {
                time_s: 0.0,
                distance_m: 0.0,
            },
        })
    }

    /// Takes in an odometry sample, and says what the localizer made of it. The first one is where
    /// distances are counted from.
    ///
    /// # Errors
    /// [`OdometryDefect`] when the sample is unusable; the state is kept.
    pub fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, OdometryDefect> {
        let yaw_rate_radps = sample.yaw_rate_radps.unwrap_or(0.0);
        let values = [
            sample.time_s,
            sample.distance_m,
            sample.speed_mps,
            yaw_rate_radps,
        ];
        if values.iter().any(|value| !value.is_finite()) {
            return Err(OdometryDefect::NotFinite);
        }
        match self.odometry {
            None => self.reached.distance_m = sample.distance_m,
            Some(last) if sample.time_s <= last.time_s => return Err(OdometryDefect::TimeReversed),
            Some(_) => {}
        }
        self.odometry = Some(*sample);
        let verdict = self.localizer.odometry(sample);
        self.advance_to(sample.time_s);
        Ok(verdict)
    }

    /// Moves the pose on to `time_s`, beyond the last odometry sample at that sample's speed.
    pub fn advance_to(&mut self, time_s: f64) {
        let (Some(sample), true) = (self.odometry, time_s > self.reached.time_s) else {
            return;
        };
        let duration_s = time_s - self.reached.time_s;
        let distance_m = sample.distance_m + sample.speed_mps * (time_s - sample.time_s);
        self.localizer.predict(&OdometryStep {
            time_s,
            duration_s,
            distance_m: distance_m - self.reached.distance_m,
            turn_rad: sample
                .yaw_rate_radps
                .map(|rate_radps| rate_radps * duration_s),
        });
        self.reached = Reached { time_s, distance_m };
    }

    /// Number of places the vehicle may be at while it searches for its first pose; `None` once
    /// that is known. Until then [`pose`](Self::pose) is the mean of these places.
    pub fn searching(&self) -> Option<usize> {
        self.localizer.hypotheses()
    }

    /// Whether the receiver need listen to the SSB burst at `time_s`: always, while it searches
    /// for its first pose.
    pub fn listens(&self, time_s: f64) -> bool {
        if self.searching().is_some() {
            return true;
        }
        match (&self.trigger, self.localizer.tracker()) {
            (Trigger::Policy(policy), _) => policy.listens(time_s),
            (Trigger::Uncertainty(policy), Some(tracker)) => {
                policy.is_due(tracker, time_s, &self.heads)
            }
            // Scenarios with this pair are refused.
            (Trigger::Uncertainty(_), None) => true,
        }
    }

    /// Whether the error keeps the bound of an uncertainty-driven wake-up until the next SSB; `None`
    /// for the other policies. `false` after an SSB whose angles were free to be taken says that the
    /// bound is out of reach there, or not worth its price.
    pub fn keeps_bound(&self, time_s: f64) -> Option<bool> {
        match (&self.trigger, self.localizer.tracker()) {
            (Trigger::Uncertainty(policy), Some(tracker)) => Some(policy.keeps(tracker, time_s)),
            _ => None,
        }
    }

    /// Whether the angle of this SSB, of a burst worth estimating, is itself worth it.
    pub fn selects(&self, ssb: &SensedSsb) -> bool {
        if self.searching().is_some() {
            return true;
        }
        match &self.trigger {
            Trigger::Policy(_) => true,
            Trigger::Uncertainty(policy) => self
                .heads
                .iter()
                .position(|head| head.sends(ssb.pci, ssb.ssb_index))
                .is_some_and(|index| policy.chooses(index)),
        }
    }

    /// Whether the burst of SSBs sensed at `time_s` is worth estimating; the policy judges by the
    /// strongest of them that is on the map.
    ///
    /// # Errors
    /// Whatever the user's own controller fails with.
    pub fn consider(
        &mut self,
        time_s: f64,
        sensed: &[SensedSsb],
    ) -> Result<WakeUpDecision, BoxError> {
        self.advance_to(time_s);
        if self.searching().is_some() {
            return Ok(WakeUpDecision {
                estimate: true,
                wake_up_time_s: self.wake_up_time_s,
            });
        }
        let strongest = sensed
            .iter()
            .filter_map(|ssb| Some((ssb, self.head(ssb)?)))
            .max_by(|a, b| a.0.snr_db.total_cmp(&b.0.snr_db));
        let Some((ssb, head)) = strongest else {
            return Ok(WakeUpDecision {
                estimate: false,
                wake_up_time_s: self.wake_up_time_s,
            });
        };
        let distance_m = self.pose().pose.point().distance_m(head.position);
        let inputs = WakeUpInputs {
            time_s,
            sensed_snr_db: ssb.snr_db,
            expected_snr_db: self.budget.snr_db(&head, distance_m),
            speed_mps: self.odometry.map_or(0.0, |sample| sample.speed_mps),
        };
        let decision = match (&mut self.trigger, self.localizer.tracker()) {
            (Trigger::Policy(policy), _) => policy.decide(&inputs)?,
            (Trigger::Uncertainty(policy), Some(tracker)) => {
                policy.decide(tracker, time_s, &self.heads)
            }
            (Trigger::Uncertainty(_), None) => WakeUpDecision {
                estimate: true,
                wake_up_time_s: self.wake_up_time_s,
            },
        };
        self.wake_up_time_s = decision.wake_up_time_s;
        Ok(decision)
    }

    /// Estimates the angle of an SSB and lets the localizer have it.
    ///
    /// # Errors
    /// Whatever the user's own estimator fails with.
    pub fn estimate(&mut self, observation: &SsbObservation) -> Result<Execution, BoxError> {
        let measured = self.estimator.estimate(observation)?;
        Ok(self.take_in(observation.ssb, measured))
    }

    /// Lets the localizer have an angle that was estimated elsewhere; `None` is an SSB that had none.
    pub fn take_in(&mut self, ssb: SensedSsb, measured: Option<AngleMeasurement>) -> Execution {
        self.advance_to(ssb.time_s);
        let verdict = match (self.head(&ssb), &measured) {
            (None, _) => UpdateVerdict::unused(UpdateReason::UnknownRadioHead),
            (_, None) => UpdateVerdict::unused(UpdateReason::Unusable),
            (Some(head), Some(measured)) => self.localizer.update(&head, measured),
        };
        Execution {
            ssb,
            measured,
            verdict,
            wake_up_time_s: self.wake_up_time_s,
        }
    }

    /// How far the array has come from its survey, where the localizer looks for it.
    pub fn calibration(&self) -> Option<Calibration> {
        self.localizer.tracker().map(Tracker::calibration)
    }

    /// Keeps from now on what smoothing takes; in vain as long as the first pose is searched for,
    /// and with a guard, whose trackers take each other's place.
    pub fn keep_journal(&mut self) {
        self.localizer.keep_journal();
    }

    /// Where the vehicle was at each odometry sample since the journal was begun, by everything
    /// that is known now; nowhere without journal, or without tracker.
    pub fn smoothed(&self) -> Vec<PoseEstimate> {
        self.localizer
            .tracker()
            .map(Tracker::smoothed)
            .unwrap_or_default()
    }

    /// Where the vehicle is believed to be.
    pub fn pose(&self) -> PoseEstimate {
        self.localizer.pose(self.reached.time_s)
    }

    fn head(&self, ssb: &SensedSsb) -> Option<RadioHead> {
        let mut heads = self.heads.iter();
        heads
            .find(|head| head.sends(ssb.pci, ssb.ssb_index))
            .copied()
    }
}

fn trigger(
    scenario: &Scenario,
    platform: &Platform,
    controller: Option<Box<dyn Controller>>,
) -> Result<Trigger, ScenarioError> {
    let top_speed_mps = scenario.motion.top_speed_mps();
    let interval_s = |explicit_ms: Option<f64>| match explicit_ms {
        Some(explicit_ms) => Ok(explicit_ms * 1e-3),
        None => platform.base_wake_up_s(scenario),
    };
    if let Some(controller) = controller {
        let settings = if let WakeUpSettings::Pid(settings) = scenario.wake_up {
            settings
        } else {
            PidSettings::default()
        };
        let adaptive = Adaptive::new(&settings, controller, top_speed_mps);
        return Ok(Trigger::Policy(Policy::Adaptive(adaptive)));
    }
    match scenario.wake_up {
        WakeUpSettings::Fixed(settings) => {
            let interval_s = interval_s(settings.interval_ms)?;
            Ok(Trigger::Policy(Policy::Fixed(FixedInterval::new(
                interval_s,
            ))))
        }
        WakeUpSettings::Pid(settings) => {
            let base_s = interval_s(settings.base_ms)?;
            let allowed = format!(
                "it must not be below the base wake-up time, {} ms",
                base_s * 1e3
            );
            Check {
                file: &scenario.name,
            }
            .that(
                settings.t_max_ms * 1e-3 >= base_s,
                "wake_up.t_max_ms",
                settings.t_max_ms,
                &allowed,
            )?;
            let controller = Box::new(Pid::new(&settings, base_s));
            let adaptive = Adaptive::new(&settings, controller, top_speed_mps);
            Ok(Trigger::Policy(Policy::Adaptive(adaptive)))
        }
        WakeUpSettings::Uncertainty(settings) => Ok(Trigger::Uncertainty(Box::new(
            UncertaintyDriven::new(&settings, scenario),
        ))),
    }
}
