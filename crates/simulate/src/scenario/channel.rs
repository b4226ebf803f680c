//! What happens to the signal between radio head and vehicle. The Rician K is the site's.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[channel]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ChannelSettings {
    /// Standard deviation of the log-normal shadowing in dB.
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
}

impl Default for ChannelSettings {
    fn default() -> Self {
        Self {
            shadowing_std_db: 3.0,
            shadowing_correlation_m: 0.0,
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
