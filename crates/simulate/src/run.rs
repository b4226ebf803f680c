//! Simulation of one run.

use std::collections::VecDeque;
use std::sync::Arc;

use onboard::geometry::Pose;
use onboard::settings::{Platform, SettingsError};
use onboard::{BoxError, Custom, Pipeline, SsbSource};

use crate::channel::HeadChannel;
use crate::error::SimulationError;
use crate::iq_reception::{IqBurstReception, IqReception};
use crate::random::Streams;
use crate::record::RunRecord;
use crate::scenario::{Fidelity, Scenario};
use crate::snapshot_reception::{SnapshotBuffers, SnapshotReception};
use crate::truth::{PropagationMaker, World};
use crate::world::{Faults, Odometer, Path, VehicleState};

/// Factory of the user's own code for a run that starts at the given pose.
pub type MakeCustom<'a> = dyn Fn(Pose) -> Result<Custom, BoxError> + Sync + 'a;

/// Scenario on a platform, ready to be simulated.
#[derive(Clone)]
pub struct Simulation {
    world: World,
    platform: Platform,
    steps: usize,
}

impl Simulation {
    /// Prepares a scenario.
    ///
    /// # Errors
    /// [`SettingsError`] if the platform lacks a capability that the scenario requires.
    pub fn new(scenario: &Scenario, platform: Platform) -> Result<Self, SettingsError> {
        let world = World::new(scenario)?;
        // The last step is the first SSB after the arrival at the destination.
        let steps = (world.duration_s() / scenario.site.ssb.period_s()).ceil() as usize + 1;
        // Report all errors of the pipeline before the first run.
        let (site, vehicle) = (&scenario.site, &scenario.vehicle);
        Pipeline::new(site, vehicle, &platform, Pose::default(), Custom::default())?;
        Ok(Self {
            world,
            platform,
            steps,
        })
    }

    /// Prepares a scenario on the platform that it names.
    ///
    /// # Errors
    /// [`SettingsError`] if the platform does not exist or lacks a required capability.
    pub fn on_its_platform(scenario: &Scenario) -> Result<Self, SettingsError> {
        let platform = recording::load(&scenario.vehicle.platform.name)?;
        Self::new(scenario, platform)
    }

    /// Replaces the propagation.
    #[must_use]
    pub fn with_propagation(mut self, propagation: Arc<PropagationMaker>) -> Self {
        self.world = self.world.with_propagation(propagation);
        self
    }

    /// Ends the runs at a time in seconds, or at the destination if that is earlier.
    #[must_use]
    pub fn until(mut self, end_s: f64) -> Self {
        let steps = (end_s / self.scenario().site.ssb.period_s()).ceil() as usize;
        self.steps = self.steps.min(steps.saturating_add(1));
        self
    }

    /// Returns the environment.
    pub(crate) const fn world(&self) -> &World {
        &self.world
    }

    /// Returns the scenario.
    pub fn scenario(&self) -> &Scenario {
        self.world.scenario()
    }

    /// Returns the platform.
    pub const fn platform(&self) -> &Platform {
        &self.platform
    }

    /// Returns the number of steps of a run: one per SSB.
    pub const fn steps(&self) -> usize {
        self.steps
    }

    /// Returns the time of step `number` in seconds.
    pub fn time_s(&self, number: usize) -> f64 {
        number as f64 * self.scenario().site.ssb.period_s()
    }

    /// Simulates one run. Equal seed and run number give a bit-identical record.
    ///
    /// # Errors
    /// [`SimulationError`] from the user's own code.
    pub fn run(
        &self,
        seed: u64,
        run: u64,
        custom: &MakeCustom<'_>,
    ) -> Result<RunRecord, SimulationError> {
        self.run_in(RunRecord::default(), seed, run, custom)
    }

    /// Simulates one run in the memory of a record that is not used any more.
    pub(crate) fn run_in(
        &self,
        used: RunRecord,
        seed: u64,
        run: u64,
        custom: &MakeCustom<'_>,
    ) -> Result<RunRecord, SimulationError> {
        let mut drive = Drive::new(self, Streams::new(seed, run), custom)?;
        let mut record = used.restarted(run, self.steps);
        for number in 0..self.steps {
            let time_s = self.time_s(number);
            let truth = drive.path.at(time_s);
            drive.send(number, time_s);
            drive.odometry_until(time_s, &mut record)?;
            drive.process_until(time_s, &mut record)?;
            record.add_step(&drive.onboard, time_s, truth.pose, drive.strongest_db)?;
        }
        record.constants = drive.onboard.constants();
        Ok(record)
    }
}

