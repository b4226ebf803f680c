//! How the vehicle's antennas stand.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the antennas stand. Of all but a row the azimuth is measured, from the array's axis
/// counter-clockwise, at elevations from the horizon upwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ArrayShape {
    /// In a row along the axis. Only the angle from the axis shows.
    UniformLinear {},
    /// In a horizontal circle, counter-clockwise from the axis on.
    Circular {},
    /// In a horizontal plane, anywhere but in a row.
    Planar {
        /// Place of each in wavelengths, along the axis and to its left.
        #[schemars(inner(inner(range(min = -10.0, max = 10.0))))]
        places_wavelengths: Vec<[f64; 2]>,
    },
    /// As a table of responses says, patterns and coupling included.
    Measured(MeasuredShape),
}

/// `shape.kind = "measured"`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredShape {
    /// Elevations in radians, ascending in equal steps.
    #[schemars(inner(range(min = -1.6, max = 1.6)))]
    pub elevations_rad: Vec<f64>,
    /// For each elevation, and there for each azimuth counter-clockwise from the axis on, in equal
    /// steps: `[re, im]` of each antenna.
    #[schemars(inner(inner(inner(range(min = -1e6, max = 1e6)))))]
    pub responses: Vec<Vec<[f64; 2]>>,
}

impl Default for ArrayShape {
    fn default() -> Self {
        Self::UniformLinear {}
    }
}

impl ArrayShape {
    /// Whether it is a row.
    pub const fn is_row(&self) -> bool {
        matches!(self, Self::UniformLinear {})
    }
}
