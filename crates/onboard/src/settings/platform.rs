//! Onboard computer: power modes, speed of the estimators, and energy.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::error::SettingsError;
use super::figure::{Boundary, Extent, Figure, Quantity, check_ranges};
use super::power::{CpuSettings, IdleSettings, PowerMode, ReceiverPower, SuspendSettings};
use super::receiver::EstimatorMethod;
use super::toml_file::{TomlFile, TomlFormat};
use super::vehicle::{PlatformSettings, Vehicle};

/// Platform file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Platform {
    /// Short name.
    pub name: String,
    /// Description of the computer.
    #[serde(default)]
    pub description: String,
    /// Idle power, drawn at all times.
    #[serde(default)]
    pub idle: IdleSettings,
    /// Power of the radio receiver while it is on.
    #[serde(default)]
    pub receiver: ReceiverPower,
    /// Cost of a computation, for modes without a measured value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu: Option<CpuSettings>,
    /// Suspend state between wake-ups. Default: the board idles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub suspend: Option<SuspendSettings>,
    /// Efficiency of the power supply, from the wall socket to the supply rails. Default: power
    /// above idle counts as power at the wall socket.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supply_efficiency: Option<Quantity>,
    /// The power modes.
    #[schemars(length(min = 1, max = 1000))]
    pub modes: Vec<PowerMode>,
}

impl Platform {
    /// Returns the power mode that a vehicle selects.
    ///
    /// # Errors
    /// [`SettingsError::Value`] if the platform does not have this mode.
    pub fn mode(
        &self,
        settings: &PlatformSettings,
        file: &str,
    ) -> Result<&PowerMode, SettingsError> {
        self.modes
            .iter()
            .find(|mode| mode.mode == settings.mode)
            .ok_or_else(|| {
                let known: Vec<String> = self
                    .modes
                    .iter()
                    .map(|mode| mode.mode.to_string())
                    .collect();
                let allowed = format!("`{}` has the modes {}", self.name, known.join(", "));
                Check { file }.error("platform.mode", settings.mode, &allowed)
            })
    }

    /// Returns the idle power of a mode.
    pub fn idle_power_w<'a>(&'a self, mode: &'a PowerMode) -> Option<&'a Figure> {
        mode.idle_power_w.as_ref().or(self.idle.power_w.as_ref())
    }

