//! The policy that a vehicle's settings choose.

use super::adaptive::Adaptive;
use super::fixed::FixedInterval;
use super::policy::WakeUpPolicy;
use super::uncertainty::UncertaintyDriven;
use crate::settings::{Check, Platform, SettingsError, Site, Vehicle, WakeUpSettings};

/// The policy of a vehicle at a site, base wake-up times being the platform's where the settings
/// leave them to it.
///
/// # Errors
/// [`SettingsError`] when the platform lacks what the settings ask of it.
pub fn built_in(
    site: &Site,
    vehicle: &Vehicle,
    platform: &Platform,
) -> Result<Box<dyn WakeUpPolicy>, SettingsError> {
    let interval_s = |explicit_ms: Option<f64>| match explicit_ms {
        Some(explicit_ms) => Ok(explicit_ms * 1e-3),
        None => platform.base_wake_up_s(vehicle),
    };
    Ok(match vehicle.wake_up {
        WakeUpSettings::Fixed(settings) => {
            Box::new(FixedInterval::new(interval_s(settings.interval_ms)?))
        }
        WakeUpSettings::Pid(settings) => {
            let base_s = interval_s(settings.base_ms)?;
            let file = &vehicle.name;
            Check { file }.that(
                settings.t_max_ms * 1e-3 >= base_s,
                "wake_up.t_max_ms",
                settings.t_max_ms,
                &format!(
                    "it must not be below the base wake-up time, {} ms",
                    base_s * 1e3
                ),
            )?;
            Box::new(Adaptive::new(&settings, base_s, vehicle.top_speed_mps()))
        }
        WakeUpSettings::Uncertainty(settings) => {
            Box::new(UncertaintyDriven::new(&settings, site, vehicle))
        }
    })
}
