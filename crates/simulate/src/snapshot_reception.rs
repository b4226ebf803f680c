//! Reception by snapshots: drawn for those SSBs only whose angle is wanted.

use onboard::observation::{SensedSsb, SsbObservation};
use onboard::{BoxError, Observed, SsbSource};

use crate::channel::{HeadChannel, Reception};
use crate::world::{Faults, VehicleState};

/// What the array received of one burst.
pub struct SnapshotReception<'a> {
    /// Number of the burst.
    pub number: u64,
    /// Where the vehicle was.
    pub vehicle: &'a VehicleState,
    /// Channels of the radio heads, and the mean SNR of each (dB).
    pub channels: &'a mut [HeadChannel],
    /// See `channels`.
    pub snrs_db: &'a [f64],
    /// What is wrong.
    pub faults: &'a Faults,
    /// Buffers, kept from burst to burst.
    pub buffers: &'a mut SnapshotBuffers,
}

/// What one burst after the other is received in.
pub struct SnapshotBuffers {
    /// Of each SSB that is heard the number of its channel.
    receptions: Vec<(usize, Reception)>,
    observation: SsbObservation,
}

impl SnapshotBuffers {
    /// Buffers for an array of so many antennas.
    pub fn new(elements: usize) -> Self {
        Self {
            receptions: Vec::new(),
            observation: SsbObservation::new(elements),
        }
    }
}

impl SsbSource for SnapshotReception<'_> {
    fn sense(&mut self, sensed: &mut Vec<SensedSsb>) -> Result<(), BoxError> {
        self.buffers.receptions.clear();
        for (index, (channel, snr_db)) in self.channels.iter_mut().zip(self.snrs_db).enumerate() {
            let mut reception = channel.receive(self.vehicle, *snr_db);
            let (head, array) = (channel.head(), channel.array());
            self.faults
                .distort(index, head, array, self.vehicle, reception.gains_mut());
            if reception.is_heard() {
                sensed.push(reception.ssb);
                self.buffers.receptions.push((index, reception));
            }
        }
        Ok(())
    }

    fn observe(&mut self, index: usize) -> Result<Observed<'_>, BoxError> {
        let heard = self.buffers.receptions.get(index);
        let (number, reception) = heard.ok_or("no such SSB in the burst")?;
        let channel = self.channels.get_mut(*number);
        let channel = channel.ok_or("no such channel")?;
        let observation = &mut self.buffers.observation;
        channel.observe(self.number, reception, observation);
        Ok(Observed::Snapshots(observation))
    }
}