    /// Returns the power of one busy core above idle in a mode, with its boundary and source.
    pub fn core_power_w<'a>(
        &'a self,
        mode: &'a PowerMode,
        extent: Extent,
    ) -> Option<(f64, &'a Figure)> {
        if let Some(stated) = &mode.core_power_w {
            return Some((stated.at(extent), stated));
        }
        let core = self.cpu.as_ref()?.core.as_ref()?;
        Some((core.at(mode.cpu_mhz, extent), &core.power_w))
    }

    /// Returns the board's power in a mode with `cores` busy cores: idle power plus that of each
    /// core.
    pub fn busy_power_w(&self, mode: &PowerMode, cores: u32) -> Option<f64> {
        let (core_w, _) = self.core_power_w(mode, Extent::Value)?;
        Some(self.idle_power_w(mode)?.value + f64::from(cores) * core_w)
    }

    /// Returns the boundary of a sum of power values. A value above idle can be added to any other;
    /// two values that both contain the idle board would count it twice.
    ///
    /// # Errors
    /// [`SettingsError::Value`] if two values contain the idle board.
    pub fn boundary_of_sum(
        &self,
        parts: impl IntoIterator<Item = Option<Boundary>>,
    ) -> Result<Boundary, SettingsError> {
        let all = parts.into_iter().flatten();
        let mut whole = all.filter(|boundary| *boundary != Boundary::Marginal);
        let first = whole.next();
        if let (Some(first), Some(second)) = (first, whole.next()) {
            let allowed = format!(
                "the idle power of the board would be counted twice: a figure of boundary \
                 `{first}` and one of boundary `{second}` contain it; count one of them, or give \
                 the other above idle (boundary `marginal`)"
            );
            let file = &self.name;
            return Err(Check { file }.error("idle.counted", self.idle.counted, &allowed));
        }
        Ok(first.unwrap_or(Boundary::Marginal))
    }

    /// Returns the minimum time between two estimates, for the vehicle's method in its power mode,
    /// in seconds.
    ///
    /// # Errors
    /// [`SettingsError::Value`] if the platform does not have this mode, or no value for the
    /// method.
    pub fn base_wake_up_s(&self, vehicle: &Vehicle) -> Result<f64, SettingsError> {
        let mode = self.mode(&vehicle.platform, &vehicle.name)?;
        let method = vehicle.estimator.method;
        let stated_s = mode.base_wake_up_ms.get(&method).map(|ms| ms * 1e-3);
        let derived_s = || {
            let cpu = self.cpu.as_ref()?;
            let cycles = cpu.cycles_per_burst.value + cpu.cycles_per_execution.get(&method)?.value;
            Some(cycles / (mode.cpu_mhz * 1e6))
        };
        stated_s.or_else(derived_s).ok_or_else(|| {
            let cycles = self
                .cpu
                .iter()
                .flat_map(|cpu| cpu.cycles_per_execution.keys());
            let known: BTreeSet<&EstimatorMethod> =
                mode.base_wake_up_ms.keys().chain(cycles).collect();
            let known: Vec<String> = known.iter().map(ToString::to_string).collect();
            let allowed = format!(
                "mode {} of `{}` has the base wake-up time (duration of one estimate) only for \
                 {}; choose one of these methods, or set `{}`",
                mode.mode,
                self.name,
                known.join(", "),
                vehicle.wake_up_policy().base_key(),
            );
            let file = &vehicle.name;
            Check { file }.error("estimator.method", method, &allowed)
        })
    }

    /// Returns the vehicle with all defaults filled in: wake-up times from the platform, wake-up
    /// policy and integrity monitoring from the localizer.
    ///
    /// # Errors
    /// Those of [`base_wake_up_s`](Self::base_wake_up_s).
    pub fn resolve(&self, vehicle: &Vehicle) -> Result<Vehicle, SettingsError> {
        let mut resolved = vehicle.clone();
        let mut wake_up = vehicle.wake_up_policy();
        if let Some(time_ms @ None) = wake_up.base_ms() {
            *time_ms = Some(self.base_wake_up_s(vehicle)? * 1e3);
        }
        resolved.wake_up = Some(wake_up);
        resolved.integrity = vehicle.integrity_monitor().or(vehicle.integrity);
        Ok(resolved)
    }
}

impl TomlFile for Platform {
    const WHAT: &'static str = "platform";
    const SHIPPED: &'static [(&'static str, &'static str)] = &[
        (
            "generic-x86",
            include_str!("../../../../platforms/generic-x86.toml"),
        ),
        (
            "jetson-agx-orin",
            include_str!("../../../../platforms/jetson-agx-orin.toml"),
        ),
        (
            "jetson-agx-xavier",
            include_str!("../../../../platforms/jetson-agx-xavier.toml"),
        ),
        (
            "jetson-agx-xavier-engine",
            include_str!("../../../../platforms/jetson-agx-xavier-engine.toml"),
        ),
        (
            "raspberry-pi-5",
            include_str!("../../../../platforms/raspberry-pi-5.toml"),
        ),
    ];

    fn format() -> &'static TomlFormat<Self> {
        static FORMAT: TomlFormat<Platform> = TomlFormat::new();
        &FORMAT
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        for (index, mode) in self.modes.iter().enumerate() {
            let mut before = self.modes.iter().take(index);
            check.that(
                before.all(|other| other.mode != mode.mode),
                &format!("modes[{index}].mode"),
                mode.mode,
                "each mode needs its own number",
            )?;
        }
        let written = serde_json::to_value(self).unwrap_or_default();
        check_ranges(&written, "", check)
    }
}

#[cfg(test)]
mod tests {
    use toml::Value;

    use super::*;
    use crate::settings::{IntegritySettings, Shipped};

    fn xavier() -> Platform {
        Platform::from_library("jetson-agx-xavier", &Shipped).unwrap()
    }

