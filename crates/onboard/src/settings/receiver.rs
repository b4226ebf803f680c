//! The vehicle's receiver, and how it estimates an angle.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[receiver]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverSettings {
    /// Noise figure in dB.
    #[schemars(range(min = 0.0, max = 60.0))]
    pub noise_figure_db: f64,
    /// Noise temperature in kelvin.
    #[schemars(range(min = 1.0, max = 10_000.0))]
    pub temperature_k: f64,
    /// Bandwidth of one snapshot in MHz.
    #[schemars(range(min = 1e-3, max = 2000.0))]
    pub bandwidth_mhz: f64,
    /// What the receiver knows of the transmitted signal.
    pub pilots: Pilots,
    /// Snapshots of each SSB where `pilots` is "blind".
    #[schemars(range(min = 1, max = 64))]
    pub snapshots: u16,
    /// Standard deviation of the sensed SNR in dB.
    #[schemars(range(min = 0.0, max = 40.0))]
    pub snr_noise_db: f64,
    /// How much older than its time stamp an angle is, in seconds.
    #[schemars(range(min = -1.0, max = 0.4))]
    pub lateness_s: f64,
    /// Standard deviation of that, within which it is found while driving, in seconds; without, 0
    /// on a road and 0.1 s for a differential drive, and of recorded drives it is found beforehand,
    /// up to 1.5 s. 0 says that the clocks are one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 0.5))]
    pub lateness_std_s: Option<f64>,
    /// Standard deviation of the error of the electrical angle that stays from look to look, in
    /// radians.
    #[schemars(range(min = 0.0, max = 3.2))]
    pub phase_bias_std_rad: f64,
    /// Largest share of an angle's stated variance that stays so; how much does is found while driving.
    /// 0.25 for logged angles where it is not stated, and 0 for the receiver's own, whose deviation
    /// is that of thermal noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub phase_bias_share: Option<f64>,
    /// Prior probability that the angles of a radio head have a time-correlated bias, as reflections cause it. Every
    /// filter of the localizer then estimates the bias of each radio head; 0 estimates none. Default: 0.75 on a road
    /// vehicle, 0 on a differential drive, without integrity monitoring, and for logged angles with a specified bias.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub phase_bias_probability: Option<f64>,
    /// Time over which that error is forgotten, in seconds, provided that the vehicle moves.
    #[schemars(range(min = 1e-3, max = 1e9))]
    pub phase_bias_correlation_s: f64,
    /// Distance over which that error is forgotten, in metres.
    #[schemars(range(min = 1e-3, max = 1e9))]
    pub phase_bias_correlation_m: f64,
    /// Cells to listen to; all that the site has without.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pci_allow_list: Option<Vec<u16>>,
}

impl Default for ReceiverSettings {
    fn default() -> Self {
        Self {
            noise_figure_db: 5.0,
            temperature_k: 290.0,
            bandwidth_mhz: 3.6,
            pilots: Pilots::Ssb,
            snapshots: 20,
            snr_noise_db: 0.0,
            lateness_s: 0.0,
            lateness_std_s: None,
            phase_bias_std_rad: 0.0,
            phase_bias_share: None,
            phase_bias_probability: None,
            phase_bias_correlation_s: 1.0,
            phase_bias_correlation_m: 0.3,
            pci_allow_list: None,
        }
    }
}

impl ReceiverSettings {
    /// Whether it listens to a cell.
    pub fn hears(&self, pci: u16) -> bool {
        let list = self.pci_allow_list.as_ref();
        list.is_none_or(|list| list.contains(&pci))
    }
}

/// Which resource elements of the SSB the receiver knows and despreads (TS 38.211, 7.4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pilots {
    /// None: snapshots of an unknown signal, as in the paper.
    Blind,
    /// The primary synchronization signal.
    Pss,
    /// Both synchronization signals.
    #[serde(rename = "pss+sss")]
    PssSss,
    /// All of it, the broadcast channel having been decoded.
    #[default]
    Ssb,
}

impl Pilots {
    /// Known resource elements in each OFDM symbol of the SSB that has any; `None` when blind.
    pub const fn per_symbol(self) -> Option<&'static [u16]> {
        match self {
            Self::Blind => None,
            Self::Pss => Some(&[127]),
            Self::PssSss => Some(&[127, 127]),
            // Symbols 1 and 3 are PBCH throughout, symbol 2 holds SSS between two 48-wide parts.
            Self::Ssb => Some(&[127, 240, 127 + 96, 240]),
        }
    }
}

/// `[estimator]`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EstimatorSettings {
    /// The method.
    pub method: EstimatorMethod,
    /// MUSIC's angles are those of a grid from the array's axis on, so many degrees apart; without it
    /// its maximum is refined.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 10.0))]
    pub music_grid_deg: Option<f64>,
}

impl fmt::Display for EstimatorMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Music => "music",
            Self::RootMusic => "root-music",
            Self::Esprit => "esprit",
            Self::MaximumLikelihood => "maximum-likelihood",
        })
    }
}

/// How an angle of arrival is estimated from a covariance.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Default,
    Serialize,
    Deserialize,
    JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorMethod {
    /// Multiple signal classification.
    Music,
    /// Its polynomial form.
    RootMusic,
    /// Estimation of signal parameters by rotational invariance.
    Esprit,
    /// One-source maximum likelihood.
    #[default]
    MaximumLikelihood,
}
