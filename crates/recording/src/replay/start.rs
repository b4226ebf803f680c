//! Where a recorded drive begins.

use onboard::geometry::Pose;
use onboard::live::starting_at;
use onboard::settings::{SettingsError, Site, Vehicle, WakeUpSettings};

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
    // Nobody saves energy on what is recorded already, unless asked to.
    vehicle.wake_up.get_or_insert(WakeUpSettings::EVERY_SSB);
    Ok((vehicle, pose))
}
