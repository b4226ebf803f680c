//! Motion of the vehicle.

use onboard::settings::RoadSettings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[motion]`: path, stops and speed of the vehicle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MotionSettings {
    /// Path of the vehicle [default: the site's road].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<RoadSettings>,
    /// Start position along the path in metres. Stops before it are ignored.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub start_at_m: f64,
    /// Acceleration and deceleration in m/s² [default: the vehicle's].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 20.0))]
    pub acceleration_mps2: Option<f64>,
    /// Top speed in km/h [default: the vehicle's].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 200.0))]
    pub top_speed_kmh: Option<f64>,
    /// Stops along the path.
    #[schemars(length(max = 10_000))]
    pub stops: Vec<StopSettings>,
}

/// Stop along the path.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopSettings {
    /// Display name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Position along the path in metres.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub at_m: f64,
    /// Duration of the stop in seconds.
    #[schemars(range(min = 0.0, max = 86_400.0))]
    pub dwell_s: f64,
}
