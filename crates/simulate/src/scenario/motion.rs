//! How the vehicle drives.

use onboard::settings::RoadSettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[motion]`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MotionSettings {
    /// What is driven along; the site's road without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<RoadSettings>,
    /// Where along it the drive begins, in metres; stops before it are passed over.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub start_at_m: f64,
    /// Acceleration and deceleration in m/s²; the vehicle's own without.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 20.0))]
    pub acceleration_mps2: Option<f64>,
    /// Top speed in km/h; the vehicle's own without.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 200.0))]
    pub top_speed_kmh: Option<f64>,
    /// Stops on the way.
    #[schemars(length(max = 10_000))]
    pub stops: Vec<StopSettings>,
}

/// A stop on the way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopSettings {
    /// Distance along the road in metres.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub at_m: f64,
    /// How long the vehicle stands, in seconds.
    #[schemars(range(min = 0.0, max = 86_400.0))]
    pub dwell_s: f64,
}
