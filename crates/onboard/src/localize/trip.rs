//! A trip past four radio heads at 4 m/s, for tests.

use std::sync::Arc;

use crate::localize::ekf::{Ekf, EkfConfig};
use crate::localize::measurement::AngleMeasurement;
use crate::localize::pose_estimate::InitialPose;
use crate::radio_head::RadioHead;
use crate::road::Road;
use crate::settings::{Shipped, Site, TomlFile, Vehicle};

/// Standard deviation of the angles (rad).
pub(super) const SIGMA_RAD: f64 = 0.05;

/// The radio heads, the road, and the filter at its beginning.
pub(super) fn trip() -> (Vec<RadioHead>, Road, Ekf) {
    let site = Site::from_library("trip-4", &Shipped).unwrap();
    let vehicle = Vehicle::from_library("carrier", &Shipped).unwrap();
    let heads = RadioHead::heard(&site, &vehicle);
    let road = site.build_road().unwrap().unwrap();
    let start = InitialPose {
        pose: road.pose(0.0),
        position_std_m: 0.1,
        heading_std_rad: 0.01,
    };
    let config = EkfConfig::new(&site, &vehicle);
    let ekf = Ekf::new(config, Some(Arc::new(road.clone())), &heads, &start);
    (heads, road, ekf)
}

/// An angle.
pub(super) const fn angle(time_s: f64, phase_rad: f64) -> AngleMeasurement {
    AngleMeasurement {
        time_s,
        phase_rad,
        phase_sigma_rad: SIGMA_RAD,
        angle_rad: f64::NAN,
        snr_db: 20.0,
        resolved: true,
    }
}