    fn vehicle(name: &str) -> Vehicle {
        Vehicle::from_library(name, &Shipped).unwrap()
    }

    #[test]
    fn the_xavier_platform_has_the_modes_of_the_paper() {
        let xavier = xavier();
        let base_ms: Vec<f64> = xavier
            .modes
            .iter()
            .map(|mode| mode.base_wake_up_ms[&EstimatorMethod::Music])
            .collect();
        assert_eq!(
            base_ms,
            [80.0, 150.0, 150.0, 150.0, 120.0, 100.0, 100.0, 100.0]
        );
        assert_eq!(
            Platform::from_toml(&xavier.to_toml(), "again", &Shipped).unwrap(),
            xavier
        );
    }

    #[test]
    fn busy_board_power_equals_the_wall_measurement() {
        let engine = Platform::from_library("jetson-agx-xavier-engine", &Shipped).unwrap();
        let mut compared = 0;
        for mode in &engine.modes {
            if let Some(measured) = &mode.full_load_power_w {
                let modelled_w = engine.busy_power_w(mode, mode.cores).unwrap();
                assert!(
                    (modelled_w / measured.value - 1.0).abs() < 0.1,
                    "{}",
                    mode.name
                );
                compared += 1;
            }
        }
        assert_eq!(compared, 5);
    }

    #[test]
    fn ranges_contain_their_values() {
        for name in Platform::names() {
            Platform::from_library(name, &Shipped).unwrap();
        }
        let high = "receiver.settling_ms.high";
        let error = xavier()
            .with_overrides([(high, Value::Float(2.0))], &Shipped)
            .unwrap_err();
        assert!(
            error.to_string().contains("receiver.settling_ms.value"),
            "{error}"
        );
    }

    #[test]
    fn an_unknown_mode_or_method_lists_the_known_ones() {
        let xavier = xavier();
        let mut vehicle = vehicle("paper");
        vehicle.platform.mode = 9;
        let message = xavier.base_wake_up_s(&vehicle).unwrap_err().to_string();
        assert!(
            message.contains("platform.mode") && message.contains("0, 1, 2"),
            "{message}"
        );
        vehicle.platform.mode = 0;
        vehicle.estimator.method = EstimatorMethod::MaximumLikelihood;
        let message = xavier.base_wake_up_s(&vehicle).unwrap_err().to_string();
        assert!(message.contains("root-music"), "{message}");
        assert!(message.contains("`wake_up.trigger.base_ms`"), "{message}");
    }

    #[test]
    fn resolved_vehicles_state_the_platforms_wake_up_time() {
        let xavier = xavier();
        let mut paper = vehicle("paper");
        paper.platform.mode = 1;
        let resolved = xavier.resolve(&paper).unwrap();
        assert!(resolved.to_toml().contains("base_ms = 150.0"));
        assert_eq!(xavier.resolve(&resolved).unwrap(), resolved);
        let fixed = paper
            .with_overrides([("wake_up.policy", "fixed".into())], &Shipped)
            .unwrap();
        let resolved = xavier.resolve(&fixed).unwrap().to_toml();
        assert!(resolved.contains("interval_ms = 150.0"));
        let mut tugger = vehicle("tugger");
        let resolved = xavier.resolve(&tugger).unwrap();
        tugger.integrity = Some(IntegritySettings::default());
        assert_eq!(resolved, tugger);
        tugger.integrity = Some(IntegritySettings::off());
        assert_eq!(xavier.resolve(&tugger).unwrap(), tugger);
    }

    #[test]
    fn invalid_figures_are_rejected() {
        let xavier = xavier();
        let mode_0 = "modes[0].energy_per_execution_j.music.value";
        let error = xavier
            .with_overrides([(mode_0, Value::Float(-1.0))], &Shipped)
            .unwrap_err();
        assert!(error.to_string().contains(mode_0), "{error}");
        let error = xavier
            .with_overrides([("modes[0].cpu_ghz", Value::Float(1.0))], &Shipped)
            .unwrap_err();
        assert!(
            error.to_string().contains("did you mean `cpu_mhz`"),
            "{error}"
        );
    }
}
