//! Initial pose and its uncertainty.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;

/// `[start]`: initial pose and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartSettings {
    /// Whether the initial pose is known. Otherwise a search locates the vehicle, on a road with at
    /// least two radio heads, elsewhere with three.
    pub known: bool,
    /// Whether the search also considers vehicles that drive against the road's direction.
    pub either_direction: bool,
    /// Standard deviation of x and y, each in metres.
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub position_std_m: f64,
    /// Standard deviation of the heading in radians.
    #[schemars(range(min = 0.0, max = 6.3))]
    pub heading_std_rad: f64,
    /// Initial pose, if it is identical in every drive. A simulated run starts at the start of its
    /// motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<Pose>,
}

impl Default for StartSettings {
    fn default() -> Self {
        Self {
            known: true,
            either_direction: false,
            position_std_m: 0.5,
            heading_std_rad: 0.05,
            pose: None,
        }
    }
}