/// State of a run.
struct Drive {
    onboard: Pipeline,
    path: Path,
    odometer: Odometer,
    channels: Vec<HeadChannel>,
    faults: Faults,
    iq: Option<IqReception>,
    buffers: SnapshotBuffers,
    /// Bursts that have been sent and not yet processed.
    in_transit: VecDeque<Burst>,
    /// Reusable buffers of processed bursts.
    spare: Vec<Vec<f64>>,
    latency_s: f64,
    angle_time_offset_s: f64,
    strongest_db: f64,
}

struct Burst {
    number: u64,
    vehicle: VehicleState,
    snrs_db: Vec<f64>,
}

impl Drive {
    fn new(
        simulation: &Simulation,
        streams: Streams,
        custom: &MakeCustom<'_>,
    ) -> Result<Self, SimulationError> {
        let scenario = simulation.scenario();
        let mut truth = simulation.world.draw(streams);
        let start = truth.given_start;
        let onboard = Pipeline::new(
            &scenario.site,
            &scenario.vehicle,
            &simulation.platform,
            start,
            custom(start).map_err(SimulationError::Custom)?,
        )?;
        let iq = match scenario.fidelity {
            Fidelity::Snapshots => None,
            Fidelity::Iq => Some(IqReception::new(scenario, streams)?),
        };
        Ok(Self {
            onboard,
            channels: HeadChannel::all(&mut truth, streams),
            path: truth.path,
            odometer: truth.odometer,
            faults: Faults::new(&scenario.faults),
            iq,
            buffers: SnapshotBuffers::new(scenario.vehicle.array.elements.into()),
            in_transit: VecDeque::new(),
            spare: Vec::new(),
            latency_s: 1e-3 * scenario.ssb_latency_ms,
            angle_time_offset_s: truth.vehicle.receiver.angle_time_offset_s,
            strongest_db: f64::NEG_INFINITY,
        })
    }

    /// Sends burst number `number` with the time stamp `time_s`.
    fn send(&mut self, number: usize, time_s: f64) {
        let vehicle = self.path.at_reception(time_s, self.angle_time_offset_s);
        let mut snrs_db = self.spare.pop().unwrap_or_default();
        let next_snr_db = |channel: &mut HeadChannel| channel.next_snr_db(&vehicle);
        snrs_db.extend(self.channels.iter_mut().map(next_snr_db));
        self.strongest_db = snrs_db.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        self.in_transit.push_back(Burst {
            number: number as u64,
            vehicle,
            snrs_db,
        });
    }

    /// Processes odometry up to `time_s` and, before each sample, the bursts that have arrived.
    fn odometry_until(
        &mut self,
        time_s: f64,
        record: &mut RunRecord,
    ) -> Result<(), SimulationError> {
        while let Some(sample_s) = self.odometer.next_s(time_s) {
            while let Some(burst) = self.arrived(|arrives_s| arrives_s < sample_s) {
                self.process(burst, record)?;
            }
            if let Some(sample) = self.odometer.sample(self.path.at(sample_s)) {
                // A simulated odometer never repeats a sample and never returns NaN.
                let _ = self
                    .onboard
                    .odometry(&self.faults.slip(sample))
                    .map_err(SimulationError::Custom)?;
            }
        }
        Ok(())
    }

    /// Processes the bursts that have arrived by `time_s`.
    fn process_until(
        &mut self,
        time_s: f64,
        record: &mut RunRecord,
    ) -> Result<(), SimulationError> {
        while let Some(burst) = self.arrived(|arrives_s| arrives_s <= time_s) {
            self.process(burst, record)?;
        }
        Ok(())
    }

    /// Returns the next burst if `by` accepts its arrival time.
    fn arrived(&mut self, by: impl Fn(f64) -> bool) -> Option<Burst> {
        let arrives_s = self.in_transit.front()?.vehicle.time_s + self.latency_s;
        by(arrives_s).then(|| self.in_transit.pop_front()).flatten()
    }

    fn process(&mut self, burst: Burst, record: &mut RunRecord) -> Result<(), SimulationError> {
        let mut by_samples;
        let mut by_snapshots;
        let source: &mut dyn SsbSource = if let Some(reception) = &mut self.iq {
            by_samples = IqBurstReception {
                reception,
                number: burst.number,
                path: &self.path,
                angle_time_offset_s: self.angle_time_offset_s,
                channels: &self.channels,
                snrs_db: &burst.snrs_db,
            };
            &mut by_samples
        } else {
            by_snapshots = SnapshotReception {
                number: burst.number,
                vehicle: &burst.vehicle,
                channels: &mut self.channels,
                snrs_db: &burst.snrs_db,
                faults: &self.faults,
                buffers: &mut self.buffers,
            };
            &mut by_snapshots
        };
        let result = self.onboard.process_burst(burst.vehicle.time_s, source);
        record.add(&result.map_err(SimulationError::of_drive)?);
        record.add_ranges(self.onboard.ranges());
        let mut snrs_db = burst.snrs_db;
        snrs_db.clear();
        self.spare.push(snrs_db);
        Ok(())
    }
}
