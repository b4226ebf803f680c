//! Construction of the wake-up policy from the settings.

use super::adaptive::Adaptive;
use super::controller::Controller;
use super::due::Due;
use super::fixed::FixedInterval;
use super::policy::WakeUpPolicy;
use super::uncertainty::UncertaintyDriven;
use crate::energy::EnergyModel;
use crate::settings::{
    Check, Extent, FixedSettings, PidSettings, Platform, SettingsError, Site, TriggerSettings,
    Vehicle, WakeUpSettings,
};

/// Energy of a wake-up before its first angle, in units of one estimate, for a platform without
/// values.
const UNKNOWN_WAKE_UP_COST: f64 = 0.5;

/// Name of the platform's minimum wake-up time in error messages.
const BASE: &str = "the base wake-up time";

/// Returns the wake-up policy of a vehicle at a site. Wake-up times without a value are those of
/// the platform.
///
/// # Errors
/// [`SettingsError`] if the platform lacks a required value.
pub fn built_in(
    site: &Site,
    vehicle: &Vehicle,
    platform: &Platform,
) -> Result<Box<dyn WakeUpPolicy>, SettingsError> {
    let interval_s = |explicit_ms: Option<f64>| match explicit_ms {
        Some(explicit_ms) => Ok(explicit_ms * 1e-3),
        None => platform.base_wake_up_s(vehicle),
    };
    let top_speed_mps = vehicle.top_speed_mps();
    let period_s = site.ssb.period_ms * 1e-3;
    let controlled = |settings: &PidSettings, place: &str| {
        let base_s = interval_s(settings.base_ms)?;
        let file = &vehicle.name;
        settings.check_t_max(base_s, BASE, top_speed_mps, place, Check { file })?;
        let controller = Controller::new(settings, base_s, top_speed_mps);
        let lead_s = settings.ssb_selection.lead_s(period_s);
        Ok(Due::controlled(controller, settings.sensing, lead_s))
    };
    let constant = |settings: &FixedSettings| {
        let lead_s = settings.ssb_selection.lead_s(period_s);
        Ok(Due::constant(interval_s(settings.interval_ms)?, lead_s))
    };
    Ok(match vehicle.wake_up_policy() {
        WakeUpSettings::Fixed(settings) => Box::new(FixedInterval::new(constant(&settings)?)),
        WakeUpSettings::Pid(settings) => {
            Box::new(Adaptive::new(controlled(&settings, "wake_up")?, None))
        }
        WakeUpSettings::Gated(settings) => {
            let (due, shortest_s) = match settings.trigger {
                TriggerSettings::Fixed(due) => (constant(&due)?, interval_s(due.interval_ms)?),
                TriggerSettings::Pid(due) => (
                    controlled(&due, "wake_up.trigger")?,
                    interval_s(due.base_ms)?,
                ),
            };
            let latest_s = match settings.t_max_ms {
                Some(t_max_ms) => {
                    let (file, base_ms) = (&vehicle.name, shortest_s * 1e3);
                    let allowed = format!("it must not be below {BASE}, {base_ms} ms");
                    let good = t_max_ms >= base_ms - 1e-9;
                    Check { file }.that(good, "wake_up.t_max_ms", t_max_ms, &allowed)?;
                    t_max_ms * 1e-3
                }
                None => f64::INFINITY,
            };
            let threshold = (settings.snr_set_point, latest_s);
            Box::new(Adaptive::new(due, Some(threshold)))
        }
        WakeUpSettings::Uncertainty(settings) => {
            let cost = wake_up_cost(vehicle, platform)?;
            Box::new(UncertaintyDriven::new(&settings, cost, site, vehicle))
        }
    })
}

/// Returns the vehicle with all defaults of the wake-up policy filled in.
///
/// # Errors
/// Those of [`built_in`].
pub fn resolve(vehicle: &Vehicle, platform: &Platform) -> Result<Vehicle, SettingsError> {
    let mut resolved = platform.resolve(vehicle)?;
    if let Some(pid) = (resolved.wake_up.as_mut()).and_then(WakeUpSettings::pid_mut) {
        pid.t_max_ms = Some(pid.t_max_s(vehicle.top_speed_mps()) * 1e3);
    }
    Ok(resolved)
}

/// Returns the energy of a wake-up before its first angle, in units of one estimate.
fn wake_up_cost(vehicle: &Vehicle, platform: &Platform) -> Result<f64, SettingsError> {
    let model = EnergyModel::new(vehicle, platform, Extent::Value)?;
    let known = model.and_then(|model| model.listening_in_aoa_estimates());
    Ok(known.unwrap_or(UNKNOWN_WAKE_UP_COST))
}
