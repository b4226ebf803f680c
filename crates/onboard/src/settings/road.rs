//! Road of a site.

use schemars::{JsonSchema, Schema, SchemaGenerator};
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
    pub segments: Option<Vec<SegmentSettings>>,
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

/// Straight line or arc.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "WrittenSegment")]
pub struct SegmentSettings {
    /// Length in metres.
    pub length_m: f64,
    /// Heading change over this length in radians; positive to the left.
    pub turn_rad: f64,
    /// Whether the position of this segment is known.
    pub surveyed: bool,
}

/// Segment in the file format: an arc has a length or a radius.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "SegmentSettings")]
struct WrittenSegment {
    /// Length in metres; an arc may have `radius_m` instead.
    #[schemars(range(min = 1e-6, max = 1e5))]
    length_m: Option<f64>,
    /// Radius of an arc in metres.
    #[schemars(range(min = 0.01, max = 1e5))]
    radius_m: Option<f64>,
    /// Heading change over this length in radians; positive to the left.
    #[schemars(range(min = -100.0, max = 100.0))]
    turn_rad: Option<f64>,
    /// Whether the segment was surveyed [true]. The geometry of an unsurveyed segment is a guess,
    /// such as the chord between surveyed segments, and must be straight. The tracker does not use
    /// it as a constraint; a simulated vehicle follows it.
    #[serde(default = "surveyed")]
    surveyed: bool,
}

impl TryFrom<WrittenSegment> for SegmentSettings {
    type Error = &'static str;

    fn try_from(written: WrittenSegment) -> Result<Self, &'static str> {
        let turn_rad = written.turn_rad.unwrap_or(0.0);
        let length_m = match (written.length_m, written.radius_m) {
            (Some(length_m), None) => length_m,
            (None, Some(radius_m)) if radius_m >= 0.01 && turn_rad != 0.0 => {
                radius_m * turn_rad.abs()
            }
            (None, Some(_)) => {
                return Err(
                    "a bend needs a `radius_m` of 0.01 m or more and a `turn_rad` that is not 0",
                );
            }
            _ => return Err("one of `length_m` and, of a bend, `radius_m` is needed"),
        };
        Ok(Self {
            length_m,
            turn_rad,
            surveyed: written.surveyed,
        })
    }
}

impl JsonSchema for SegmentSettings {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        WrittenSegment::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        WrittenSegment::json_schema(generator)
    }
}

/// Standard deviation of drawn points, if none is specified (m).
const DRAWN_STD_M: f64 = 0.02;

const fn surveyed() -> bool {
    true
}

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
                let segments: Vec<Segment> = segments
                    .iter()
                    .map(|it| Segment {
                        length_m: it.length_m,
                        turn_rad: it.turn_rad,
                        surveyed: it.surveyed,
                    })
                    .collect();
                let road = Road::from_segments(self.start, &segments, self.width_m);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<SegmentSettings, String> {
        toml::from_str(text).map_err(|error| error.to_string())
    }

    #[test]
    fn a_bend_is_given_by_radius_and_angle_or_by_its_length() {
        let bend = read("radius_m = 25.0\nturn_rad = -1.0471975511965976").unwrap();
        let same = read("length_m = 26.179938779914945\nturn_rad = -1.0471975511965976").unwrap();
        assert!((bend.length_m - same.length_m).abs() < 1e-12);
        assert!((bend.turn_rad - same.turn_rad).abs() < 1e-12);
        for wrong in [
            "turn_rad = 1.0",
            "radius_m = 25.0",
            "radius_m = -25.0\nturn_rad = 1.0",
            "radius_m = 25.0\nlength_m = 3.0",
        ] {
            assert!(read(wrong).unwrap_err().contains('`'), "{wrong}");
        }
    }
}
