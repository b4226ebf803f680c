//! A picture under a site's maps.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::toml_file::Library;

/// `[underlay]`: a picture of the plant that pages show under their maps. Nothing is computed
/// from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnderlaySettings {
    /// A PNG or JPEG file with y upward, relative to the site's own place; its whole path is taken
    /// over on reading.
    pub file: String,
    /// Side of a pixel in metres.
    #[schemars(range(min = 1e-4, max = 1e3))]
    pub metres_per_pixel: f64,
    /// Where the map's zero is, in pixels to the right and down from the upper left corner.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub zero_px: [f64; 2],
}

impl UnderlaySettings {
    /// Puts the whole path in place of the file's name, so that a resolved site stands anywhere.
    pub(super) fn resolve(table: &mut Table, origin: &str, library: &dyn Library) {
        if let Some(Value::String(file)) = table.get_mut("file") {
            *file = library.path(file, origin);
        } // another type is for the reader to refuse
    }
}
