//! Sensor data of the vehicle: wheel odometry and SSBs.

use num_complex::Complex64;

/// Maximum number of antennas.
pub const MAX_ELEMENTS: usize = 16;

/// Maximum number of snapshots (or despread blocks) of one observation.
pub const MAX_SNAPSHOTS: usize = 64;

/// Maximum time between the first and last SSB of a burst: half a frame (TS 38.213, 4.1) minus the
/// length of an SSB. The minimum burst period is half a frame.
pub const BURST_S: f64 = 4.9e-3;

/// Maximum distance counter of usable odometry (m), at which doubles resolve 15 nm.
const MAX_DISTANCE_M: f64 = 1e8;

/// Maximum speed (m/s) and yaw rate (rad/s) of usable odometry, far above those in a wrong unit.
const MAX_RATE: f64 = 1e6;

/// Wheel odometry at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometrySample {
    /// Time in seconds.
    pub time_s: f64,
    /// Distance driven since the start, in metres.
    pub distance_m: f64,
    /// Speed in m/s.
    pub speed_mps: f64,
    /// Yaw rate in rad/s, counter-clockwise, if the vehicle measures it.
    pub yaw_rate_radps: Option<f64>,
}

impl OdometrySample {
    /// Creates a sample without a distance: [`Live`](crate::Live) integrates its speed.
    pub const fn of_speed(time_s: f64, speed_mps: f64, yaw_rate_radps: Option<f64>) -> Self {
        Self {
            time_s,
            distance_m: f64::NAN,
            speed_mps,
            yaw_rate_radps,
        }
    }

    /// Whether all values are finite.
    pub fn is_finite(&self) -> bool {
        self.time_s.is_finite()
            && self.distance_m.is_finite()
            && self.speed_mps.is_finite()
            && self.yaw_rate_radps.is_none_or(f64::is_finite)
    }

    /// Whether the values are small enough that sums of them keep their resolution, so that one
    /// wrong value does not affect later sums.
    pub fn is_in_range(&self) -> bool {
        self.distance_m.abs() <= MAX_DISTANCE_M
            && self.speed_mps.abs() <= MAX_RATE
            && self.yaw_rate_radps.is_none_or(|it| it.abs() <= MAX_RATE)
    }
}

/// Detection of an SSB: identity, time and SNR, available before the angle is estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SsbDetection {
    /// Physical cell identity, 0..=1007 (TS 38.211, 7.4.2.1).
    pub pci: u16,
    /// Index of the SSB in its burst (beam).
    pub ssb_index: u8,
    /// Reception time in seconds.
    pub time_s: f64,
    /// Measured SNR per antenna and resource element, in dB.
    pub snr_db: f64,
}

/// Delay, range rate, carrier phase and power of an SSB according to the clock of the receiver.
/// Delay, rate and phase contain the clock errors of vehicle and radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SsbRanging {
    /// Delay of the first path in seconds, relative to a constant that is common to all cells.
    pub delay_s: f64,
    /// Standard deviation of the delay in seconds, including noise and multipath ...
    pub delay_sigma_s: f64,
    /// ... and its part due to noise, which is independent from one SSB to the next.
    pub delay_noise_sigma_s: f64,
    /// Whether the first path may be weaker than the others, or blocked; the standard deviation of
    /// the delay then does not cover its error.
    pub is_first_path_uncertain: bool,
    /// Rate of the pseudorange in m/s, positive if the distance increases.
    pub rate_mps: f64,
    /// Standard deviation of the rate in m/s, including noise and multipath.
    pub rate_sigma_mps: f64,
    /// Duration over which the rate is measured, in seconds.
    pub rate_interval_s: f64,
    /// Whether the rate is a difference of carrier phases, so that rate and phases contain the same
    /// information.
    pub is_rate_of_phases: bool,
    /// Carrier phase of the first antenna in radians.
    pub phase_rad: f64,
    /// Standard deviation of the carrier phase in radians, including noise and multipath.
    pub phase_sigma_rad: f64,
    /// Power per resource element of all paths, mean over the antennas, in dBFS.
    pub ss_rsrp_dbfs: f64,
    /// Power of the first path, in dBFS.
    pub first_path_dbfs: f64,
}

