//! One simulated drive.

use std::collections::VecDeque;
use std::sync::Arc;

use onboard::geometry::Pose;
use onboard::settings::{Platform, SettingsError};
use onboard::{BoxError, Custom, Onboard, SsbSource};

use crate::channel::HeadChannel;
use crate::error::SimulationError;
use crate::iq_reception::{IqBurstReception, IqReception};
use crate::random::Streams;
use crate::record::RunRecord;
use crate::scenario::{Fidelity, Scenario};
use crate::snapshot_reception::{SnapshotBuffers, SnapshotReception};
use crate::truth::{PropagationMaker, World};
use crate::world::{Faults, Odometer, Path, VehicleState};

/// The user's own code for a run that starts at the pose the vehicle is told.
pub type MakeCustom<'a> = dyn Fn(Pose) -> Result<Custom, BoxError> + Sync + 'a;

/// A scenario on a platform, ready to be run.
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
    /// [`SettingsError`] when the platform lacks what the scenario asks of it.
    pub fn new(scenario: &Scenario, platform: Platform) -> Result<Self, SettingsError> {
        let world = World::new(scenario)?;
        // On to the first SSB that finds the vehicle at its destination.
        let steps = (world.duration_s() / scenario.site.ssb.period_s()).ceil() as usize + 1;
        // Whatever the pipeline refuses, it refuses before the first run.
        let (site, vehicle) = (&scenario.site, &scenario.vehicle);
        Onboard::new(site, vehicle, &platform, Pose::default(), Custom::default())?;
        Ok(Self {
            world,
            platform,
            steps,
        })
    }

    /// A scenario on the platform it names.
    ///
    /// # Errors
    /// [`SettingsError`] when there is no such platform, or it lacks what the scenario asks of it.
    pub fn on_its_platform(scenario: &Scenario) -> Result<Self, SettingsError> {
        let platform = recording::load(&scenario.vehicle.platform.name)?;
        Self::new(scenario, platform)
    }

    /// The same with another propagation.
    #[must_use]
    pub fn with_propagation(mut self, propagation: Arc<PropagationMaker>) -> Self {
        self.world = self.world.with_propagation(propagation);
        self
    }

    /// The world.
    pub(crate) const fn world(&self) -> &World {
        &self.world
    }

    /// The scenario.
    pub fn scenario(&self) -> &Scenario {
        self.world.scenario()
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
        number as f64 * self.scenario().site.ssb.period_s()
    }

    /// Drives once. The same seed and run number give the same record to the last bit.
    ///
    /// # Errors
    /// [`SimulationError`] from the user's own code, if any.
    pub fn run(
        &self,
        seed: u64,
        run: u64,
        custom: &MakeCustom<'_>,
    ) -> Result<RunRecord, SimulationError> {
        let mut drive = Drive::new(self, Streams::new(seed, run), custom)?;
        let mut record = RunRecord::new(run, self.steps);
        for number in 0..self.steps {
            let time_s = self.time_s(number);
            let truth = drive.path.at(time_s);
            drive.send(number, time_s);
            drive.odometry_until(time_s, &mut record)?;
            drive.hear_until(time_s, &mut record)?;
            record.add_step(&drive.onboard, time_s, truth.pose, drive.strongest_db)?;
        }
        record.constants = drive.onboard.constants();
        Ok(record)
    }
}

/// A drive going on.
struct Drive {
    onboard: Onboard,
    path: Path,
    odometer: Odometer,
    channels: Vec<HeadChannel>,
    faults: Faults,
    iq: Option<IqReception>,
    buffers: SnapshotBuffers,
    /// Bursts that have been sent and not yet heard.
    on_the_way: VecDeque<Burst>,
    /// Buffers of bursts that have been heard.
    spare: Vec<Vec<f64>>,
    latency_s: f64,
    lateness_s: f64,
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
        let start = truth.told_start;
        let onboard = Onboard::new(
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
            on_the_way: VecDeque::new(),
            spare: Vec::new(),
            latency_s: 1e-3 * scenario.ssb_latency_ms,
            lateness_s: truth.vehicle.receiver.lateness_s,
            strongest_db: f64::NEG_INFINITY,
        })
    }

    /// Sends burst number `number`, which gets the time stamp `time_s`.
    fn send(&mut self, number: usize, time_s: f64) {
        let vehicle = self.path.heard_at(time_s, self.lateness_s);
        let mut snrs_db = self.spare.pop().unwrap_or_default();
        let next_snr_db = |channel: &mut HeadChannel| channel.next_snr_db(&vehicle);
        snrs_db.extend(self.channels.iter_mut().map(next_snr_db));
        self.strongest_db = snrs_db.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        self.on_the_way.push_back(Burst {
            number: number as u64,
            vehicle,
            snrs_db,
        });
    }

    /// Odometry up to `time_s`, and what arrives before each sample.
    fn odometry_until(
        &mut self,
        time_s: f64,
        record: &mut RunRecord,
    ) -> Result<(), SimulationError> {
        while let Some(sample_s) = self.odometer.next_s(time_s) {
            while let Some(burst) = self.arrived(|arrives_s| arrives_s < sample_s) {
                self.hear(burst, record)?;
            }
            if let Some(sample) = self.odometer.sample(self.path.at(sample_s)) {
                // A simulated odometer neither repeats itself nor returns NaN.
                let _ = self
                    .onboard
                    .odometry(&self.faults.slip(sample))
                    .map_err(SimulationError::Custom)?;
            }
        }
        Ok(())
    }

    /// Hears what has arrived by `time_s`.
    fn hear_until(&mut self, time_s: f64, record: &mut RunRecord) -> Result<(), SimulationError> {
        while let Some(burst) = self.arrived(|arrives_s| arrives_s <= time_s) {
            self.hear(burst, record)?;
        }
        Ok(())
    }

    /// The next burst, if the time at which it arrives is `by` now.
    fn arrived(&mut self, by: impl Fn(f64) -> bool) -> Option<Burst> {
        let arrives_s = self.on_the_way.front()?.vehicle.time_s + self.latency_s;
        by(arrives_s).then(|| self.on_the_way.pop_front()).flatten()
    }

    fn hear(&mut self, burst: Burst, record: &mut RunRecord) -> Result<(), SimulationError> {
        let mut by_samples;
        let mut by_snapshots;
        let source: &mut dyn SsbSource = if let Some(reception) = &mut self.iq {
            by_samples = IqBurstReception {
                reception,
                number: burst.number,
                path: &self.path,
                lateness_s: self.lateness_s,
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
        let heard = self.onboard.hear(burst.vehicle.time_s, source);
        record.add(&heard.map_err(SimulationError::of_drive)?);
        let mut snrs_db = burst.snrs_db;
        snrs_db.clear();
        self.spare.push(snrs_db);
        Ok(())
    }
}
