//! What happens to the signal between radio head and vehicle.

use onboard::settings::{Check, SettingsError};
use schemars::JsonSchema;
use serde::de::value::{Error as Unknown, StrDeserializer};
use serde::{Deserialize, Serialize};

/// `[channel]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ChannelSettings {
    /// Where the channel is from.
    pub model: ChannelModel,
    /// File of traced paths of the model `paths` (npz), counted from the scenario's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paths: Option<String>,
    /// Standard deviation of the log-normal shadowing in dB. This and what follows but `blockage`
    /// and `hall` are of the model `rician`.
    #[schemars(range(min = 0.0, max = 40.0))]
    pub shadowing_std_db: f64,
    /// Distance over which shadowing decorrelates, in metres; 0 draws it afresh for every SSB.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub shadowing_correlation_m: f64,
    /// How the scatter reaches the antennas.
    pub scatter: ScatterModel,
    /// Number of scattered rays, at each antenna or at all together.
    #[schemars(range(min = 1, max = 64))]
    pub rays: u16,
    /// Root-mean-square delay spread of the scatter in nanoseconds: its power decays exponentially
    /// with this time constant from the line of sight on; 0 delays none of it. With
    /// `fidelity = "iq"` only; the standard deviation of each angle then tells of the scatter too.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub delay_spread_ns: f64,
    /// Whether radio heads are heard only where they have a line of sight, with the models of TR
    /// 38.901: what is left of the error when a vehicle is told which angles to leave out.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub line_of_sight_only: bool,
    /// What stands in the line of sight and moves on; nothing does by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blockage: Option<BlockageSettings>,
    /// The hall of a factory model; that of the model's calibration by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hall: Option<HallSettings>,
}

impl Default for ChannelSettings {
    fn default() -> Self {
        Self {
            model: ChannelModel::Rician,
            paths: None,
            shadowing_std_db: 3.0,
            shadowing_correlation_m: 0.0,
            scatter: ScatterModel::PerAntenna,
            rays: 8,
            delay_spread_ns: 0.0,
            line_of_sight_only: false,
            blockage: None,
            hall: None,
        }
    }
}

/// Where the channel is from: the site's Rician K; the statistics of 3GPP TR 38.901, which draw line
/// of sight, K, path loss, spreads, delays and angles for each radio head along the way; or paths
/// that a ray tracer has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelModel {
    /// A line of sight and scatter from all sides, of the site's K.
    #[default]
    Rician,
    /// A street canyon (UMi).
    Umi,
    /// An indoor factory (InF) with sparse clutter, radio heads among it.
    InfSl,
    /// With dense clutter, radio heads among it.
    InfDl,
    /// With sparse clutter, radio heads above it.
    InfSh,
    /// With dense clutter, radio heads above it.
    InfDh,
    /// Traced paths, of the file `paths`.
    Paths,
}

impl ChannelModel {
    /// The model of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::deserialize(StrDeserializer::<Unknown>::new(name)).ok()
    }
}

/// How scatter reaches the antennas. Either way it stands still during an SSB and decorrelates
/// over about half a wavelength travelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ScatterModel {
    /// Independent at each antenna: scatterers close by and all around.
    #[default]
    PerAntenna,
    /// The same plane waves at all antennas, from uniformly drawn directions.
    Rays,
}

/// `[channel.blockage]`: other vehicles and people in the line of sight of each radio head, at
/// random times.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlockageSettings {
    /// How many stop the line of sight in a minute, on average.
    #[schemars(range(min = 0.0, max = 600.0))]
    pub per_minute: f64,
    /// How long each does, on average, in seconds.
    #[serde(default = "a_vehicle_passing")]
    #[schemars(range(min = 0.01, max = 3600.0))]
    pub duration_s: f64,
    /// By how many dB.
    #[serde(default = "a_vehicles_loss")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub loss_db: f64,
}

const fn a_vehicle_passing() -> f64 {
    2.0
}

const fn a_vehicles_loss() -> f64 {
    20.0
}

/// `[channel.hall]` of the factory models (TR 38.901, tables 7.2-4 and 7.4.2-1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HallSettings {
    /// Length, width and height in metres.
    pub size_m: [f64; 3],
    /// Share of the floor that clutter covers.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub clutter_density: f64,
    /// Its typical size in metres.
    #[schemars(range(min = 0.1, max = 100.0))]
    pub clutter_size_m: f64,
    /// Its height in metres; of heads above it only.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub clutter_height_m: f64,
}

impl ChannelSettings {
    /// Refuses what the model has no place for.
    ///
    /// # Errors
    /// [`SettingsError::Value`].
    pub fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        use ChannelModel::{Paths, Rician, Umi};
        let factory = !matches!(self.model, Rician | Umi | Paths);
        check.that(
            self.paths.is_some() == (self.model == Paths),
            "channel.paths",
            if self.paths.is_some() {
                "given"
            } else {
                "missing"
            },
            "it goes with `model = \"paths\"`, and that with it",
        )?;
        if let Some(hall) = self.hall {
            let key = "channel.hall";
            check.that(factory, key, "given", "only an InF `model` has a hall")?;
            let roomy = (hall.size_m.iter()).all(|side_m| (1.0..=1e4).contains(side_m));
            check.that(
                roomy,
                "channel.hall.size_m",
                format!("{:?}", hall.size_m),
                "each side must be between 1 and 10000",
            )?;
        }
        check.that(
            factory || self.model == Umi || !self.line_of_sight_only,
            "channel.line_of_sight_only",
            "true",
            "only a `model` of TR 38.901 draws lines of sight",
        )?;
        let mine = Self {
            model: self.model,
            line_of_sight_only: self.line_of_sight_only,
            paths: self.paths.clone(),
            blockage: self.blockage,
            hall: self.hall,
            ..Self::default()
        };
        check.that(
            self.model == Rician || *self == mine,
            "channel.model",
            "not `rician`",
            "others have their own shadowing, scatter, rays and delays; leave those keys out",
        )
    }
}
