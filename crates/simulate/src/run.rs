//! One simulated drive.

use rand::RngExt;
use rand_distr::StandardNormal;

use super::SimulationError;
use super::iq_reception::IqReception;
use crate::channel::{HeadChannel, Reception};
use crate::geometry::Pose;
use crate::localize::Integrity;
use crate::localize::tracker::Calibration;
use crate::observation::{SensedSsb, SsbObservation};
use crate::onboard::{Custom, Execution, Onboard};
use crate::platform::Platform;
use crate::random::{Purpose, Streams};
use crate::scenario::{Fidelity, Scenario, ScenarioError};
use crate::world::{Faults, Odometer, RadioHead, Track, Vehicle};

/// A scenario on a platform, ready to be run.
#[derive(Debug, Clone)]
pub struct Simulation {
    scenario: Scenario,
    platform: Platform,
    track: Track,
    steps: usize,
}

/// Truth and estimate at one SSB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Time in seconds.
    pub time_s: f64,
    /// Where the vehicle is.
    pub truth: Pose,
    /// Where it believes to be.
    pub estimate: Pose,
    /// Covariance of (x, y, heading), where the localizer has one.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// Protection level and state, where the localizer is guarded.
    pub integrity: Option<Integrity>,
    /// Whether it is still in search of its first pose.
    pub searching: bool,
    /// SNR of the strongest radio head by link budget and shadowing, in dB.
    pub snr_db: f64,
}

impl Step {
    /// Horizontal error in metres.
    pub fn error_m(&self) -> f64 {
        self.truth.point().distance_m(self.estimate.point())
    }

    /// Sum of the variances of the horizontal error in m²; `None` where the localizer has none.
    pub fn predicted_m2(&self) -> Option<f64> {
        let [[xx, ..], [_, yy, _], _] = self.covariance?;
        Some(xx + yy)
    }

    /// Squared horizontal error normalised by its covariance (NEES); `None` where the localizer
    /// has none, or one without area.
    pub fn nees(&self) -> Option<f64> {
        let [[xx, xy, _], [_, yy, _], _] = self.covariance?;
        let (dx, dy) = (
            self.estimate.x_m - self.truth.x_m,
            self.estimate.y_m - self.truth.y_m,
        );
        let determinant = xx * yy - xy * xy;
        let nees = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
        (determinant > 0.0).then_some(nees)
    }
}

/// All that happened in one run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRecord {
    /// Its number.
    pub run: u64,
    /// One step per SSB.
    pub steps: Vec<Step>,
    /// The estimated angles.
    pub executions: Vec<Execution>,
    /// SSB bursts that the receiver listened to.
    pub listened: usize,
    /// The array as found by the end of the drive, where the localizer looks for it.
    pub calibration: Option<Calibration>,
    /// SSBs at which no choice of angles could keep the bound of an uncertainty-driven wake-up.
    pub out_of_reach: usize,
}

/// How the first pose came about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// The first step at which the pose was known.
    pub step: Step,
    /// Distance driven by then, in metres.
    pub driven_m: f64,
}

impl RunRecord {
    /// How the first pose came about: at once, unless it had to be searched for; `None` if it was
    /// not found.
    pub fn found(&self) -> Option<Found> {
        let first = self.steps.iter().position(|step| !step.searching)?;
        let until = self.steps.get(..=first)?;
        let driven_m = |pair: &[Step]| match pair {
            [from, to] => from.truth.point().distance_m(to.truth.point()),
            _ => 0.0,
        };
        Some(Found {
            step: *until.last()?,
            driven_m: until.windows(2).map(driven_m).sum(),
        })
    }
}

impl Simulation {
    /// Prepares a scenario.
    ///
    /// # Errors
    /// [`ScenarioError`] when the platform lacks what the scenario asks of it.
    pub fn new(scenario: Scenario, platform: Platform) -> Result<Self, ScenarioError> {
        let track = scenario.build_track()?;
        let vehicle = Vehicle::new(track.clone(), &scenario.motion, Streams::new(0, 0));
        // On to the first SSB that finds the vehicle at its destination.
        let steps = (vehicle.duration_s() / scenario.ssb.period_s()).ceil() as usize + 1;
        // Whatever the pipeline refuses, it refuses before the first run.
        Onboard::new(&scenario, &platform, Pose::default(), Custom::default())?;
        Ok(Self {
            scenario,
            platform,
            track,
            steps,
        })
    }

    /// A scenario on the platform it names.
    ///
    /// # Errors
    /// [`ScenarioError`] when there is no such platform, or it lacks what the scenario asks of it.
    pub fn on_its_platform(scenario: Scenario) -> Result<Self, ScenarioError> {
        let platform = Platform::load(&scenario.platform.name)?;
        Self::new(scenario, platform)
    }

    /// The scenario.
    pub const fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The platform.
    pub const fn platform(&self) -> &Platform {
        &self.platform
    }

    /// Steps of a run: one per SSB.
    pub const fn steps(&self) -> usize {
        self.steps
    }

