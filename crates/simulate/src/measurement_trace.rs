//! Measurement traces: recorded measurements of simulated drives, which can be processed again with
//! another localizer or wake-up policy.
//!
//! The signal of an SSB, including its noise, does not depend on which other SSBs are received
//! ([`HeadChannel::observe`]). Therefore, the angle of every SSB is estimated once. A policy that
//! selects among these angles gets the same record as in its own drive, bit by bit, in a small
//! fraction of the computing time.

use onboard::burst::LoggedAngle;
use onboard::geometry::Pose;
use onboard::localize::AngleMeasurement;
use onboard::observation::{OdometrySample, SsbDetection, SsbObservation};
use onboard::settings::EstimatorMethod;
use onboard::{BoxError, Custom, Pipeline, SsbInput, SsbSource, estimator};
use rayon::prelude::*;

use crate::campaign::{Campaign, CampaignOptions, thread_pool};
use crate::channel::HeadChannel;
use crate::error::SimulationError;
use crate::random::Streams;
use crate::record::RunRecord;
use crate::run::Simulation;
use crate::world::Faults;

/// Measurement traces of several runs.
pub struct MeasurementTraces {
    simulation: Simulation,
    methods: Vec<EstimatorMethod>,
    runs: Vec<MeasurementTrace>,
}

/// Measurements of one run.
pub(crate) struct MeasurementTrace {
    run: u64,
    pub given_start: Pose,
    pub odometry: Vec<OdometrySample>,
    bursts: Vec<Burst>,
    /// Detected SSBs of all bursts.
    sensed: Vec<SsbDetection>,
    /// Angles of the detected SSBs for each method.
    angles: Vec<Vec<Option<AngleMeasurement>>>,
}

/// Burst of SSBs and the true pose of the vehicle.
struct Burst {
    time_s: f64,
    truth: Pose,
    snr_db: f64,
    /// End index of the burst's SSBs in `sensed`.
    end: usize,
}

impl MeasurementTraces {
    /// Records the first `runs` runs of a scenario with the angles of the given methods. Returns
    /// `None` if an SSB depends on the reception of others or if a fault of the receive channels
    /// occurs. A trace contains no receive channels, so that the vehicle's channel monitor could
    /// not detect the fault.
    ///
    /// # Errors
    /// [`SimulationError`] if the thread pool cannot be created or an estimator rejects the array.
    pub fn record(
        simulation: &Simulation,
        methods: &[EstimatorMethod],
        options: &CampaignOptions<'_>,
    ) -> Result<Option<Self>, SimulationError> {
        let faults = &simulation.scenario().faults;
        if !simulation.world().is_independent_of_listening()
            || faults.iter().any(|it| it.what.is_of_channels())
        {
            return Ok(None);
        }
        let (seed, first) = (options.seed, options.first_run);
        let numbers = first..first + options.runs as u64;
        let runs: Vec<_> = thread_pool(options.threads)?.install(|| {
            (numbers.into_par_iter())
                .map(|run| {
                    MeasurementTrace::record(simulation, methods, Streams::new(seed, run), run)
                })
                .collect()
        });
        Ok(Some(Self {
            simulation: simulation.clone(),
            methods: methods.to_vec(),
            runs: runs.into_iter().collect::<Result<_, _>>()?,
        }))
    }

    /// Whether the traces are valid for another simulation. The environment must be equal and its
    /// method must be recorded. The localizer, wake-up policy and computer may differ.
    pub fn serve(&self, other: &Simulation) -> bool {
        let grid_deg = |it: &Simulation| it.scenario().vehicle.estimator.music_grid_deg;
        self.methods
            .contains(&other.scenario().vehicle.estimator.method)
            && grid_deg(&self.simulation) == grid_deg(other)
            && self.simulation.world().has_equal_signals(other.world())
    }

    /// Runs the campaign of a simulation for which the traces are valid.
    ///
    /// # Errors
    /// [`SimulationError`] with the same conditions as [`Simulation::campaign`].
    pub fn campaign(
        &self,
        simulation: &Simulation,
        options: &CampaignOptions<'_>,
    ) -> Result<Campaign, SimulationError> {
        let wanted = simulation.scenario().vehicle.estimator.method;
        let method = self.methods.iter().position(|&method| method == wanted);
        simulation.campaign_of(options, self.runs.len(), |number, used| {
            let trace = self.runs.get(number).zip(method);
            let (trace, method) = trace.ok_or(SimulationError::NotTraced)?;
            trace.drive(simulation, method, used)
        })
    }
}

impl MeasurementTrace {
    /// Returns the SSBs and angles of a method in order of time.
    pub fn angles_of(&self, method: usize) -> impl Iterator<Item = LoggedAngle> {
        let angles = self.angles.get(method).into_iter().flatten();
        let received = self.sensed.iter().zip(angles);
        received.filter_map(|(&ssb, angle)| {
            Some(LoggedAngle {
                ssb,
                measured: (*angle)?,
            })
        })
    }

    /// Returns the times of the bursts and the true poses.
    pub fn truth(&self) -> impl Iterator<Item = (f64, Pose)> {
        self.bursts.iter().map(|burst| (burst.time_s, burst.truth))
    }

