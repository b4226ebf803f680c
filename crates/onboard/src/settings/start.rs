//! How well the initial pose is known.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;

/// `[start]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StartSettings {
    /// Whether it is known at all. If not, the vehicle is found along the road by two radio heads or
    /// more, elsewhere by three.
    pub known: bool,
    /// Whether a vehicle that is to be found may also drive against the road's direction.
    pub either_direction: bool,
    /// Standard deviation in each of x and y, in metres.
    #[schemars(range(min = 0.0, max = 10_000.0))]
    pub position_std_m: f64,
    /// Standard deviation of the heading in radians.
    #[schemars(range(min = 0.0, max = 6.3))]
    pub heading_std_rad: f64,
    /// Where the drive starts, as far as it is the same for every drive. A simulated drive starts
    /// where its motion says.
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
