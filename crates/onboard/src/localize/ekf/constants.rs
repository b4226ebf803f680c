//! Constants of the vehicle as estimated while driving, beside what its settings state.

use super::config::EkfConfig;
use super::state::{Belief, LATENESS, MOUNTING, PHASE, SCALE, YAW_RATE_BIAS, YAW_RATE_SCALE};
use crate::gaussian::CERTAIN_SIGMAS;

/// A constant as stated, and as found while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedConstant {
    /// What is stated ...
    pub stated: f64,
    /// ... and its standard deviation.
    pub stated_std: f64,
    /// What was found ...
    pub found: f64,
    /// ... and its standard deviation.
    pub std: f64,
}

impl EstimatedConstant {
    /// How far it is from what is stated.
    pub fn departure(&self) -> f64 {
        self.found - self.stated
    }

    /// Whether it is off by more than `least`, and certainly so.
    pub fn is_remarkable(&self, least: f64) -> bool {
        let by = self.departure().abs();
        by > least && by > 2.0 * self.std
    }

    /// Whether it is certainly not what it was stated to be: its departure is beyond three standard deviations of what
    /// is stated by three of its own. Of what is stated rightly, fewer than 0.27 % of the drives see this.
    pub fn departs(&self) -> bool {
        self.departure().abs() > CERTAIN_SIGMAS * (self.stated_std + self.std)
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

impl EstimatedConstants {
    pub(super) fn new(config: &EkfConfig, belief: &Belief) -> Self {
        let constant = |state: usize, offset: f64, (stated, stated_std)| EstimatedConstant {
            stated,
            stated_std,
            found: offset + belief.mean[state],
            std: belief.covariance[state][state].max(0.0).sqrt(),
        };
        let yaw_rate_bias = (config.yaw_rate_bias_radps, config.yaw_rate_bias_std_radps);
        Self {
            odometer_scale: constant(
                SCALE,
                1.0,
                (config.odometer_scale, config.odometer_scale_std),
            ),
            yaw_rate_bias_radps: constant(YAW_RATE_BIAS, 0.0, yaw_rate_bias),
            yaw_rate_scale: constant(YAW_RATE_SCALE, 1.0, (1.0, config.yaw_rate_scale_std)),
            mounting_rad: constant(
                MOUNTING,
                0.0,
                (config.mounting_rad, config.mounting_std_rad),
            ),
            phase_rad: constant(PHASE, 0.0, (config.phase_rad, config.phase_std_rad)),
            lateness_s: constant(LATENESS, 0.0, (0.0, config.lateness_std_s)),
        }
    }

    /// Whether mounting or phase calibration of the array no longer hold.
    pub fn array_departs(&self) -> bool {
        self.mounting_rad.departs() || self.phase_rad.departs()
    }
}
