//! Road of a site.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::check::Check;
use super::error::SettingsError;
use super::toml_file::Library;
use crate::geometry::{Point, Pose};
use crate::road::{Road, RoadError, Segment};

/// `[road]`: exactly one of `segments`, `polyline_m` and `file` defines the centre line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RoadSettings {
    /// Width in metres.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub width_m: f64,
    /// Standard deviation of the road's position, perpendicular to the road, in metres.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub position_std_m: f64,
    /// Radius of the arcs that replace the corners of a polyline, in metres. Default: a smooth
    /// curve through the points, within their standard deviation.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 1e5))]
    pub corner_radius_m: Option<f64>,
    /// Start pose of `segments`.
    pub start: Pose,
    /// Straight lines and arcs, joined with a continuous heading.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<Vec<Segment>>,
    /// Surveyed points `[x, y]` in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(inner(range(min = -1e7, max = 1e7))))]
    pub polyline_m: Option<Vec<[f64; 2]>>,
    /// CSV file with the columns `x_m` and `y_m`, or GeoJSON `LineString` (projected onto the
    /// tangent plane of its first point). The path is relative to the site file. Its points are
    /// copied to `polyline_m` when the site is read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

/// Standard deviation of drawn points, if none is specified (m).
const DRAWN_STD_M: f64 = 0.02;

impl Default for RoadSettings {
    fn default() -> Self {
        Self {
            width_m: 5.0,
            position_std_m: 0.0,
            corner_radius_m: None,
            start: Pose::default(),
            segments: None,
            polyline_m: None,
            file: None,
        }
    }
}

impl RoadSettings {
    /// Reads `file` into `polyline_m`, so that the resolved road does not depend on other files.
    ///
    /// # Errors
    /// [`SettingsError`] if the library does not contain the file, or it contains no points.
    pub fn resolve(
        table: &mut Table,
        key: &str,
        origin: &str,
        library: &dyn Library,
    ) -> Result<(), SettingsError> {
        let Some(Value::String(file)) = table.get("file").cloned() else {
            return Ok(()); // another type is for the reader to refuse
        };
        let check = Check { file: origin };
        check.that(
            !table.contains_key("segments") && !table.contains_key("polyline_m"),
            &format!("{key}.file"),
            format!("{file:?}"),
            "only one of `segments`, `polyline_m` and `file` is allowed",
        )?;
        let points = library.points_m(&file, origin)?.into_iter();
        let points = points.map(|point| Value::Array(point.map(Value::Float).to_vec()));
        table.insert("polyline_m".to_owned(), Value::Array(points.collect()));
        table.remove("file");
        Ok(())
    }

    /// Returns the standard deviation of the road's position: as specified, otherwise that of drawn
    /// points.
    pub fn survey_std_m(&self) -> f64 {
        let is_drawn = self.polyline_m.is_some() && self.corner_radius_m.is_none();
        let min_m = if is_drawn { DRAWN_STD_M } else { 0.0 };
        self.position_std_m.max(min_m)
    }

    /// Builds the road. Errors name `key` as the path of the table.
    ///
    /// # Errors
    /// [`SettingsError::Value`] if the road has no shape, more than one, or an impossible one.
    pub fn build(&self, key: &str, check: Check<'_>) -> Result<Road, SettingsError> {
        let (shape, road) = match (&self.segments, &self.polyline_m) {
            (Some(segments), None) => {
                let road = Road::from_segments(self.start, segments, self.width_m);
                ("segments", road)
            }
            (None, Some(polyline)) => {
                let points: Vec<Point> = polyline.iter().map(|&point| point.into()).collect();
                let road = match self.corner_radius_m {
                    Some(radius_m) => Road::from_polyline(&points, radius_m, self.width_m),
                    None => Road::through_points(&points, self.survey_std_m(), self.width_m),
                };
                ("polyline_m", road)
            }
            (None, None) => {
                let allowed = "one of `segments`, `polyline_m` and `file` is needed";
                return Err(check.error(key, "without a shape", allowed));
            }
            (Some(_), Some(_)) => {
                let allowed = "only one of `segments`, `polyline_m` and `file` is allowed";
                return Err(check.error(key, "given twice", allowed));
            }
        };
        road.map_err(|error| {
            let (at, value) = match error {
                RoadError::Length { index, length_m } => {
                    (format!("[{index}].length_m"), length_m.to_string())
                }
                RoadError::BentGuess { index, turn_rad } => {
                    (format!("[{index}].turn_rad"), turn_rad.to_string())
                }
                RoadError::RepeatedPoint { index } | RoadError::Reversal { index } => {
                    (format!("[{index}]"), "not passable".to_owned())
                }
                RoadError::TooLong { length_m } => (String::new(), format!("{length_m:.0} m")),
                RoadError::Empty => (String::new(), "too short".to_owned()),
            };
            check.error(&format!("{key}.{shape}{at}"), value, &error.to_string())
        })
    }
}
