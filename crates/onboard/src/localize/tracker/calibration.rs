//! How far the array has come from its survey.

use super::config::TrackerConfig;
use super::state::{Belief, MOUNTING, PHASE};

/// Departures count from this many standard deviations on.
const SIGMAS: f64 = 3.0;

/// Whether a constant is certainly not what it was stated to be: its departure is beyond three standard deviations of
/// what is stated by three of its own. Of what is stated rightly, fewer than 0.27 % of the drives see this.
pub(super) fn departs(by: f64, std: f64, stated_std: f64) -> bool {
    by.abs() > SIGMAS * (stated_std + std)
}

/// A constant of the array, as found while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departure {
    /// How far it is from the survey (rad) ...
    pub by_rad: f64,
    /// ... the standard deviation of that ...
    pub std_rad: f64,
    /// ... and the standard deviation that the survey was said to have.
    pub surveyed_std_rad: f64,
}

impl Departure {
    /// Whether it is certain that the survey does not hold.
    pub fn alarms(&self) -> bool {
        departs(self.by_rad, self.std_rad, self.surveyed_std_rad)
    }
}

/// The array's mounting and phase calibration, as found while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Direction of its axis from the surveyed one, counter-clockwise.
    pub mounting: Departure,
    /// Phase per element from the calibrated one.
    pub phase: Departure,
}

impl Calibration {
    pub(super) fn new(config: &TrackerConfig, belief: &Belief) -> Self {
        let departure = |state: usize, surveyed_rad: f64, surveyed_std_rad: f64| Departure {
            by_rad: belief.mean[state] - surveyed_rad,
            std_rad: belief.covariance[state][state].sqrt(),
            surveyed_std_rad,
        };
        Self {
            mounting: departure(MOUNTING, config.mounting_rad, config.mounting_std_rad),
            phase: departure(PHASE, config.phase_rad, config.phase_std_rad),
        }
    }

    /// Whether mounting or phase calibration no longer hold.
    pub fn alarms(&self) -> bool {
        self.mounting.alarms() || self.phase.alarms()
    }
}
