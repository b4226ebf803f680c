//! The onboard computer: its power modes, how fast they estimate and what that costs.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::scenario::{
    Check, EstimatorMethod, PlatformSettings, Scenario, ScenarioError, WakeUpSettings, read,
};

/// Names and texts of the shipped platforms.
const SHIPPED: [(&str, &str); 1] = [(
    "jetson-agx-xavier",
    include_str!("../../../platforms/jetson-agx-xavier.toml"),
)];

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
    pub cpu_mhz: f64,
    /// CPU cores online.
    pub cores: u32,
    /// Memory clock in MHz; without it, the board's maximum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub memory_mhz: Option<f64>,
    /// CPU frequency in MHz as the paper prints it, where it differs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paper_cpu_mhz: Option<f64>,
    /// Shortest time between two estimates in ms, per method.
    #[serde(default)]
    pub base_wake_up_ms: BTreeMap<EstimatorMethod, f64>,
    /// Energy of one estimate in joules, per method.
    #[serde(default)]
    pub energy_per_execution_j: BTreeMap<EstimatorMethod, Figure>,
    /// Power of the whole board with all cores busy, in watts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_load_power_w: Option<Figure>,
}

impl Platform {
    /// Names of the shipped platforms.
    pub fn names() -> impl Iterator<Item = &'static str> + Clone {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// Loads a shipped platform by its name, or else a platform file by its path.
    ///
    /// # Errors
    /// [`ScenarioError`] when there is neither, or when what there is cannot be used.
    pub fn load(name_or_path: &str) -> Result<Self, ScenarioError> {
        read::load("platform", &SHIPPED, name_or_path, Self::from_toml)
    }

