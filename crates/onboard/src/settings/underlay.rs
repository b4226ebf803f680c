//! Background image of a site's maps.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::toml_file::Library;

/// `[underlay]`: image of the plant that reports show as the background of their maps. No
/// computation uses it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnderlaySettings {
    /// PNG or JPEG file with y upwards. The path is relative to the site file, and becomes absolute
    /// when the site is read.
    pub file: String,
    /// Side length of a pixel in metres.
    #[schemars(range(min = 1e-4, max = 1e3))]
    pub metres_per_pixel: f64,
    /// Pixel coordinates of the map's origin: to the right and down from the upper left corner.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub zero_px: [f64; 2],
}

impl UnderlaySettings {
    /// Replaces the file's name by its absolute path, so that the resolved site can be moved.
    pub(super) fn resolve(table: &mut Table, origin: &str, library: &dyn Library) {
        if let Some(Value::String(file)) = table.get_mut("file") {
            *file = library.path(file, origin);
        } // another type is for the reader to refuse
    }
}
