//! Reception by samples: the air makes them, the same receiver as on the vehicle takes them.

use super::SimulationError;
use crate::channel::{HeadChannel, IqAir};
use crate::observation::{ANTENNAS, SsbObservation};
use crate::random::Streams;
use crate::receive::{Receiver, ReceiverConfig, Window};
use crate::scenario::Scenario;
use crate::world::Vehicle;
use nr_ssb::SubcarrierSpacing;
use num_complex::Complex64;

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
            receiver: Receiver::new(receiver_config(scenario))?,
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

/// The scenario's receiver.
fn receiver_config(scenario: &Scenario) -> ReceiverConfig {
    let thirty = scenario.ssb.subcarrier_spacing_khz == 30.0;
    ReceiverConfig {
        ssb_freq_hz: scenario.ssb.carrier_mhz * 1e6,
        spacing: if thirty {
            SubcarrierSpacing::Khz30
        } else {
            SubcarrierSpacing::Khz15
        },
        period_s: scenario.ssb.period_s(),
        pilots: scenario.receiver.pilots,
        snapshots: scenario.array.snapshots.into(),
        calibration: [Complex64::ONE; ANTENNAS],
        cells: Some(scenario.radio_heads.iter().map(|head| head.pci).collect()),
    }
}
