//! Channel between radio head and vehicle.

use onboard::settings::{Check, SettingsError};
use schemars::JsonSchema;
use serde::de::value::{Error as Unknown, StrDeserializer};
use serde::{Deserialize, Serialize};

/// `[channel]`: radio channel between the radio heads and the vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ChannelSettings {
    /// Channel model.
    pub model: ChannelModel,
    /// File of ray-traced paths (npz) for the model `paths`, relative to the scenario file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paths: Option<String>,
    /// Standard deviation of the log-normal shadowing in dB. All following keys except
    /// `oracle_nlos_rejection`, `blockage` and `hall` apply to the model `rician` only.
    #[schemars(range(min = 0.0, max = 40.0))]
    pub shadowing_std_db: f64,
    /// Correlation distance of the shadowing in metres; 0 draws independent shadowing for every
    /// SSB.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub shadowing_correlation_m: f64,
    /// Correlation of the scatter between the antennas.
    pub scatter: ScatterModel,
    /// Number of scattered rays, per antenna (`per-antenna`) or in total (`rays`).
    #[schemars(range(min = 1, max = 64))]
    pub rays: u16,
    /// RMS delay spread of the scatter in nanoseconds, for an exponentially decaying power delay
    /// profile; 0 disables the delays. Requires `fidelity = "iq"`. The standard deviation of each
    /// angle then includes the scatter.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub delay_spread_ns: f64,
    /// Whether SSBs without a line of sight are removed (models of TR 38.901 only). The result is
    /// the error of a vehicle that knows which angles have no line of sight.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub oracle_nlos_rejection: bool,
    /// Moving objects that block the line of sight [default: none].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blockage: Option<BlockageSettings>,
    /// Hall of a factory model [default: the hall of the model's calibration].
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
            oracle_nlos_rejection: false,
            blockage: None,
            hall: None,
        }
    }
}

/// Channel model: Rician fading with the K factor of the site, a statistical model of 3GPP TR
/// 38.901, or ray-traced paths. The models of TR 38.901 draw line of sight, K factor, path loss,
/// delays and angles along the road for each radio head.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelModel {
    /// Line of sight and isotropic scatter with the K factor of the site.
    #[default]
    Rician,
    /// Street canyon (UMi).
    Umi,
    /// Indoor factory (InF) with sparse clutter and radio heads below the clutter height.
    InfSl,
    /// Indoor factory with dense clutter and radio heads below the clutter height.
    InfDl,
    /// Indoor factory with sparse clutter and radio heads above the clutter.
    InfSh,
    /// Indoor factory with dense clutter and radio heads above the clutter.
    InfDh,
    /// Ray-traced paths from the file `paths`.
    Paths,
}

impl ChannelModel {
    /// Returns the model with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::deserialize(StrDeserializer::<Unknown>::new(name)).ok()
    }
}

/// Correlation of the scatter between the antennas. Scatter is constant during an SSB and
/// decorrelates over about half a wavelength of driven distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ScatterModel {
    /// Independent at each antenna: many scatterers close to the vehicle.
    #[default]
    PerAntenna,
    /// Equal plane waves at all antennas, with uniformly drawn directions.
    Rays,
}

/// `[channel.blockage]`: vehicles and people that block the line of sight of each radio head at
/// random times.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlockageSettings {
    /// Mean number of blockages per minute and radio head.
    #[schemars(range(min = 0.0, max = 600.0))]
    pub per_minute: f64,
    /// Mean duration of a blockage in seconds.
    #[serde(default = "a_vehicle_passing")]
    #[schemars(range(min = 0.01, max = 3600.0))]
    pub duration_s: f64,
    /// Attenuation of the line of sight during a blockage in dB.
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

/// `[channel.hall]`: hall of a factory model (TR 38.901, tables 7.2-4 and 7.4.2-1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HallSettings {
    /// Length, width and height in metres.
    pub size_m: [f64; 3],
    /// Fraction of the floor that is covered by clutter.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub clutter_density: f64,
    /// Typical size of the clutter in metres.
    #[schemars(range(min = 0.1, max = 100.0))]
    pub clutter_size_m: f64,
    /// Height of the clutter in metres; used for radio heads above the clutter only.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub clutter_height_m: f64,
}

impl ChannelSettings {
    /// Checks the keys against the model.
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
            "`paths` is required with `model = \"paths\"` and allowed with no other model",
        )?;
        if let Some(hall) = self.hall {
            let key = "channel.hall";
            check.that(factory, key, "given", "allowed with an InF `model` only")?;
            let is_plausible = (hall.size_m.iter()).all(|side_m| (1.0..=1e4).contains(side_m));
            check.that(
                is_plausible,
                "channel.hall.size_m",
                format!("{:?}", hall.size_m),
                "each side must be between 1 and 10000",
            )?;
        }
        check.that(
            factory || self.model == Umi || !self.oracle_nlos_rejection,
            "channel.oracle_nlos_rejection",
            "true",
            "allowed with a `model` of TR 38.901 only",
        )?;
        let mine = Self {
            model: self.model,
            oracle_nlos_rejection: self.oracle_nlos_rejection,
            paths: self.paths.clone(),
            blockage: self.blockage,
            hall: self.hall,
            ..Self::default()
        };
        check.that(
            self.model == Rician || *self == mine,
            "channel.model",
            "not `rician`",
            "this model defines shadowing, scatter, rays and delays; remove these keys",
        )
    }
}
