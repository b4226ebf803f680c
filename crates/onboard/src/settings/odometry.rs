//! How the vehicle drives, and the data sheets of what measures it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::road::LaneKeeping;

/// What the vehicle's kinematics allow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DriveKind {
    /// Steered wheels: it turns only as it drives, and its path bends slowly.
    #[default]
    Road,
    /// Two driven wheels: it also turns on the spot, wherever its yaw rate says. It roams: no road
    /// is followed.
    Differential,
}

/// `[odometer]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OdometerSettings {
    /// Samples per second.
    #[schemars(range(min = 1.0, max = 1000.0))]
    pub rate_hz: f64,
    /// Metres read per metre driven.
    #[schemars(range(min = 0.5, max = 2.0))]
    pub scale: f64,
    /// Standard deviation of that (0.003 is 0.3 %).
    #[schemars(range(min = 0.0, max = 0.5))]
    pub scale_std: f64,
    /// Standard deviation of the distance after one metre, growing with the root of distance.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise_m_per_sqrt_m: f64,
    /// The same after one second of not quite standing, growing with the root of time.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise_m_per_sqrt_s: f64,
    /// Standard deviation of a single reading of the speed, in m/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub speed_noise_mps: f64,
    /// Distance of the contact points of left and right wheel in metres, where these tell the yaw
    /// rate.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 10.0))]
    pub track_width_m: Option<f64>,
    /// Standard deviation of that in metres.
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

/// `[gyroscope]`: whatever tells the yaw rate, a gyroscope or a pair of wheels.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GyroscopeSettings {
    /// Angle random walk in rad/√s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise_rad_per_sqrt_s: f64,
    /// The same by the distance driven, in rad/√m: wheels of unequal grip.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise_rad_per_sqrt_m: f64,
    /// The same by the angle turned, in rad/√rad: wheels that slip as they turn.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise_rad_per_sqrt_rad: f64,
    /// Constant bias in rad/s.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub bias_radps: f64,
    /// Standard deviation of that in rad/s.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub bias_std_radps: f64,
    /// How the bias walks, in rad/s per root of a second; 0 is a constant bias.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub bias_walk_radps_per_sqrt_s: f64,
}

/// `[lane_keeping]`: how the vehicle strays from the middle of the road and comes back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LaneKeepingSettings {
    /// Root mean square distance from the middle, in metres.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub rms_m: f64,
    /// Typical wavelength along the road, in metres.
    #[schemars(range(min = 0.1, max = 10_000.0))]
    pub wavelength_m: f64,
    /// Damping ratio: how soon one swing forgets the last.
    #[schemars(range(min = 0.01, max = 0.99))]
    pub damping: f64,
}

impl Default for LaneKeepingSettings {
    fn default() -> Self {
        Self {
            rms_m: 0.0,
            wavelength_m: 60.0,
            damping: 0.1,
        }
    }
}

impl LaneKeepingSettings {
    /// The process behind it.
    pub const fn process(&self) -> LaneKeeping {
        LaneKeeping {
            rms_m: self.rms_m,
            wavelength_m: self.wavelength_m,
            damping: self.damping,
        }
    }
}
