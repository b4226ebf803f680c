//! The road and how the vehicle drives on it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;
use crate::world::LaneKeeping;

/// `[track]`: exactly one of `segments`, `polyline_m` and `file` gives its shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrackSettings {
    /// Width in metres.
    pub width_m: f64,
    /// Radius by which the corners of a polyline are rounded, in metres.
    pub corner_radius_m: f64,
    /// Where `segments` begin.
    pub start: Pose,
    /// Lines and arcs that join without a kink.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<Vec<SegmentSettings>>,
    /// Surveyed points `[x, y]` in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polyline_m: Option<Vec<[f64; 2]>>,
    /// A CSV file with the columns `x_m`, `y_m`, or a GeoJSON `LineString` (projected onto the
    /// tangent plane of its first point), relative to the scenario's own place. Its points are
    /// taken over into `polyline_m` on reading.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

/// A line or an arc.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentSettings {
    /// Length in metres.
    pub length_m: f64,
    /// Turn over this length in radians; left is positive.
    #[serde(default)]
    pub turn_rad: f64,
    /// Whether the road is known to lie there. What is given of a stretch that was not surveyed
    /// is a guess, such as the chord between the ends of the survey, and must be straight. A
    /// tracker does not keep to it; a simulated vehicle does.
    #[serde(default = "surveyed")]
    pub surveyed: bool,
}

const fn surveyed() -> bool {
    true
}

/// `[motion]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MotionSettings {
    /// Where along the road the drive begins, in metres; stops before it are passed over.
    pub start_at_m: f64,
    /// Acceleration and deceleration in m/s².
    pub acceleration_mps2: f64,
    /// Top speed in km/h.
    pub top_speed_kmh: f64,
    /// Stops on the way.
    pub stops: Vec<StopSettings>,
    /// How the vehicle strays from the middle of the road.
    pub lateral_wander: WanderSettings,
}

/// A stop on the way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopSettings {
    /// Distance along the road in metres.
    pub at_m: f64,
    /// How long the vehicle stands, in seconds.
    pub dwell_s: f64,
}

/// Lateral wander.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WanderSettings {
    /// Root mean square distance from the middle, in metres.
    pub rms_m: f64,
    /// Typical wavelength along the road, in metres.
    pub wavelength_m: f64,
    /// Damping ratio, above 0 and below 1: how soon one swing forgets the last.
    pub damping: f64,
}

impl Default for TrackSettings {
    fn default() -> Self {
        Self {
            width_m: 5.0,
            corner_radius_m: 10.0,
            start: Pose::default(),
            segments: None,
            polyline_m: None,
            file: None,
        }
    }
}

impl Default for MotionSettings {
    fn default() -> Self {
        Self {
            start_at_m: 0.0,
            acceleration_mps2: 0.5,
            top_speed_kmh: 15.0,
            stops: Vec::new(),
            lateral_wander: WanderSettings::default(),
        }
    }
}

impl MotionSettings {
    /// Top speed in m/s.
    pub fn top_speed_mps(&self) -> f64 {
        self.top_speed_kmh / 3.6
    }
}

impl Default for WanderSettings {
    fn default() -> Self {
        Self {
            rms_m: 0.0,
            wavelength_m: 60.0,
            damping: 0.1,
        }
    }
}

impl WanderSettings {
    /// The process behind it.
    pub fn lane_keeping(&self) -> LaneKeeping {
        LaneKeeping {
            wander_m: self.rms_m,
            wavelength_m: self.wavelength_m,
            damping: self.damping,
        }
    }
}
