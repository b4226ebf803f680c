//! Segments of a road, as in a site file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Straight line or arc.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "WrittenSegment")]
#[schemars(rename = "SegmentSettings")]
pub struct Segment {
    /// Length in metres.
    pub length_m: f64,
    /// Heading change over this length in radians; positive to the left, zero for a line.
    pub turn_rad: f64,
    /// Whether the position was surveyed; otherwise it is a guess, which must be straight.
    pub surveyed: bool,
}

/// Segment in the file format: an arc has a length or a radius.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
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

impl TryFrom<WrittenSegment> for Segment {
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

const fn surveyed() -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Segment, String> {
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
