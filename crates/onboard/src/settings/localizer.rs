//! How angles and odometry become a pose, and how far that is trusted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
        Self::Tracker(TrackerSettings::default())
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

/// `kind = "tracker"`. What it assumes of odometer, gyroscope, array and lane stands in their own
/// tables.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerSettings {
    /// Whether it takes the road's course from the site, where the site has one.
    pub map: bool,
    /// RMS curvature of the path in 1/m, used where neither a map nor a yaw rate is available.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub curvature_rms_per_m: f64,
    /// Correlation length of the curvature, in metres.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub curvature_correlation_m: f64,
    /// How the odometer's scale walks, per root of a metre driven; 0 is a constant scale on a road and
    /// where the odometer's scale deviation and noise are stated, and 0.03 for any other differential
    /// drive.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub odometer_scale_walk_per_sqrt_m: f64,
    /// Probability with which a good angle is taken for an outlier.
    #[schemars(range(min = 1e-12, max = 0.5))]
    pub outlier_probability: f64,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self {
            map: true,
            // Bends with a radius of 20 m (σ), each about as long as its radius: a vehicle in a yard.
            curvature_rms_per_m: 0.05,
            curvature_correlation_m: 15.0,
            odometer_scale_walk_per_sqrt_m: 0.0,
            outlier_probability: 1e-4,
        }
    }
}
