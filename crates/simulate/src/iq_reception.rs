//! Reception by samples: the air makes them, the same receiver as on the vehicle takes them.

use super::SimulationError;
use crate::channel::{HeadChannel, IqAir};
use crate::observation::SsbObservation;
use crate::random::Streams;
use crate::receive::{Receiver, ReceiverConfig, Window};
use crate::scenario::Scenario;
use crate::world::Vehicle;

/// Air and receiver of one run.
pub(super) struct IqReception {
    air: IqAir,
    receiver: Receiver,
    observations: Vec<SsbObservation>,
}

impl IqReception {
    pub fn new(scenario: &Scenario, streams: Streams) -> Result<Self, SimulationError> {
        Ok(Self {
            air: IqAir::new(scenario, streams)?,
            receiver: Receiver::new(ReceiverConfig::new(scenario))?,
            observations: Vec::new(),
        })
    }

    /// Receives burst number `number`.
    pub fn receive(
        &mut self,
        number: u64,
        vehicle: &Vehicle,
        heads: &[HeadChannel],
        snrs_db: &[f64],
    ) -> Result<(), SimulationError> {
        let burst = self
            .air
            .receive(number, |time_s| vehicle.at(time_s), heads, snrs_db)?;
        let window = Window {
            start: burst.start,
            time_s: burst.time_s,
            antennas: burst.antennas.each_ref().map(Vec::as_slice),
        };
        let observations = &mut self.observations;
        observations.clear();
        self.receiver
            .receive(&window, |observation| observations.push(*observation))?;
        observations.sort_by(|a, b| a.ssb.time_s.total_cmp(&b.ssb.time_s));
        Ok(())
    }

    /// The SSBs of the last burst that the receiver made out, in order of time.
    pub fn observations(&self) -> &[SsbObservation] {
        &self.observations
    }
}
