//! The policy that a vehicle's settings choose.

use super::adaptive::Adaptive;
use super::controller::Controller;
use super::due::Due;
use super::fixed::FixedInterval;
use super::gated::Gated;
use super::policy::WakeUpPolicy;
use super::uncertainty::UncertaintyDriven;
use crate::energy::EnergyModel;
use crate::settings::{
    Check, DueSettings, Extent, PidSettings, Platform, SettingsError, Site, UncertaintySettings,
    Vehicle, WakeUpSettings,
};

/// Energy of a wake-up before its first angle, in executions, where no platform knows.
const UNKNOWN_WAKE_UP_COST: f64 = 0.5;

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
    let controlled = |settings: &PidSettings, key: &str| {
        let base_s = interval_s(settings.base_ms)?;
        not_before(base_s, settings.t_max_ms, key, vehicle)?;
        let controller = Controller::new(settings, base_s, vehicle.top_speed_mps());
        Ok(Due::controlled(controller, settings.sensing))
    };
    Ok(match vehicle.wake_up_policy() {
        WakeUpSettings::Fixed(settings) => {
            Box::new(FixedInterval::new(interval_s(settings.interval_ms)?))
        }
        WakeUpSettings::Pid(settings) => {
            Box::new(Adaptive::new(controlled(&settings, "wake_up.t_max_ms")?))
        }
        WakeUpSettings::Gated(settings) => {
            let (due, shortest_s) = match settings.due {
                DueSettings::Fixed(due) => {
                    let shortest_s = interval_s(due.interval_ms)?;
                    (Due::constant(shortest_s), shortest_s)
                }
                DueSettings::Pid(due) => {
                    let shortest_s = interval_s(due.base_ms)?;
                    (controlled(&due, "wake_up.due.t_max_ms")?, shortest_s)
                }
            };
            let latest_s = match settings.latest_ms {
                Some(latest_ms) => {
                    not_before(shortest_s, latest_ms, "wake_up.latest_ms", vehicle)?;
                    latest_ms * 1e-3
                }
                None => f64::INFINITY,
            };
            Box::new(Gated::new(due, settings.snr_set_point, latest_s))
        }
        WakeUpSettings::Uncertainty(settings) => {
            let cost = wake_up_cost(&settings, vehicle, platform)?;
            Box::new(UncertaintyDriven::new(&settings, cost, site, vehicle))
        }
    })
}

/// The vehicle with everything written out that its wake-up leaves to the platform.
///
/// # Errors
/// As [`built_in`].
pub fn resolve(vehicle: &Vehicle, platform: &Platform) -> Result<Vehicle, SettingsError> {
    let mut resolved = platform.resolve(vehicle)?;
    if let Some(WakeUpSettings::Uncertainty(settings)) = &mut resolved.wake_up {
        settings.wake_up_cost = Some(wake_up_cost(settings, vehicle, platform)?);
    }
    Ok(resolved)
}

/// Energy of a wake-up before its first angle, in executions.
fn wake_up_cost(
    settings: &UncertaintySettings,
    vehicle: &Vehicle,
    platform: &Platform,
) -> Result<f64, SettingsError> {
    if let Some(stated) = settings.wake_up_cost {
        return Ok(stated);
    }
    let model = EnergyModel::new(vehicle, platform, Extent::Value)?;
    let known = model.and_then(|model| model.listening_in_executions());
    Ok(known.unwrap_or(UNKNOWN_WAKE_UP_COST))
}

/// Refuses a longest wake-up time below the shortest.
fn not_before(
    base_s: f64,
    longest_ms: f64,
    key: &str,
    vehicle: &Vehicle,
) -> Result<(), SettingsError> {
    let file = &vehicle.name;
    let base_ms = base_s * 1e3;
    let allowed = format!("it must not be below the base wake-up time, {base_ms} ms");
    Check { file }.that(longest_ms >= base_ms - 1e-9, key, longest_ms, &allowed)
}