/// SSB received by the array.
#[derive(Debug, Clone, PartialEq)]
pub struct SsbObservation {
    /// Cell, beam, time and SNR.
    pub ssb: SsbDetection,
    /// Noise power per antenna and snapshot, in the scale of the snapshots, if known.
    pub noise_variance: Option<f64>,
    /// Carrier frequency offset in Hz.
    pub cfo_hz: f64,
    /// Delay, range rate, carrier phase and power, if the receiver measures them.
    pub ranging: Option<SsbRanging>,
    elements: usize,
    /// Snapshots, one after another.
    values: Vec<Complex64>,
}

impl SsbObservation {
    /// Creates a buffer without snapshots for 1..=[`MAX_ELEMENTS`] antennas.
    pub fn new(elements: usize) -> Self {
        let elements = elements.clamp(1, MAX_ELEMENTS);
        Self {
            ssb: SsbDetection {
                pci: 0,
                ssb_index: 0,
                time_s: 0.0,
                snr_db: 0.0,
            },
            noise_variance: None,
            cfo_hz: 0.0,
            ranging: None,
            elements,
            values: Vec::with_capacity(elements * MAX_SNAPSHOTS),
        }
    }

    /// Appends a snapshot: one value for each antenna at the same time (or of the same despread
    /// symbol). Returns `false` if the buffer is full, or the number of antennas differs.
    pub fn push(&mut self, snapshot: &[Complex64]) -> bool {
        let fits = snapshot.len() == self.elements && self.count() < MAX_SNAPSHOTS;
        if fits {
            self.values.extend_from_slice(snapshot);
        }
        fits
    }

    /// Removes all snapshots and sets the SSB, so that one buffer can be reused.
    pub fn restart(&mut self, ssb: SsbDetection) {
        self.ssb = ssb;
        self.noise_variance = None;
        self.cfo_hz = 0.0;
        self.ranging = None;
        self.values.clear();
    }

    /// Returns the number of antennas.
    pub const fn elements(&self) -> usize {
        self.elements
    }

    /// Returns the number of snapshots.
    pub fn count(&self) -> usize {
        self.values.len() / self.elements
    }

    /// Returns the snapshots in order of reception; an empty slice if `N` is not the number of
    /// antennas.
    pub fn snapshots<const N: usize>(&self) -> &[[Complex64; N]] {
        if N == self.elements {
            self.values.as_chunks().0
        } else {
            &[]
        }
    }

    /// Returns all values, one snapshot after another.
    pub fn values(&self) -> &[Complex64] {
        &self.values
    }
}

/// Kind of a measurement, which selects the measurement model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MeasurementKind {
    /// Angle of arrival of a radio head's signal at the array on the vehicle.
    #[default]
    Angle,
    /// Azimuth of the vehicle, measured by the array of a radio head, in the frame of that array.
    AngleAtHead,
}

impl MeasurementKind {
    /// Returns the kind of an angle that was measured at a radio head (`is_at_head`) or on the
    /// vehicle.
    pub const fn of_angle(is_at_head: bool) -> Self {
        if is_at_head {
            Self::AngleAtHead
        } else {
            Self::Angle
        }
    }

    /// Whether the measurement was made at a radio head.
    pub const fn is_at_head(self) -> bool {
        matches!(self, Self::AngleAtHead)
    }
}

/// Angle of arrival, the measurement of a localizer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleMeasurement {
    /// Array that measured the angle.
    pub kind: MeasurementKind,
    /// Time in seconds.
    pub time_s: f64,
    /// Electrical angle ω = 2π(d/λ)·cos θ between neighbouring antennas of a uniform linear array,
    /// in radians; for other arrays, and at a radio head, the azimuth from the array axis.
    pub phase_rad: f64,
    /// Standard deviation of `phase_rad` due to noise, in radians.
    pub phase_sigma_rad: f64,
    /// Angle of arrival θ from the array axis, in radians: in 0..=π for a uniform linear array, in
    /// −π..=π otherwise.
    pub angle_rad: f64,
    /// SNR per antenna and snapshot, in dB.
    pub snr_db: f64,
    /// Whether the error of the estimate is Gaussian with this standard deviation, according to the
    /// estimator.
    pub resolved: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_contains_at_most_its_capacity() {
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
