//! Geometry of the antenna array.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Array geometry. A uniform linear array measures the angle from its axis. Every other geometry
/// measures the azimuth, counter-clockwise from the array axis, for elevations from the horizon
/// upwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ArrayShape {
    /// Uniform linear array along the array axis.
    UniformLinear {},
    /// Uniform circular array in the horizontal plane, counter-clockwise from the array axis.
    Circular {},
    /// Planar array in the horizontal plane; the antennas are not collinear.
    Planar {
        /// Position of each antenna in wavelengths: along the array axis, and to its left.
        #[schemars(inner(inner(range(min = -10.0, max = 10.0))))]
        places_wavelengths: Vec<[f64; 2]>,
    },
    /// Measured manifold: a table of responses that includes element patterns and coupling.
    Measured(MeasuredShape),
}

/// `shape.kind = "measured"`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredShape {
    /// Elevations of the table in radians, ascending in equal steps.
    #[schemars(inner(range(min = -1.6, max = 1.6)))]
    pub elevations_rad: Vec<f64>,
    /// Response `[re, im]` of each antenna, for each elevation and each azimuth. Azimuths are
    /// counter-clockwise from the array axis, in equal steps.
    #[schemars(inner(inner(inner(range(min = -1e6, max = 1e6)))))]
    pub responses: Vec<Vec<[f64; 2]>>,
}

impl Default for ArrayShape {
    fn default() -> Self {
        Self::UniformLinear {}
    }
}

impl ArrayShape {
    /// Whether the array is a uniform linear array.
    pub const fn is_row(&self) -> bool {
        matches!(self, Self::UniformLinear {})
    }
}
