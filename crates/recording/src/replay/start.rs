//! Start of a recorded drive.

use onboard::geometry::Pose;
use onboard::live::starting_at;
use onboard::settings::{SettingsError, Site, Vehicle, WakeUpSettings};

/// Choice of the start pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum StartChoice {
    /// Start of the vehicle's settings; a search along the road if the settings have none.
    #[default]
    AsSet,
    /// Given pose.
    At(Pose),
    /// Unknown position on the road.
    Unknown,
}

/// Returns the vehicle with the start of a drive, and the start pose.
///
/// # Errors
/// [`SettingsError`] if the start is unknown and a search is impossible.
pub fn starting(
    site: &Site,
    vehicle: &Vehicle,
    choice: StartChoice,
) -> Result<(Vehicle, Pose), SettingsError> {
    let unknown;
    let (vehicle, pose) = match choice {
        StartChoice::At(pose) => (vehicle, Some(pose)),
        StartChoice::AsSet => (vehicle, None),
        StartChoice::Unknown => {
            let mut without = vehicle.clone();
            without.start.pose = None;
            unknown = without;
            (&unknown, None)
        }
    };
    let (mut vehicle, pose) = starting_at(site, vehicle, pose)?;
    // Saving energy is pointless with recorded data, so that every SSB is used by default.
    vehicle.wake_up.get_or_insert(WakeUpSettings::EVERY_SSB);
    Ok((vehicle, pose))
}
