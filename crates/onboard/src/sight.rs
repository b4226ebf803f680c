//! Angles at which radio heads are seen from a pose.

use crate::geometry::{Pose, wrap_angle};
use crate::manifold::Measurand;
use crate::radio_head::RadioHead;
use crate::settings::Vehicle;

/// Where radio heads are seen from a pose.
#[derive(Debug, Clone)]
pub struct Sight {
    measurand: Measurand,
    position_m: [f64; 3],
    mounting_rad: f64,
}

impl Sight {
    /// By the array of a vehicle.
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            measurand: vehicle.array.measurand(),
            position_m: vehicle.array.position_m,
            mounting_rad: vehicle.array.mounting_rad,
        }
    }

    /// What is measured with the array.
    pub const fn measurand(&self) -> &Measurand {
        &self.measurand
    }

    /// A measured value minus the one at which a radio head is seen from `pose` (rad).
    pub fn residual_rad(&self, pose: Pose, head: &RadioHead, value_rad: f64) -> f64 {
        let [forward_m, left_m, up_m] = self.position_m;
        let array = pose.beside(forward_m, left_m);
        let ground_m = array.distance_m(head.position);
        let level = ground_m / ground_m.hypot(head.height_m - up_m).max(f64::MIN_POSITIVE);
        let azimuth_rad = array.bearing_rad(head.position) - pose.heading_rad - self.mounting_rad;
        wrap_angle(value_rad - self.measurand.value_rad(azimuth_rad, level))
    }
}
