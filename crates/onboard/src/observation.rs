//! What the vehicle's sensors deliver: wheel odometry and SSBs.

use num_complex::Complex64;

/// Most antennas of the vehicle's array.
pub const MAX_ELEMENTS: usize = 16;

/// Most snapshots (or despread blocks) one observation holds.
pub const MAX_SNAPSHOTS: usize = 64;

/// All SSBs of a burst begin this close together: within half a frame (TS 38.213, 4.1), less their
/// own length. Bursts may come every half frame.
pub const BURST_S: f64 = 4.9e-3;

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

impl OdometrySample {
    /// One that has no distance: [`Live`](crate::Live) drives on by its speed.
    pub const fn of_speed(time_s: f64, speed_mps: f64, yaw_rate_radps: Option<f64>) -> Self {
        Self {
            time_s,
            distance_m: f64::NAN,
            speed_mps,
            yaw_rate_radps,
        }
    }

    /// Whether all its values are numbers.
    pub fn is_finite(&self) -> bool {
        self.time_s.is_finite()
            && self.distance_m.is_finite()
            && self.speed_mps.is_finite()
            && self.yaw_rate_radps.is_none_or(f64::is_finite)
    }
}

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
#[derive(Debug, Clone, PartialEq)]
pub struct SsbObservation {
    /// Cell, beam, time and strength.
    pub ssb: SensedSsb,
    /// Noise power per antenna and snapshot where the receiver knows it; the snapshots' scale.
    pub noise_variance: Option<f64>,
    /// Carrier frequency offset in Hz.
    pub cfo_hz: f64,
    /// Whether it is the first of its beam since a search has found that. Such a one is heard by itself:
    /// the others of its burst may have been heard before the search was through.
    pub is_first: bool,
    elements: usize,
    /// Snapshot after snapshot.
    values: Vec<Complex64>,
}

impl SsbObservation {
    /// A buffer for observations by so many antennas, 1..=[`MAX_ELEMENTS`], without snapshots yet.
    pub fn new(elements: usize) -> Self {
        let elements = elements.clamp(1, MAX_ELEMENTS);
        Self {
            ssb: SensedSsb {
                pci: 0,
                ssb_index: 0,
                time_s: 0.0,
                snr_db: 0.0,
            },
            noise_variance: None,
            cfo_hz: 0.0,
            is_first: false,
            elements,
            values: Vec::with_capacity(elements * MAX_SNAPSHOTS),
        }
    }

    /// Adds a snapshot: the same instant (or the same despread symbol) at every antenna. `false`
    /// if there is no room left, or it is not of as many antennas.
    pub fn push(&mut self, snapshot: &[Complex64]) -> bool {
        let fits = snapshot.len() == self.elements && self.count() < MAX_SNAPSHOTS;
        if fits {
            self.values.extend_from_slice(snapshot);
        }
        fits
    }

    /// Removes every snapshot and takes up a new SSB, so that one buffer serves a whole drive.
    pub fn restart(&mut self, ssb: SensedSsb) {
        self.ssb = ssb;
        self.noise_variance = None;
        (self.cfo_hz, self.is_first) = (0.0, false);
        self.values.clear();
    }

    /// Becomes a copy of another observation, in the memory there is.
    pub fn copy_from(&mut self, other: &Self) {
        self.values.clone_from(&other.values);
        (self.ssb, self.noise_variance) = (other.ssb, other.noise_variance);
        (self.cfo_hz, self.is_first) = (other.cfo_hz, other.is_first);
        self.elements = other.elements;
    }

    /// Number of antennas.
    pub const fn elements(&self) -> usize {
        self.elements
    }

    /// Number of snapshots.
    pub fn count(&self) -> usize {
        self.values.len() / self.elements
    }

    /// The snapshots, in order of reception; none for another number of antennas than there are.
    pub fn snapshots<const N: usize>(&self) -> &[[Complex64; N]] {
        if N == self.elements {
            self.values.as_chunks().0
        } else {
            &[]
        }
    }

    /// All values, snapshot after snapshot.
    pub fn values(&self) -> &[Complex64] {
        &self.values
    }
}

/// An angle of arrival as a localizer takes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleMeasurement {
    /// Time in seconds.
    pub time_s: f64,
    /// Electrical angle ω = 2π(d/λ)·cos θ between neighbouring antennas of a row, in radians; of any
    /// other array the azimuth from its axis.
    pub phase_rad: f64,
    /// Its standard deviation from noise, in radians.
    pub phase_sigma_rad: f64,
    /// Angle of arrival θ from the array's axis, in radians: 0..=π of a row, −π..=π of any other.
    pub angle_rad: f64,
    /// SNR per antenna and snapshot, in dB.
    pub snr_db: f64,
    /// Whether the estimator vouches for it: that it is Gaussian with this standard deviation.
    pub resolved: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_its_capacity_and_not_more() {
        let mut observation = SsbObservation::new(3);
        for _ in 0..MAX_SNAPSHOTS {
            assert!(observation.push(&[Complex64::ONE; 3]));
        }
        assert!(!observation.push(&[Complex64::ONE; 3]));
        assert_eq!(observation.snapshots::<3>().len(), MAX_SNAPSHOTS);
        assert!(observation.snapshots::<4>().is_empty());
        observation.restart(observation.ssb);
        assert!(observation.snapshots::<3>().is_empty());
        assert!(!observation.push(&[Complex64::ONE; 4]));
    }
}
