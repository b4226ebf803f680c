//! Where a recorded drive begins.

use onboard::geometry::Pose;
use onboard::settings::{Check, LocalizerSettings, SettingsError, Site, Vehicle, WakeUpSettings};

/// Where a drive begins, if not where the vehicle's settings say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum StartChoice {
    /// Where the vehicle's settings say; anywhere on the road if they do not.
    #[default]
    AsSet,
    /// Here.
    At(Pose),
    /// Anywhere on the road.
    Unknown,
}

/// The vehicle with the start of a drive, and that start.
///
/// # Errors
/// [`SettingsError`] when it is not known, and not what finding the vehicle takes.
pub fn starting(
    site: &Site,
    vehicle: &Vehicle,
    choice: StartChoice,
) -> Result<(Vehicle, Pose), SettingsError> {
    let pose = match choice {
        StartChoice::At(pose) => Some(pose),
        StartChoice::Unknown => None,
        StartChoice::AsSet => vehicle.start.pose,
    };
    let mut vehicle = vehicle.clone();
    vehicle.start.pose = pose;
    vehicle.start.known = pose.is_some();
    // Nobody saves energy on what is recorded already, unless asked to.
    vehicle.wake_up.get_or_insert(WakeUpSettings::EVERY_SSB);
    let heard = site.radio_heads.iter();
    let heard = heard
        .filter(|head| vehicle.receiver.hears(head.pci))
        .count();
    let along_road = site.road.is_some() && vehicle.follows_road();
    let tracks = matches!(vehicle.localizer, LocalizerSettings::Tracker(_));
    let findable = tracks && heard > if along_road { 1 } else { 2 };
    let file = &vehicle.name;
    Check { file }.that(
        pose.is_some() || findable,
        "start.pose",
        "missing",
        "without it the vehicle is found by a tracker (localizer.kind), along a road that it follows \
         by two radio heads or more, elsewhere by three",
    )?;
    Ok((vehicle, pose.unwrap_or_default()))
}
