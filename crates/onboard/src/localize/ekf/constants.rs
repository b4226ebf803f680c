//! Constants of the vehicle as estimated while driving, beside what its settings state.

use super::config::EkfConfig;
use super::state::{Belief, LATENESS, MOUNTING, PHASE, SCALE, YAW_RATE_BIAS, YAW_RATE_SCALE};

/// A constant as stated, and as found while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedConstant {
    /// What is stated ...
    pub stated: f64,
    /// ... what was found ...
    pub found: f64,
    /// ... and its standard deviation.
    pub std: f64,
}

impl EstimatedConstant {
    /// Whether it is off by more than `least`, and certainly so.
    pub fn is_remarkable(&self, least: f64) -> bool {
        let by = (self.found - self.stated).abs();
        by > least && by > 2.0 * self.std
    }
}

/// Constants of the vehicle, as found while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedConstants {
    /// Metres that the odometer reads per metre driven.
    pub odometer_scale: EstimatedConstant,
    /// Bias of the yaw rate (rad/s).
    pub yaw_rate_bias_radps: EstimatedConstant,
    /// Radians that the yaw rate, summed up, reads per radian turned.
    pub yaw_rate_scale: EstimatedConstant,
    /// Direction of the array's axis (rad).
    pub mounting_rad: EstimatedConstant,
    /// Phase per antenna left by calibration (rad).
    pub phase_rad: EstimatedConstant,
    /// How much later angles come than their setting says (s).
    pub lateness_s: EstimatedConstant,
}

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
    pub(super) fn new(config: &EkfConfig, belief: &Belief) -> Self {
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

impl EstimatedConstants {
    pub(super) fn new(config: &EkfConfig, belief: &Belief) -> Self {
        let finding = |state: usize, offset: f64, stated: f64| EstimatedConstant {
            stated,
            found: offset + belief.mean[state],
            std: belief.covariance[state][state].max(0.0).sqrt(),
        };
        Self {
            odometer_scale: finding(SCALE, 1.0, config.odometer_scale),
            yaw_rate_bias_radps: finding(YAW_RATE_BIAS, 0.0, config.yaw_rate_bias_radps),
            yaw_rate_scale: finding(YAW_RATE_SCALE, 1.0, 1.0),
            mounting_rad: finding(MOUNTING, 0.0, config.mounting_rad),
            phase_rad: finding(PHASE, 0.0, config.phase_rad),
            lateness_s: finding(LATENESS, 0.0, 0.0),
        }
    }
}