    /// Reads a platform from TOML; `origin` is the file that errors name.
    ///
    /// # Errors
    /// [`ScenarioError`] naming the key and what is allowed.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        Self::from_table(read::parse(text, origin)?, origin)
    }

    fn from_table(table: toml::Table, origin: &str) -> Result<Self, ScenarioError> {
        let platform: Self = read::settings(table, origin)?;
        platform.check(&Check { file: origin })?;
        Ok(platform)
    }

    /// This platform with single keys set, as [`Scenario::with_overrides`].
    ///
    /// # Errors
    /// [`ScenarioError`] as for a file.
    pub fn with_overrides<'a>(
        &self,
        overrides: impl IntoIterator<Item = (&'a str, Value)>,
    ) -> Result<Self, ScenarioError> {
        let origin = format!("{} with overrides", self.name);
        let table = read::overridden(&self.to_toml(), overrides, &origin)?;
        Self::from_table(table, &origin)
    }

    /// The platform as TOML with every default written out.
    pub fn to_toml(&self) -> String {
        // Finite numbers, strings and tables: all of them valid TOML.
        toml::to_string_pretty(self).unwrap_or_default()
    }

    /// The platform as JSON with every default written out.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// The JSON Schema of a platform file.
    pub fn schema_json() -> String {
        serde_json::to_string_pretty(&schemars::schema_for!(Self)).unwrap_or_default()
    }

    /// The mode that a scenario asks for.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] when the platform has no such mode.
    pub fn mode(
        &self,
        settings: &PlatformSettings,
        file: &str,
    ) -> Result<&PowerMode, ScenarioError> {
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

    /// Shortest time between estimates, in seconds, of the scenario's method in its mode.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] when the platform has no such mode, or no figure for the method.
    pub fn base_wake_up_s(&self, scenario: &Scenario) -> Result<f64, ScenarioError> {
        let mode = self.mode(&scenario.platform, &scenario.name)?;
        let method = scenario.estimator.method;
        mode.base_wake_up_ms
            .get(&method)
            .map(|base_ms| base_ms * 1e-3)
            .ok_or_else(|| {
                let known: Vec<String> = mode
                    .base_wake_up_ms
                    .keys()
                    .map(ToString::to_string)
                    .collect();
                let allowed = format!(
                    "mode {} of `{}` has a base wake-up time for {} only; set `wake_up.base_ms` or \
                 `wake_up.interval_ms`",
                    mode.mode,
                    self.name,
                    known.join(", ")
                );
                Check {
                    file: &scenario.name,
                }
                .error("estimator.method", method, &allowed)
            })
    }

    /// The scenario with the wake-up times written out that it leaves to the platform.
    ///
    /// # Errors
    /// As [`base_wake_up_s`](Self::base_wake_up_s).
    pub fn resolve(&self, scenario: &Scenario) -> Result<Scenario, ScenarioError> {
        let mut resolved = scenario.clone();
        let time_ms = match &mut resolved.wake_up {
            WakeUpSettings::Fixed(fixed) => &mut fixed.interval_ms,
            WakeUpSettings::Pid(pid) => &mut pid.base_ms,
            WakeUpSettings::Uncertainty(_) => return Ok(resolved),
        };
        if time_ms.is_none() {
            *time_ms = Some(self.base_wake_up_s(scenario)? * 1e3);
        }
        Ok(resolved)
    }

    fn check(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        check.that(
            !self.modes.is_empty(),
            "modes",
            "empty",
            "a platform needs at least one mode",
        )?;
        for (figure, key) in [
            (&self.idle.power_w, "idle"),
            (&self.receiver.power_w, "receiver"),
        ] {
            if let Some(figure) = figure {
                check.not_negative(&format!("{key}.power_w.value"), figure.value)?;
            }
        }
        check.not_negative("receiver.on_time_ms", self.receiver.on_time_ms)?;
        for (index, mode) in self.modes.iter().enumerate() {
            let key = format!("modes[{index}]");
            let twice = self
                .modes
                .iter()
                .take(index)
                .any(|other| other.mode == mode.mode);
            check.that(
                !twice,
                &format!("{key}.mode"),
                mode.mode,
                "each mode needs its own number",
            )?;
            check.positive(&format!("{key}.cpu_mhz"), mode.cpu_mhz)?;
            for (method, base_ms) in &mode.base_wake_up_ms {
                check.positive(&format!("{key}.base_wake_up_ms.{method}"), *base_ms)?;
            }
            for (method, figure) in &mode.energy_per_execution_j {
                let key = format!("{key}.energy_per_execution_j.{method}.value");
                check.not_negative(&key, figure.value)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn xavier_has_the_papers_modes() {
        let xavier = Platform::load("jetson-agx-xavier").unwrap();
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
            Platform::from_toml(&xavier.to_toml(), "again").unwrap(),
            xavier
        );
    }

    #[test]
    fn unknown_mode_or_method_says_what_there_is() {
        let xavier = Platform::load("jetson-agx-xavier").unwrap();
        let mut scenario = Scenario::load("paper").unwrap();
        scenario.platform.mode = 9;
        let message = xavier.base_wake_up_s(&scenario).unwrap_err().to_string();
        assert!(
            message.contains("platform.mode") && message.contains("0, 1, 2"),
            "{message}"
        );
        scenario.platform.mode = 0;
        scenario.estimator.method = EstimatorMethod::MaximumLikelihood;
        let message = xavier.base_wake_up_s(&scenario).unwrap_err().to_string();
        assert!(message.contains("root-music"), "{message}");
    }

    #[test]
    fn resolved_scenarios_state_the_platforms_wake_up_time() {
        let xavier = Platform::load("jetson-agx-xavier").unwrap();
        let mut scenario = Scenario::load("paper").unwrap();
        scenario.platform.mode = 1;
        let resolved = xavier.resolve(&scenario).unwrap();
        assert!(resolved.to_toml().contains("base_ms = 150.0"));
        assert_eq!(xavier.resolve(&resolved).unwrap(), resolved);
        let fixed = scenario
            .with_overrides([("wake_up.policy", "fixed".into())])
            .unwrap();
        let resolved = xavier.resolve(&fixed).unwrap().to_toml();
        assert!(resolved.contains("interval_ms = 150.0"));
        let yard = Scenario::load("yard").unwrap();
        assert_eq!(xavier.resolve(&yard).unwrap(), yard);
    }

    #[test]
    fn bad_figures_are_refused() {
        let xavier = Platform::load("jetson-agx-xavier").unwrap();
        let mode_0 = "modes[0].energy_per_execution_j.music.value";
        let error = xavier
            .with_overrides([(mode_0, Value::Float(-1.0))])
            .unwrap_err();
        assert!(error.to_string().contains(mode_0), "{error}");
        let error = xavier
            .with_overrides([("modes[0].cpu_ghz", Value::Float(1.0))])
            .unwrap_err();
        assert!(
            error.to_string().contains("did you mean `cpu_mhz`"),
            "{error}"
        );
    }
}
