//! Reception of snapshots, which are drawn only for the SSBs whose angle is estimated.

use onboard::observation::{SsbDetection, SsbObservation};
use onboard::{BoxError, SsbInput, SsbSource};

use crate::channel::{HeadChannel, Reception};
use crate::world::{Faults, VehicleState};

/// Reception of one burst.
pub struct SnapshotReception<'a> {
    /// Number of the burst.
    pub number: u64,
    /// True state of the vehicle.
    pub vehicle: &'a VehicleState,
    /// Channels of the radio heads.
    pub channels: &'a mut [HeadChannel],
    /// Mean SNR of each radio head (dB).
    pub snrs_db: &'a [f64],
    /// Faults of the run.
    pub faults: &'a Faults,
    /// Reusable buffers.
    pub buffers: &'a mut SnapshotBuffers,
}

/// Reusable buffers for the reception of bursts.
pub struct SnapshotBuffers {
    /// Channel index and reception of each detected SSB.
    receptions: Vec<(usize, Reception)>,
    observation: SsbObservation,
}

impl SnapshotBuffers {
    /// Creates buffers for an array of `elements` antennas.
    pub fn new(elements: usize) -> Self {
        Self {
            receptions: Vec::new(),
            observation: SsbObservation::new(elements),
        }
    }
}

impl SsbSource for SnapshotReception<'_> {
    fn sense(&mut self, sensed: &mut Vec<SsbDetection>) -> Result<(), BoxError> {
        self.buffers.receptions.clear();
        for (index, (channel, snr_db)) in self.channels.iter_mut().zip(self.snrs_db).enumerate() {
            let mut reception = channel.receive(self.vehicle, *snr_db);
            let (head, array) = (channel.head(), channel.array());
            self.faults
                .distort(index, head, array, self.vehicle, reception.gains_mut());
            if reception.is_received() {
                sensed.push(reception.ssb);
                self.buffers.receptions.push((index, reception));
            }
        }
        Ok(())
    }

    fn observe(&mut self, index: usize) -> Result<SsbInput<'_>, BoxError> {
        let received = self.buffers.receptions.get(index);
        let (number, reception) = received.ok_or("no such SSB in the burst")?;
        let channel = self.channels.get_mut(*number);
        let channel = channel.ok_or("no such channel")?;
        let observation = &mut self.buffers.observation;
        channel.observe(self.number, reception, observation);
        Ok(SsbInput::Snapshots(observation))
    }
}
