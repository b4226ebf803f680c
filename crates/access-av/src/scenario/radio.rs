//! Radio heads, their SSBs, and the vehicle's array and receiver.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[radio_heads]]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RadioHeadSettings {
    /// Name for people.
    #[serde(default)]
    pub name: String,
    /// Surveyed place `[x, y]` in metres.
    pub position_m: [f64; 2],
    /// Physical cell identity, 0..=1007.
    #[serde(default)]
    pub pci: u16,
    /// Index of its SSB in the burst, 0..=63.
    #[serde(default)]
    pub ssb_index: u8,
    /// Transmit power in dBm.
    #[serde(default)]
    pub tx_power_dbm: f64,
    /// Antenna gain in dBi.
    #[serde(default = "papers_tx_gain_dbi")]
    pub tx_gain_dbi: f64,
}

fn papers_tx_gain_dbi() -> f64 {
    10.0
}

/// `[ssb]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SsbSettings {
    /// Period of the SSB burst in ms; 5, 10, 20, 40, 80 or 160 (TS 38.331).
    pub period_ms: f64,
    /// Subcarrier spacing in kHz.
    pub subcarrier_spacing_khz: f64,
    /// Carrier frequency in MHz.
    pub carrier_mhz: f64,
}

impl Default for SsbSettings {
    fn default() -> Self {
        Self {
            period_ms: 20.0,
            subcarrier_spacing_khz: 15.0,
            carrier_mhz: 3500.0,
        }
    }
}

impl SsbSettings {
    /// Period in seconds.
    pub fn period_s(&self) -> f64 {
        self.period_ms * 1e-3
    }

    /// Wavelength of the carrier in metres.
    pub fn wavelength_m(&self) -> f64 {
        299_792_458.0 / (self.carrier_mhz * 1e6)
    }
}

/// `[array]`: a uniform linear array along the vehicle's forward axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ArraySettings {
    /// Number of antennas: 4.
    pub elements: u8,
    /// Distance between neighbours in wavelengths.
    pub spacing_wavelengths: f64,
    /// Snapshots per SSB when `receiver.pilots` is "blind".
    pub snapshots: u16,
    /// Antenna gain in dBi.
    pub rx_gain_dbi: f64,
    /// Direction of the array's axis from the vehicle's forward axis, in radians.
    pub mounting_angle_rad: f64,
    /// Standard deviation of the error of that direction, in radians, drawn once per run.
    pub mounting_error_std_rad: f64,
    /// Random walk of that direction, in radians per root of a metre driven.
    pub mounting_drift_rad_per_sqrt_m: f64,
    /// Standard deviation of the phase that calibration leaves from antenna to antenna, in radians,
    /// drawn once per run.
    pub phase_error_std_rad: f64,
    /// Random walk of that phase, in radians per root of a metre driven.
    pub phase_drift_rad_per_sqrt_m: f64,
}

impl Default for ArraySettings {
    fn default() -> Self {
        Self {
            elements: 4,
            spacing_wavelengths: 0.5,
            snapshots: 20,
            rx_gain_dbi: 5.0,
            mounting_angle_rad: 0.0,
            mounting_error_std_rad: 0.0,
            mounting_drift_rad_per_sqrt_m: 0.0,
            phase_error_std_rad: 0.0,
            phase_drift_rad_per_sqrt_m: 0.0,
        }
    }
}

/// `[receiver]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverSettings {
    /// Noise figure in dB.
    pub noise_figure_db: f64,
    /// Noise temperature in kelvin.
    pub temperature_k: f64,
    /// Bandwidth of one snapshot in MHz.
    pub bandwidth_mhz: f64,
    /// What the receiver knows of the transmitted signal.
    pub pilots: Pilots,
    /// Standard deviation of the sensed SNR in dB.
    pub snr_noise_db: f64,
}

impl Default for ReceiverSettings {
    fn default() -> Self {
        Self {
            noise_figure_db: 5.0,
            temperature_k: 290.0,
            bandwidth_mhz: 3.6,
            pilots: Pilots::Blind,
            snr_noise_db: 0.0,
        }
    }
}

/// Which resource elements of the SSB the receiver knows and despreads (TS 38.211, 7.4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pilots {
    /// None: snapshots of an unknown signal, as in the paper.
    #[default]
    Blind,
    /// The primary synchronization signal.
    Pss,
    /// Both synchronization signals.
    #[serde(rename = "pss+sss")]
    PssSss,
    /// All of it, the broadcast channel having been decoded.
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
