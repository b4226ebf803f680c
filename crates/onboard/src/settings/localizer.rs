//! Localizer settings: computation of a pose from angles and odometry.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[localizer]`: computation of the pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum LocalizerSettings {
    /// Localizer of the paper: each angle yields a heading, and the distance is integrated along
    /// it.
    DeadReckoning(DeadReckoningSettings),
    /// Kalman filter for pose, odometer scale and array calibration.
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
    /// Heading used for the distance between two angles.
    pub heading_between: HeadingBetween,
}

/// Heading used for the distance between two angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HeadingBetween {
    /// Heading of the first angle; it lags in a bend.
    #[default]
    Held,
    /// Mean of both headings, available after the second angle.
    Mean,
}

/// `kind = "tracker"`. The models of odometer, gyroscope, array and lane keeping are in their own
/// tables.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerSettings {
    /// Whether the tracker uses the site's road as a map, if there is one.
    pub map: bool,
    /// RMS curvature of the path in 1/m, used where neither a map nor a yaw rate is available.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub curvature_rms_per_m: f64,
    /// Correlation length of the curvature, in metres.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub curvature_correlation_m: f64,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self {
            map: true,
            // Bends with a radius of 20 m (1σ) and a length of about one radius: a vehicle in a
            // yard.
            curvature_rms_per_m: 0.05,
            curvature_correlation_m: 15.0,
        }
    }
}
