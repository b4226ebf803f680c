//! Walls.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[walls]]`: wall that obstructs lines of sight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallSettings {
    /// Display name, for example of the hall.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Corners in plan `[x, y]`, in metres. Straight walls connect consecutive corners, and are
    /// higher than any line of sight.
    #[schemars(length(min = 2, max = 100), inner(inner(range(min = -1e7, max = 1e7))))]
    pub polyline_m: Vec<[f64; 2]>,
    /// Penetration loss in dB. Default: that of concrete at the site's carrier, 5 + 4 f/GHz (TR
    /// 38.901, table 7.4.3-1; glass 2 + 0.2 f/GHz, wood 4.85 + 0.12 f/GHz).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 200.0))]
    pub loss_db: Option<f64>,
}
