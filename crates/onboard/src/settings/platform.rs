//! The onboard computer: its power modes, how fast they estimate and what that costs.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::error::SettingsError;
use super::receiver::EstimatorMethod;
use super::toml_file::TomlFile;
use super::vehicle::{PlatformSettings, Vehicle};

/// A platform file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Platform {
    /// Short name.
    pub name: String,
    /// What the computer is.
    #[serde(default)]
    pub description: String,
    /// Power drawn whether or not anything is estimated.
    #[serde(default)]
    pub idle: IdleSettings,
    /// Power drawn by the radio receiver while it listens.
    #[serde(default)]
    pub receiver: ReceiverPower,
    /// The power modes.
    #[schemars(length(min = 1, max = 1000))]
    pub modes: Vec<PowerMode>,
}

/// `[idle]`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IdleSettings {
    /// Whether idle power counts as part of a run's energy.
    pub counted: bool,
    /// Idle power in watts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_w: Option<Figure>,
}

/// `[receiver]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverPower {
    /// Whether the receiver's power counts as part of a run's energy.
    pub counted: bool,
    /// How long it is on for one SSB burst, in ms.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub on_time_ms: f64,
    /// Its power in watts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_w: Option<Figure>,
}

impl Default for ReceiverPower {
    fn default() -> Self {
        Self {
            counted: false,
            on_time_ms: 5.0,
            power_w: None,
        }
    }
}

/// A number and where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// The number, in the unit its key names.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub value: f64,
    /// How it came about.
    pub provenance: Provenance,
    /// Document, data set or fit it is taken from.
    pub source: String,
    /// What is counted in it.
    pub boundary: Boundary,
}

/// How a number came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Provenance {
    /// With an instrument.
    Measured,
    /// Chosen so that a model meets published totals.
    Fitted,
    /// From the maker's documents.
    Datasheet,
    /// Somebody's judgement.
    Assumed,
}

/// What a power or energy figure counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Boundary {
    /// What is drawn above idle.
    Marginal,
    /// The rails of the system on chip.
    SocRails,
    /// The wall socket.
    Wall,
    /// The source does not say.
    Unstated,
}

/// `[[modes]]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerMode {
    /// Its number.
    pub mode: u32,
    /// Its name in the maker's configuration.
    pub name: String,
    /// CPU frequency in MHz.
    #[schemars(range(min = 1.0, max = 1e5))]
    pub cpu_mhz: f64,
    /// CPU cores online.
    #[schemars(range(min = 1, max = 4096))]
    pub cores: u32,
    /// Memory clock in MHz; without it, the board's maximum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub memory_mhz: Option<f64>,
    /// CPU frequency in MHz as the paper prints it, where it differs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paper_cpu_mhz: Option<f64>,
    /// Shortest time between two estimates in ms, per method.
    #[serde(default)]
    #[schemars(inner(range(min = 1e-3, max = 3.6e6)))]
    pub base_wake_up_ms: BTreeMap<EstimatorMethod, f64>,
    /// Energy of one estimate in joules, per method.
    #[serde(default)]
    pub energy_per_execution_j: BTreeMap<EstimatorMethod, Figure>,
    /// Power of the whole board with all cores busy, in watts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_load_power_w: Option<Figure>,
}

impl Platform {
    /// The mode that a vehicle asks for.
    ///
    /// # Errors
    /// [`SettingsError::Value`] when the platform has no such mode.
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

    /// Shortest time between estimates, in seconds, of the vehicle's method in its mode.
    ///
    /// # Errors
    /// [`SettingsError::Value`] when the platform has no such mode, or no figure for the method.
    pub fn base_wake_up_s(&self, vehicle: &Vehicle) -> Result<f64, SettingsError> {
        let mode = self.mode(&vehicle.platform, &vehicle.name)?;
        let method = vehicle.estimator.method;
        let base_ms = mode.base_wake_up_ms.get(&method);
        base_ms.map(|base_ms| base_ms * 1e-3).ok_or_else(|| {
            let known = mode.base_wake_up_ms.keys();
            let known: Vec<String> = known.map(ToString::to_string).collect();
            let allowed = format!(
                "mode {} of `{}` has a base wake-up time for {} only; set `wake_up.base_ms` or \
                 `wake_up.interval_ms`",
                mode.mode,
                self.name,
                known.join(", ")
            );
            let file = &vehicle.name;
            Check { file }.error("estimator.method", method, &allowed)
        })
    }

    /// The vehicle with the wake-up times written out that it leaves to the platform.
    ///
    /// # Errors
    /// As [`base_wake_up_s`](Self::base_wake_up_s).
    pub fn resolve(&self, vehicle: &Vehicle) -> Result<Vehicle, SettingsError> {
        let mut resolved = vehicle.clone();
        if let Some(time_ms @ None) = resolved.wake_up.base_ms() {
            *time_ms = Some(self.base_wake_up_s(vehicle)? * 1e3);
        }
        Ok(resolved)
    }
}

impl TomlFile for Platform {
    const WHAT: &'static str = "platform";
    const SHIPPED: &'static [(&'static str, &'static str)] = &[(
        "jetson-agx-xavier",
        include_str!("../../../../platforms/jetson-agx-xavier.toml"),
    )];

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
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use toml::Value;

    use super::*;
    use crate::settings::Shipped;

    fn xavier() -> Platform {
        Platform::from_library("jetson-agx-xavier", &Shipped).unwrap()
    }

    fn vehicle(name: &str) -> Vehicle {
        Vehicle::from_library(name, &Shipped).unwrap()
    }

    #[test]
    fn xavier_has_the_papers_modes() {
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
    fn unknown_mode_or_method_says_what_there_is() {
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
        let tugger = vehicle("tugger");
        assert_eq!(xavier.resolve(&tugger).unwrap(), tugger);
    }

    #[test]
    fn bad_figures_are_refused() {
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
