//! Reception of simulated IQ samples with the receiver of the vehicle.

use onboard::observation::{SsbDetection, SsbObservation};
use onboard::receive::{Receiver, ReceiverConfig, Window};
use onboard::{BoxError, SsbInput, SsbSource};

use crate::channel::{HeadChannel, IqAir};
use crate::error::SimulationError;
use crate::random::Streams;
use crate::scenario::Scenario;
use crate::world::{Path, VehicleState};

/// Signal synthesis and receiver of one run.
pub struct IqReception {
    air: IqAir,
    receiver: Receiver,
    observations: Vec<SsbObservation>,
}

/// One burst, which is synthesised when the pipeline receives it.
pub struct IqBurstReception<'a> {
    /// Signal synthesis and receiver.
    pub reception: &'a mut IqReception,
    /// Number of the burst.
    pub number: u64,
    /// True path of the vehicle.
    pub path: &'a Path,
    /// Time stamp minus time of reception of an SSB, in seconds.
    pub angle_time_offset_s: f64,
    /// Channels of the radio heads.
    pub channels: &'a [HeadChannel],
    /// Mean SNR of each radio head (dB).
    pub snrs_db: &'a [f64],
}

impl IqReception {
    /// Creates the synthesis and receiver of the run that `streams` belongs to.
    ///
    /// # Errors
    /// [`SimulationError`] if the scenario cannot be synthesised as samples.
    pub fn new(scenario: &Scenario, streams: Streams) -> Result<Self, SimulationError> {
        let config = ReceiverConfig::new(&scenario.site, &scenario.vehicle);
        Ok(Self {
            air: IqAir::new(scenario, streams)?,
            receiver: Receiver::new(config)?,
            observations: Vec::new(),
        })
    }

    fn receive(
        &mut self,
        number: u64,
        state: impl Fn(f64) -> VehicleState,
        channels: &[HeadChannel],
        snrs_db: &[f64],
    ) -> Result<(), SimulationError> {
        let burst = self.air.receive(number, state, channels, snrs_db)?;
        let antennas: Vec<_> = burst.antennas.iter().map(Vec::as_slice).collect();
        let window = Window {
            start: burst.start,
            time_s: burst.time_s,
            antennas: &antennas,
        };
        let observations = &mut self.observations;
        observations.clear();
        self.receiver.receive(&window, &mut |observation| {
            observations.push(observation.clone());
        })?;
        observations.sort_by(|a, b| a.ssb.time_s.total_cmp(&b.ssb.time_s));
        Ok(())
    }
}

impl SsbSource for IqBurstReception<'_> {
    fn sense(&mut self, sensed: &mut Vec<SsbDetection>) -> Result<(), BoxError> {
        let state = |time_s| self.path.at_reception(time_s, self.angle_time_offset_s);
        self.reception
            .receive(self.number, state, self.channels, self.snrs_db)?;
        sensed.extend(self.reception.observations.iter().map(|it| it.ssb));
        Ok(())
    }

    fn observe(&mut self, index: usize) -> Result<SsbInput<'_>, BoxError> {
        let observation = self.reception.observations.get(index);
        Ok(SsbInput::Snapshots(
            observation.ok_or("no such SSB in the burst")?,
        ))
    }
}
