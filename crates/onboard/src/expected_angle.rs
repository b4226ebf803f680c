//! Predicted angles of radio heads from a pose.

use crate::geometry::{Pose, wrap_angle};
use crate::manifold::Measurand;
use crate::observation::MeasurementKind;
use crate::radio_head::RadioHead;
use crate::settings::Vehicle;

/// Measurement model of the angle of a radio head.
#[derive(Debug, Clone)]
pub struct ExpectedAngle {
    measurand: Measurand,
    position_m: [f64; 3],
    mounting_rad: f64,
}

impl ExpectedAngle {
    /// Creates the model of a vehicle's array.
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            measurand: vehicle.array.measurand(),
            position_m: vehicle.array.position_m,
            mounting_rad: vehicle.array.mounting_rad,
        }
    }

    /// Returns the angle that the array measures.
    pub const fn measurand(&self) -> &Measurand {
        &self.measurand
    }

    /// Returns a measured value minus the predicted value for a radio head and a pose (rad). NaN if
    /// the radio head measured the value and has no array.
    pub fn residual_rad(
        &self,
        kind: MeasurementKind,
        pose: Pose,
        head: &RadioHead,
        value_rad: f64,
    ) -> f64 {
        let [forward_m, left_m, up_m] = self.position_m;
        let array = pose.point_at(forward_m, left_m);
        if kind.is_at_head() {
            let axis_rad = head.array.map_or(f64::NAN, |own| own.mounting_rad);
            return wrap_angle(value_rad - head.position.bearing_rad(array) + axis_rad);
        }
        let ground_m = array.distance_m(head.position);
        let level = ground_m / ground_m.hypot(head.height_m - up_m).max(f64::MIN_POSITIVE);
        let azimuth_rad = array.bearing_rad(head.position) - pose.heading_rad - self.mounting_rad;
        wrap_angle(value_rad - self.measurand.value_rad(azimuth_rad, level))
    }
}
