//! Drive type of the vehicle, and data-sheet values of its motion sensors.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::road::LaneKeeping;

/// Drive type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DriveKind {
    /// Steered wheels: the heading changes only while the vehicle drives, and the curvature varies
    /// slowly.
    #[default]
    Road,
    /// Two driven wheels: the vehicle also turns on the spot, at the measured yaw rate. It moves
    /// freely, without a road.
    Differential,
}

/// `[odometer]`: wheel odometer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OdometerSettings {
    /// Sampling rate in hertz.
    #[schemars(range(min = 1.0, max = 1000.0))]
    pub rate_hz: f64,
    /// Scale factor: distance measured per distance driven.
    #[schemars(range(min = 0.5, max = 2.0))]
    pub scale: f64,
    /// Standard deviation of the scale factor (0.003 is 0.3 %).
    #[schemars(range(min = 0.0, max = 0.5))]
    pub scale_std: f64,
    /// Standard deviation of the distance after one metre, in metres; it grows with the square root
    /// of distance.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise_m_per_sqrt_m: f64,
    /// Standard deviation of the distance after one second of slow motion, in metres; it grows with
    /// the square root of time.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise_m_per_sqrt_s: f64,
    /// Standard deviation of one speed measurement, in m/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_noise_mps: f64,
    /// Track width: distance between the contact points of left and right wheel in metres, if the
    /// wheels measure the yaw rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 10.0))]
    pub track_width_m: Option<f64>,
    /// Standard deviation of the track width, in metres.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub track_width_std_m: f64,
    /// Probability that a sample is lost.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub dropout_probability: f64,
}

impl Default for OdometerSettings {
    fn default() -> Self {
        Self {
            rate_hz: 50.0,
            scale: 1.0,
            scale_std: 0.0,
            noise_m_per_sqrt_m: 0.0,
            noise_m_per_sqrt_s: 0.0,
            speed_noise_mps: 0.0,
            track_width_m: None,
            track_width_std_m: 0.0,
            dropout_probability: 0.0,
        }
    }
}

/// `[gyroscope]`: yaw-rate sensor, a gyroscope or a pair of wheels.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GyroscopeSettings {
    /// Angle random walk in rad/√s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise_rad_per_sqrt_s: f64,
    /// Constant bias in rad/s.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub bias_radps: f64,
    /// Standard deviation of the bias, in rad/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub bias_std_radps: f64,
    /// Random walk of the bias, in rad/s per square root of second; 0 means a constant bias.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub bias_walk_radps_per_sqrt_s: f64,
}

/// Damping ratio of the lateral oscillation: a driver or controller that corrects slowly.
const LANE_KEEPING_DAMPING: f64 = 0.1;

/// `[lane_keeping]`: lateral deviation of the vehicle from the centre of the road.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LaneKeepingSettings {
    /// RMS lateral deviation, in metres.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub rms_m: f64,
    /// Typical wavelength along the road, in metres.
    #[schemars(range(min = 0.1, max = 10_000.0))]
    pub wavelength_m: f64,
}

impl Default for LaneKeepingSettings {
    fn default() -> Self {
        Self {
            rms_m: 0.0,
            wavelength_m: 60.0,
        }
    }
}

impl LaneKeepingSettings {
    /// Returns the stochastic process of the lateral deviation.
    pub const fn process(&self) -> LaneKeeping {
        LaneKeeping {
            rms_m: self.rms_m,
            wavelength_m: self.wavelength_m,
            damping: LANE_KEEPING_DAMPING,
        }
    }
}
