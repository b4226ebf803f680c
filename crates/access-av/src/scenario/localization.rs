//! Odometer, initial pose, angle estimator and localizer.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::TrackerSettings;

/// `[odometer]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OdometerSettings {
    /// Samples per second.
    pub rate_hz: f64,
    /// Standard deviation of the scale error, drawn once per run (0.003 is 0.3 %).
    pub scale_error_std: f64,
    /// Standard deviation of the distance after one metre, growing with the root of distance.
    pub noise_m_per_sqrt_m: f64,
    /// Probability that a sample is lost.
    pub dropout_probability: f64,
    /// A gyroscope, where the vehicle has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gyro: Option<GyroSettings>,
}

/// `[odometer.gyro]`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GyroSettings {
    /// Angle random walk in rad/√s.
    pub noise_rad_per_sqrt_s: f64,
    /// Standard deviation of the constant bias in rad/s, drawn once per run.
    pub bias_std_radps: f64,
}

impl Default for OdometerSettings {
    fn default() -> Self {
        Self {
            rate_hz: 50.0,
            scale_error_std: 0.0,
            noise_m_per_sqrt_m: 0.0,
            dropout_probability: 0.0,
            gyro: None,
        }
    }
}

/// `[start]`: how well the initial pose is known; exactly in the paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartSettings {
    /// Whether it is known at all. If not, the vehicle is found along the road, by two radio heads
    /// or more.
    pub known: bool,
    /// Whether a vehicle that is to be found may also drive against the road's direction.
    pub either_direction: bool,
    /// Standard deviation in each of x and y, in metres.
    pub position_std_m: f64,
    /// Standard deviation of the heading in radians.
    pub heading_std_rad: f64,
}

impl Default for StartSettings {
    fn default() -> Self {
        Self {
            known: true,
            either_direction: false,
            position_std_m: 0.0,
            heading_std_rad: 0.0,
        }
    }
}

/// `[estimator]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EstimatorSettings {
    /// The method.
    pub method: EstimatorMethod,
    /// Grid of MUSIC in degrees, from which it is refined.
    pub grid_deg: f64,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self {
            method: EstimatorMethod::Music,
            grid_deg: 1.0,
        }
    }
}

impl fmt::Display for EstimatorMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Music => "music",
            Self::RootMusic => "root-music",
            Self::Esprit => "esprit",
            Self::MaximumLikelihood => "maximum-likelihood",
        })
    }
}

/// How an angle of arrival is estimated from a covariance.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Default,
    Serialize,
    Deserialize,
    JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorMethod {
    /// Multiple signal classification, refined off the grid.
    #[default]
    Music,
    /// Its polynomial form.
    RootMusic,
    /// Estimation of signal parameters by rotational invariance.
    Esprit,
    /// One-source maximum likelihood.
    MaximumLikelihood,
}

/// `[localizer]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum LocalizerSettings {
    /// The paper's: each angle becomes a heading, distances are added up along it.
    DeadReckoning(DeadReckoningSettings),
    /// A Kalman filter over pose, odometer scale and array calibration.
    Tracker(TrackerSettings),
}

impl Default for LocalizerSettings {
    fn default() -> Self {
        Self::DeadReckoning(DeadReckoningSettings::default())
    }
}

/// `kind = "dead-reckoning"`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DeadReckoningSettings {
    /// Along which heading the distance between two angles is laid.
    pub heading_between: HeadingBetween,
}

/// Along which heading the distance between two angles is laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HeadingBetween {
    /// The one of the first angle: in a bend it lags behind.
    #[default]
    Held,
    /// The mean of both, once the second is there.
    Mean,
}
