//! Receiver of the vehicle, and estimator of the angle.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[receiver]`: receiver of the vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverSettings {
    /// Noise figure in dB, relative to the noise at 290 K.
    #[schemars(range(min = 0.0, max = 60.0))]
    pub noise_figure_db: f64,
    /// Part of the transmitted signal that the receiver knows.
    pub pilots: Pilots,
    /// Number of snapshots of each SSB if `pilots` is "blind".
    #[schemars(range(min = 1, max = 64))]
    pub snapshots: u16,
    /// Standard deviation of the measured SNR in dB.
    #[schemars(range(min = 0.0, max = 40.0))]
    pub snr_noise_db: f64,
    /// Time offset of an angle: its time stamp minus the time of its measurement, in seconds.
    #[schemars(range(min = -1.0, max = 0.4))]
    pub angle_time_offset_s: f64,
    /// Standard deviation of the time offset, in seconds; 0 means that the clocks agree. The offset
    /// is estimated while driving. Default: 0 on a road, 0.1 s for a differential drive. In
    /// recorded drives, an offset of up to 1.5 s is estimated in advance.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 0.5))]
    pub angle_time_offset_std_s: Option<f64>,
    /// Maximum fraction of an angle's variance that is time-correlated; the actual fraction is
    /// estimated while driving. Default: 0.25 for logged angles, 0 for angles of the receiver,
    /// whose variance is that of thermal noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub correlated_noise_fraction: Option<f64>,
    /// Prior probability that the angles of a radio head have a time-correlated bias, as reflections cause it. Every
    /// filter of the localizer then estimates the bias of each radio head; 0 estimates none. Default: 0.75 on a road
    /// vehicle, 0 on a differential drive, without integrity monitoring, and for logged angles with a specified bias.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub multipath_bias_probability: Option<f64>,
    /// Correlation time of the time-correlated error, in seconds, while the vehicle moves.
    #[schemars(range(min = 1e-3, max = 1e9))]
    pub noise_correlation_time_s: f64,
    /// Correlation distance of the time-correlated error, in metres.
    #[schemars(range(min = 1e-3, max = 1e9))]
    pub noise_correlation_distance_m: f64,
    /// Physical cell identities that are received. Default: all of the site.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pci_allow_list: Option<Vec<u16>>,
}

impl Default for ReceiverSettings {
    fn default() -> Self {
        Self {
            noise_figure_db: 5.0,
            pilots: Pilots::Ssb,
            snapshots: 20,
            snr_noise_db: 0.0,
            angle_time_offset_s: 0.0,
            angle_time_offset_std_s: None,
            correlated_noise_fraction: None,
            multipath_bias_probability: None,
            noise_correlation_time_s: 1.0,
            noise_correlation_distance_m: 0.3,
            pci_allow_list: None,
        }
    }
}

impl ReceiverSettings {
    /// Whether the receiver processes a cell.
    pub fn receives(&self, pci: u16) -> bool {
        let list = self.pci_allow_list.as_ref();
        list.is_none_or(|list| list.contains(&pci))
    }
}

/// Resource elements of the SSB that the receiver knows and despreads (TS 38.211, 7.4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pilots {
    /// No known resource elements: snapshots of an unknown signal, as in the paper.
    Blind,
    /// The primary synchronization signal.
    Pss,
    /// Both synchronization signals.
    #[serde(rename = "pss+sss")]
    PssSss,
    /// The whole SSB, after the PBCH has been decoded.
    #[default]
    Ssb,
}

impl Pilots {
    /// Returns the number of known resource elements in each OFDM symbol of the SSB that contains
    /// any; `None` if `pilots` is "blind".
    pub const fn per_symbol(self) -> Option<&'static [u16]> {
        match self {
            Self::Blind => None,
            Self::Pss => Some(&[127]),
            Self::PssSss => Some(&[127, 127]),
            // Symbols 1 and 3 contain PBCH only; symbol 2 contains the SSS between two PBCH parts
            // of 48 subcarriers.
            Self::Ssb => Some(&[127, 240, 127 + 96, 240]),
        }
    }
}

/// `[estimator]`: estimator of the angle.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EstimatorSettings {
    /// Estimation method.
    pub method: EstimatorMethod,
    /// Step of MUSIC's grid, in degrees, starting at the array axis. Default: the maximum of the
    /// pseudospectrum is refined.
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

/// Estimation method of the angle of arrival from a covariance matrix.
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
    /// Multiple signal classification (MUSIC).
    Music,
    /// Root-MUSIC, the polynomial form of MUSIC.
    RootMusic,
    /// Estimation of signal parameters via rotational invariance techniques (ESPRIT).
    Esprit,
    /// Maximum likelihood for one source.
    #[default]
    MaximumLikelihood,
}
