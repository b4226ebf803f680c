//! What the drive has shown of the vehicle that its settings do not say.

use super::filter::Tracker;
use super::state::{LATENESS, MOUNTING, PHASE, SCALE, YAW_RATE_BIAS, YAW_RATE_SCALE};

/// A constant as stated, and as found while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// What is stated ...
    pub stated: f64,
    /// ... what was found ...
    pub found: f64,
    /// ... and its standard deviation.
    pub std: f64,
}

impl Finding {
    /// Whether it is off by more than `least`, and certainly so.
    pub fn is_remarkable(&self, least: f64) -> bool {
        let by = (self.found - self.stated).abs();
        by > least && by > 2.0 * self.std
    }
}

/// Constants of the vehicle, as found while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Findings {
    /// Metres that the odometer reads per metre driven.
    pub odometer_scale: Finding,
    /// Bias of the yaw rate (rad/s).
    pub yaw_rate_bias_radps: Finding,
    /// Radians that the yaw rate, summed up, reads per radian turned.
    pub yaw_rate_scale: Finding,
    /// Direction of the array's axis (rad).
    pub mounting_rad: Finding,
    /// Phase per antenna left by calibration (rad).
    pub phase_rad: Finding,
    /// How much later angles come than their setting says (s).
    pub lateness_s: Finding,
}

impl Tracker {
    /// What the drive has shown of the vehicle.
    pub fn findings(&self) -> Findings {
        let finding = |state: usize, offset: f64, stated: f64| Finding {
            stated,
            found: offset + self.belief.mean[state],
            std: self.belief.covariance[state][state].max(0.0).sqrt(),
        };
        Findings {
            odometer_scale: finding(SCALE, 1.0, self.config.odometer_scale),
            yaw_rate_bias_radps: finding(YAW_RATE_BIAS, 0.0, self.config.yaw_rate_bias_radps),
            yaw_rate_scale: finding(YAW_RATE_SCALE, 1.0, 1.0),
            mounting_rad: finding(MOUNTING, 0.0, self.config.mounting_rad),
            phase_rad: finding(PHASE, 0.0, self.config.phase_rad),
            lateness_s: finding(LATENESS, 0.0, 0.0),
        }
    }
}
