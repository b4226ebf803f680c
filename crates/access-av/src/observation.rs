//! What the vehicle's sensors deliver: wheel odometry and SSBs.

use num_complex::Complex64;

/// Antennas of the vehicle's array.
pub const ANTENNAS: usize = 4;

/// Most snapshots (or despread blocks) one observation holds.
pub const MAX_SNAPSHOTS: usize = 64;

/// Wheel odometry at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometrySample {
    /// Time in seconds.
    pub time_s: f64,
    /// Distance driven since the start, in metres.
    pub distance_m: f64,
    /// Speed in m/s.
    pub speed_mps: f64,
    /// Yaw rate in rad/s, counter-clockwise, where the vehicle has a gyroscope.
    pub yaw_rate_radps: Option<f64>,
}

/// One look at the array: the same instant (or the same despread symbol) at every antenna.
pub type Snapshot = [Complex64; ANTENNAS];

/// What is known of an SSB before its angle is estimated: whose it is and how strong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensedSsb {
    /// Physical cell identity, 0..=1007 (TS 38.211, 7.4.2.1).
    pub pci: u16,
    /// Index of the SSB in its burst, that is its beam.
    pub ssb_index: u8,
    /// Reception time in seconds.
    pub time_s: f64,
    /// Sensed SNR per antenna and resource element, in dB.
    pub snr_db: f64,
}

/// An SSB as received by the array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SsbObservation {
    /// Cell, beam, time and strength.
    pub ssb: SensedSsb,
    /// Noise power per antenna and snapshot where the receiver knows it; the snapshots' scale.
    pub noise_variance: Option<f64>,
    /// Carrier frequency offset in Hz.
    pub cfo_hz: f64,
    snapshots: [Snapshot; MAX_SNAPSHOTS],
    count: usize,
}

impl SsbObservation {
    /// An observation without snapshots yet.
    pub fn new(ssb: SensedSsb) -> Self {
        Self {
            ssb,
            noise_variance: None,
            cfo_hz: 0.0,
            snapshots: [[Complex64::ZERO; ANTENNAS]; MAX_SNAPSHOTS],
            count: 0,
        }
    }

    /// Adds a snapshot; `false` if there is no room left.
    pub fn push(&mut self, snapshot: Snapshot) -> bool {
        let Some(slot) = self.snapshots.get_mut(self.count) else {
            return false;
        };
        *slot = snapshot;
        self.count += 1;
        true
    }

    /// Removes every snapshot and takes up a new SSB, so that one buffer serves a whole drive.
    pub fn restart(&mut self, ssb: SensedSsb) {
        self.ssb = ssb;
        self.noise_variance = None;
        self.cfo_hz = 0.0;
        self.count = 0;
    }

    /// The snapshots, in order of reception.
    pub fn snapshots(&self) -> &[Snapshot] {
        self.snapshots.get(..self.count).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_its_capacity_and_not_more() {
        let ssb = SensedSsb {
            pci: 1,
            ssb_index: 0,
            time_s: 0.0,
            snr_db: 3.0,
        };
        let mut observation = SsbObservation::new(ssb);
        for _ in 0..MAX_SNAPSHOTS {
            assert!(observation.push([Complex64::ONE; ANTENNAS]));
        }
        assert!(!observation.push([Complex64::ONE; ANTENNAS]));
        assert_eq!(observation.snapshots().len(), MAX_SNAPSHOTS);
        observation.restart(ssb);
        assert!(observation.snapshots().is_empty());
    }
}