    /// Records a run with the angles of the given methods.
    pub fn record(
        simulation: &Simulation,
        methods: &[EstimatorMethod],
        streams: Streams,
        run: u64,
    ) -> Result<Self, SimulationError> {
        let scenario = simulation.scenario();
        let mut estimators = (methods.iter())
            .map(|&method| {
                let mut vehicle = scenario.vehicle.clone();
                vehicle.estimator.method = method;
                estimator::built_in(&vehicle).map_err(|error| SimulationError::Custom(error.into()))
            })
            .collect::<Result<Vec<_>, _>>()?;
        let measurand = scenario.vehicle.array.measurand();
        let mut truth = simulation.world().draw(streams);
        let mut channels = HeadChannel::all(&mut truth, streams);
        let mut faults = Faults::new(&scenario.faults);
        let mut observation = SsbObservation::new(scenario.vehicle.array.elements.into());
        let mut trace = Self {
            run,
            given_start: truth.given_start,
            odometry: Vec::new(),
            bursts: Vec::with_capacity(simulation.steps()),
            sensed: Vec::with_capacity(simulation.steps() * channels.len()),
            angles: vec![Vec::with_capacity(simulation.steps() * channels.len()); methods.len()],
        };
        for number in 0..simulation.steps() {
            let time_s = simulation.time_s(number);
            while let Some(sample_s) = truth.odometer.next_s(time_s) {
                let sample = truth.odometer.sample(truth.path.at(sample_s));
                trace.odometry.extend(sample.map(|it| faults.slip(it)));
            }
            let vehicle = truth
                .path
                .at_reception(time_s, truth.vehicle.receiver.angle_time_offset_s);
            let mut strongest_db = f64::NEG_INFINITY;
            for (index, channel) in channels.iter_mut().enumerate() {
                let snr_db = channel.next_snr_db(&vehicle);
                strongest_db = strongest_db.max(snr_db);
                let mut reception = channel.receive(&vehicle, snr_db);
                let (head, array) = (channel.head(), channel.array());
                faults.distort(index, head, array, &vehicle, reception.gains_mut());
                if !reception.is_received() {
                    continue;
                }
                channel.observe(number as u64, &reception, &mut observation);
                trace.sensed.push(reception.ssb);
                for (estimator, angles) in estimators.iter_mut().zip(&mut trace.angles) {
                    let estimated = estimator.estimate(&observation);
                    let estimated = estimated.map_err(SimulationError::Custom)?;
                    // All built-in estimators report their standard deviation.
                    let bound_rad = || f64::NAN;
                    angles.push(estimated.and_then(|it| {
                        estimator::measurement(&reception.ssb, it, &measurand, bound_rad)
                    }));
                }
            }
            trace.bursts.push(Burst {
                time_s,
                truth: truth.path.at(time_s).pose,
                snr_db: strongest_db,
                end: trace.sensed.len(),
            });
        }
        Ok(trace)
    }

    /// Processes the run in the memory of a record that is not used any more.
    fn drive(
        &self,
        simulation: &Simulation,
        method: usize,
        used: RunRecord,
    ) -> Result<RunRecord, SimulationError> {
        let scenario = simulation.scenario();
        let (site, vehicle) = (&scenario.site, &scenario.vehicle);
        let platform = simulation.platform();
        let custom = Custom::default();
        let mut onboard = Pipeline::new(site, vehicle, platform, self.given_start, custom)?;
        let mut record = used.restarted(self.run, self.bursts.len());
        let mut silence = SsbObservation::new(vehicle.array.elements.into());
        let mut odometry = self.odometry.iter().peekable();
        let angles = self.angles.get(method).map_or(&[][..], Vec::as_slice);
        let mut end = 0;
        for burst in &self.bursts {
            let time_s = burst.time_s;
            while let Some(sample) = odometry.next_if(|sample| sample.time_s <= time_s) {
                // A simulated odometer never repeats a sample and never returns NaN.
                let _ = (onboard.odometry(sample)).map_err(SimulationError::Custom)?;
            }
            let here = end..burst.end;
            end = burst.end;
            let mut played = Played {
                sensed: self.sensed.get(here.clone()).unwrap_or_default(),
                angles: angles.get(here).unwrap_or_default(),
                silence: &mut silence,
            };
            let result = onboard.process_burst(time_s, &mut played);
            record.add(&result.map_err(SimulationError::of_drive)?);
            record.add_step(&onboard, time_s, burst.truth, burst.snr_db)?;
        }
        record.constants = onboard.constants();
        Ok(record)
    }
}

/// Burst from a trace.
struct Played<'a> {
    sensed: &'a [SsbDetection],
    angles: &'a [Option<AngleMeasurement>],
    /// Empty observation for an SSB without an angle.
    silence: &'a mut SsbObservation,
}

impl SsbSource for Played<'_> {
    fn sense(&mut self, sensed: &mut Vec<SsbDetection>) -> Result<(), BoxError> {
        sensed.extend_from_slice(self.sensed);
        Ok(())
    }

    fn observe(&mut self, index: usize) -> Result<SsbInput<'_>, BoxError> {
        let found = self.sensed.get(index).zip(self.angles.get(index));
        let (&ssb, angle) = found.ok_or("no such SSB in the burst")?;
        Ok(if let Some(angle) = angle {
            SsbInput::Angle(*angle)
        } else {
            self.silence.restart(ssb);
            SsbInput::Snapshots(self.silence)
        })
    }
}
