//! What happens to the signal between radio head and vehicle.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[channel]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ChannelSettings {
    /// Standard deviation of the log-normal shadowing in dB.
    pub shadowing_std_db: f64,
    /// Distance over which shadowing decorrelates, in metres; 0 draws it afresh for every SSB.
    pub shadowing_correlation_m: f64,
    /// Rician K: power of the line of sight over that of the scatter, in dB.
    pub rician_k_db: f64,
    /// How the scatter reaches the antennas.
    pub scatter: ScatterModel,
    /// Number of scattered rays, at each antenna or at all together.
    pub rays: u16,
    /// Root-mean-square delay spread of the scatter in nanoseconds: its power decays exponentially
    /// with this time constant from the line of sight on; 0 delays none of it. With
    /// `fidelity = "iq"` only; the standard deviation of each angle then tells of the scatter too.
    pub delay_spread_ns: f64,
}

impl Default for ChannelSettings {
    fn default() -> Self {
        Self {
            shadowing_std_db: 3.0,
            shadowing_correlation_m: 0.0,
            rician_k_db: 20.0,
            scatter: ScatterModel::PerAntenna,
            rays: 8,
            delay_spread_ns: 0.0,
        }
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
