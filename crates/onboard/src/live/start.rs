//! Start of a drive.

use crate::geometry::Pose;
use crate::settings::{Check, LocalizerSettings, SettingsError, Site, Vehicle};

/// Returns the vehicle with a start pose, and this pose. The pose is `start` if it is given, otherwise
/// the start pose of the vehicle file, otherwise unknown.
///
/// # Errors
/// [`SettingsError`] if the start is unknown and a search is impossible.
pub fn starting_at(
    site: &Site,
    vehicle: &Vehicle,
    start: Option<Pose>,
) -> Result<(Vehicle, Pose), SettingsError> {
    let pose = start.or(vehicle.start.pose);
    let mut vehicle = vehicle.clone();
    vehicle.start.pose = pose;
    vehicle.start.known = pose.is_some();
    let received = site.radio_heads.iter();
    let received = received
        .filter(|head| vehicle.receiver.receives(head.pci))
        .count();
    let along_road = site.road.is_some() && vehicle.follows_road();
    let tracks = matches!(vehicle.localizer, LocalizerSettings::Tracker(_));
    let findable = tracks && received > if along_road { 1 } else { 2 };
    let file = &vehicle.name;
    Check { file }.that(
        pose.is_some() || findable,
        "start.pose",
        "missing",
        "a search without start pose needs localizer.kind = \"tracker\", and at least two radio \
         heads along a road that the vehicle follows, elsewhere three",
    )?;
    Ok((vehicle, pose.unwrap_or_default()))
}
