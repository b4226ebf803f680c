//! Construction of the localizer from the settings.

use std::sync::Arc;

use super::acquire::{GaussianSum, Relocalizer};
use super::dead_reckoning::DeadReckoning;
use super::ekf::{Ekf, EkfConfig};
use super::localizer::Localizer;
use super::output::InitialPose;
use crate::geometry::Pose;
use crate::radio_head::RadioHead;
use crate::settings::{IntegritySettings, LocalizerSettings, SettingsError, Site, Vehicle};

/// Returns the localizer of a vehicle at a site: at `start`, or with a search along the road if the
/// settings specify an unknown start.
///
/// # Errors
/// [`SettingsError`] if the road of the site is invalid.
pub fn built_in(
    site: &Site,
    vehicle: &Vehicle,
    start: Pose,
) -> Result<Box<dyn Localizer>, SettingsError> {
    if let LocalizerSettings::DeadReckoning(settings) = vehicle.localizer {
        let mounting_rad = vehicle.array.mounting_rad;
        let between = settings.heading_between;
        let localizer = DeadReckoning::new(start, between, mounting_rad);
        return Ok(Box::new(if vehicle.array.shape.is_row() {
            localizer
        } else {
            localizer.by_azimuth()
        }));
    }
    let config = EkfConfig::new(site, vehicle);
    let heads = RadioHead::received_by(site, vehicle);
    let integrity = vehicle.integrity_monitor();
    let integrity = integrity.unwrap_or_else(IntegritySettings::off);
    let road = site.build_road()?.filter(|_| vehicle.follows_road());
    if !vehicle.start.known {
        let either = vehicle.start.either_direction;
        let search = GaussianSum::from_scratch(config, road.clone(), either, &heads);
        return Ok(Box::new(Relocalizer::searching(search, road, integrity)));
    }
    let start = InitialPose {
        pose: start,
        position_std_m: vehicle.start.position_std_m,
        heading_std_rad: vehicle.start.heading_std_rad,
    };
    let ekf = Ekf::new(config, road.clone().map(Arc::new), &heads, &start);
    Ok(Box::new(Relocalizer::tracking(
        &ekf, road, &heads, integrity,
    )))
}
