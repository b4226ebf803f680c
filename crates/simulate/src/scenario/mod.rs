//! The one schema of a scenario: TOML for people, with human units named in each key.
//!
//! The types here mirror the file. Everything that computes takes the SI values their methods give.
//! Every key but the road's shape and the radio heads has a default, and [`Scenario::to_toml`]
//! writes all of them out.

mod channel;
mod check;
mod error;
mod faults;
mod iq;
mod localization;
mod radio;
pub(crate) mod read;
mod road;
mod shipped;
mod track_file;
mod tracker;
mod wake_up;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::world::Track;

pub use channel::{ChannelSettings, ScatterModel};
pub(crate) use check::Check;
pub use error::ScenarioError;
pub use faults::{FaultKind, FaultSettings};
pub use iq::IqSettings;
pub use localization::{
    DeadReckoningSettings, EstimatorMethod, EstimatorSettings, GyroSettings, HeadingBetween,
    LocalizerSettings, OdometerSettings, StartSettings,
};
pub use radio::{ArraySettings, Pilots, RadioHeadSettings, ReceiverSettings, SsbSettings};
pub use road::{MotionSettings, SegmentSettings, StopSettings, TrackSettings, WanderSettings};
pub use tracker::TrackerSettings;
pub use wake_up::{
    FixedSettings, PidSettings, SensingMode, SnrSetPoint, UncertaintySettings, WakeUpSettings,
};

/// Everything a simulated drive depends on, besides the seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name; also the name of its results.
    pub name: String,
    /// What the scenario is for.
    #[serde(default)]
    pub description: String,
    /// How much of the radio is simulated.
    #[serde(default)]
    pub fidelity: Fidelity,
    /// The road.
    pub track: TrackSettings,
    /// How the vehicle drives on it.
    #[serde(default)]
    pub motion: MotionSettings,
    /// The radio heads; at least one.
    pub radio_heads: Vec<RadioHeadSettings>,
    /// The SSBs they send.
    #[serde(default)]
    pub ssb: SsbSettings,
    /// The vehicle's antennas.
    #[serde(default)]
    pub array: ArraySettings,
    /// The vehicle's receiver.
    #[serde(default)]
    pub receiver: ReceiverSettings,
    /// What happens to the signal in between.
    #[serde(default)]
    pub channel: ChannelSettings,
    /// What the receiver's hardware does to the samples, where they are simulated.
    #[serde(default)]
    pub iq: IqSettings,
    /// The vehicle's odometer.
    #[serde(default)]
    pub odometer: OdometerSettings,
    /// How well the initial pose is known.
    #[serde(default)]
    pub start: StartSettings,
    /// How an angle is estimated.
    #[serde(default)]
    pub estimator: EstimatorSettings,
    /// How angles and odometry become a pose.
    #[serde(default)]
    pub localizer: LocalizerSettings,
    /// When an angle is estimated.
    #[serde(default)]
    pub wake_up: WakeUpSettings,
    /// What goes wrong on the way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<FaultSettings>,
    /// On which computer.
    #[serde(default)]
    pub platform: PlatformSettings,
}

/// How much of the radio is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Fidelity {
    /// Array snapshots drawn from the channel, as in the paper.
    #[default]
    Snapshots,
    /// Samples of every SSB at every antenna, received as a recording is (`[iq]`).
    Iq,
}

/// The onboard computer and its power mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlatformSettings {
    /// A shipped platform's name, or the path of a platform file.
    pub name: String,
    /// Power mode by its number in the platform file.
    pub mode: u32,
}

impl Default for PlatformSettings {
    fn default() -> Self {
        Self {
            name: "jetson-agx-xavier".to_owned(),
            mode: 0,
        }
    }
}

impl Scenario {
    /// Names of the shipped scenarios.
    pub fn names() -> impl Iterator<Item = &'static str> + Clone {
        shipped::SCENARIOS.iter().map(|(name, _)| *name)
    }

    /// Loads a shipped scenario by its name, or else a scenario file by its path.
    ///
    /// # Errors
    /// [`ScenarioError`] when there is neither, or when what there is cannot be used.
    pub fn load(name_or_path: &str) -> Result<Self, ScenarioError> {
        read::load(
            "scenario",
            &shipped::SCENARIOS,
            name_or_path,
            Self::from_toml,
        )
    }

    /// Reads a scenario from TOML. `origin` is the file that errors name, and against whose place
    /// `track.file` is resolved.
    ///
    /// # Errors
    /// [`ScenarioError`] naming the key and what is allowed.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ScenarioError> {
        Self::from_table(read::parse(text, origin)?, origin)
    }

    pub(crate) fn from_table(table: toml::Table, origin: &str) -> Result<Self, ScenarioError> {
        let mut scenario: Self = read::settings(table, origin)?;
        scenario.track.take_over_file(origin)?;
        scenario.check(origin)?;
        Ok(scenario)
    }

    /// This scenario with single keys set: `("channel.rician_k_db", 10.0)`,
    /// `("radio_heads[0].tx_power_dbm", 0.0)`. Setting a table replaces it whole; setting a tag
    /// (`wake_up.policy`, `localizer.kind`) to another variant drops the old one's keys, so tags
    /// come before the keys that go with them.
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

    /// The scenario as TOML with every default written out.
    pub fn to_toml(&self) -> String {
        // A checked scenario holds finite numbers, strings and tables: all of them valid TOML.
        toml::to_string_pretty(self).unwrap_or_default()
    }

    /// The scenario as JSON with every default written out.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// The JSON Schema of a scenario file.
    pub fn schema_json() -> String {
        serde_json::to_string_pretty(&schemars::schema_for!(Self)).unwrap_or_default()
    }

    /// The road.
    ///
    /// # Errors
    /// [`ScenarioError`] when the scenario has been changed by hand into an impossible one; never
    /// after loading.
    pub fn build_track(&self) -> Result<Track, ScenarioError> {
        self.track.build(&self.name)
    }
}