    /// Time of step `number` in seconds.
    pub fn time_s(&self, number: usize) -> f64 {
        number as f64 * self.scenario.ssb.period_s()
    }

    /// Drives once. The same seed and run number give the same record to the last bit.
    ///
    /// # Errors
    /// [`SimulationError`] from the user's own code, if any.
    pub fn run(&self, seed: u64, run: u64, custom: Custom) -> Result<RunRecord, SimulationError> {
        let scenario = &self.scenario;
        let streams = Streams::new(seed, run);
        let vehicle = Vehicle::new(self.track.clone(), &scenario.motion, streams);
        let start = vehicle.at(0.0);
        let mut odometer = Odometer::new(scenario.odometer, start, streams);
        let mut channels: Vec<HeadChannel> = scenario
            .radio_heads
            .iter()
            .enumerate()
            .map(|(index, head)| HeadChannel::new(scenario, RadioHead::from(head), index, streams))
            .collect();
        let believed_start = self.believed_start(start.pose, streams);
        let mut onboard = Onboard::new(scenario, &self.platform, believed_start, custom)?;

        let mut record = RunRecord {
            run,
            steps: Vec::with_capacity(self.steps),
            executions: Vec::with_capacity(self.steps),
            listened: 0,
            calibration: None,
            out_of_reach: 0,
        };
        let mut iq = match scenario.fidelity {
            Fidelity::Snapshots => None,
            Fidelity::Iq => Some(IqReception::new(scenario, streams)?),
        };
        let mut faults = Faults::new(scenario);
        let heads: Vec<RadioHead> = scenario.radio_heads.iter().map(RadioHead::from).collect();
        let mut snrs_db = vec![0.0; channels.len()];
        let mut receptions: Vec<Reception> = Vec::with_capacity(channels.len());
        let mut sensed: Vec<SensedSsb> = Vec::with_capacity(channels.len());
        let mut observation = None;
        let mut odometry_number = 0u32;
        for number in 0..self.steps {
            let time_s = self.time_s(number);
            loop {
                let sample_s = f64::from(odometry_number) * odometer.period_s();
                if sample_s > time_s {
                    break;
                }
                odometry_number += 1;
                if let Some(sample) = odometer.sample(vehicle.at(sample_s)) {
                    // A simulated odometer neither repeats itself nor returns NaN.
                    let _ = onboard.odometry(&faults.slip(sample));
                }
            }
            let truth = vehicle.at(time_s);
            for (channel, snr_db) in channels.iter_mut().zip(&mut snrs_db) {
                *snr_db = channel.next_snr_db(&truth);
            }
            if onboard.listens(time_s) {
                record.listened += 1;
                receptions.clear();
                sensed.clear();
                if let Some(iq) = &mut iq {
                    iq.receive(number as u64, &vehicle, &channels, &snrs_db)?;
                    sensed.extend(iq.observations().iter().map(|it| it.ssb));
                } else {
                    let of_heads = channels.iter_mut().zip(&snrs_db).zip(&heads);
                    for (index, ((channel, snr_db), head)) in of_heads.enumerate() {
                        let mut reception = channel.receive(&truth, *snr_db);
                        faults.distort(index, head, &truth, &mut reception.gains);
                        sensed.push(reception.ssb);
                        receptions.push(reception);
                    }
                }
                let decision = onboard
                    .consider(time_s, &sensed)
                    .map_err(SimulationError::Custom)?;
                if decision.estimate {
                    // One of the two is empty: samples were received, or snapshots are drawn.
                    for heard in iq.iter().flat_map(IqReception::observations) {
                        if onboard.selects(&heard.ssb) {
                            let execution =
                                onboard.estimate(heard).map_err(SimulationError::Custom)?;
                            record.executions.push(execution);
                        }
                    }
                    for (channel, reception) in channels.iter_mut().zip(&receptions) {
                        if !onboard.selects(&reception.ssb) {
                            continue;
                        }
                        let buffer =
                            observation.get_or_insert_with(|| SsbObservation::new(reception.ssb));
                        channel.observe(number as u64, reception, buffer);
                        let execution =
                            onboard.estimate(buffer).map_err(SimulationError::Custom)?;
                        record.executions.push(execution);
                    }
                }
            } else {
                onboard.advance_to(time_s);
            }
            record.out_of_reach += usize::from(onboard.keeps_bound(time_s) == Some(false));
            let believed = onboard.pose();
            record.steps.push(Step {
                time_s,
                truth: truth.pose,
                estimate: believed.pose,
                covariance: believed.covariance,
                integrity: believed.integrity,
                searching: onboard.searching().is_some(),
                snr_db: snrs_db.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            });
        }
        record.calibration = onboard.calibration();
        Ok(record)
    }

    fn believed_start(&self, truth: Pose, streams: Streams) -> Pose {
        let settings = &self.scenario.start;
        let mut rng = streams.generator(Purpose::Start, 0);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        Pose {
            x_m: truth.x_m + settings.position_std_m * normal(),
            y_m: truth.y_m + settings.position_std_m * normal(),
            heading_rad: truth.heading_rad + settings.heading_std_rad * normal(),
        }
    }
}
