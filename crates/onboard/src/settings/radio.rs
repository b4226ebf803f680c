//! Radio heads and their SSBs.

use nr_ssb::grid::SUBCARRIERS;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[radio_heads]]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RadioHeadSettings {
    /// Display name.
    #[serde(default)]
    pub name: String,
    /// Surveyed position `[x, y, z]` in metres. The height z has the same datum as that of the
    /// vehicle's array.
    #[schemars(inner(range(min = -1e7, max = 1e7)))]
    pub position_m: [f64; 3],
    /// Standard deviation of the surveyed x and y, each in metres.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub position_std_m: f64,
    /// Physical cell identity (TS 38.211, 7.4.2.1).
    #[serde(default)]
    #[schemars(range(min = 0, max = 1007))]
    pub pci: u16,
    /// Index of the radio head's SSB in the burst.
    #[serde(default)]
    #[schemars(range(min = 0, max = 63))]
    pub ssb_index: u8,
    /// Equivalent isotropically radiated power (EIRP) in dBm: transmit power plus antenna gain.
    #[serde(default = "small_cell")]
    #[schemars(range(min = Self::MIN_EIRP_DBM, max = Self::MAX_EIRP_DBM))]
    pub eirp_dbm: f64,
    /// Standard deviation of the EIRP, in dB.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 40.0))]
    pub eirp_std_db: f64,
    /// Array of the radio head that measures the azimuth of the vehicle; required for angles measured at
    /// the radio head (`at_head` = 1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub array: Option<HeadArraySettings>,
    /// Number of the oscillator that several radio heads share, for one-way delays. Default: an own
    /// oscillator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_group: Option<u16>,
    /// Standard deviation of the clock's offset, in nanoseconds, for one-way delays. Default: 3000
    /// ns, the accuracy of TDD cells (TS 38.133, 7.4.2).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub clock_offset_std_ns: Option<f64>,
    /// Random walk of the clock, in ns/√s, for one-way delays. Default: 1 ns/√s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e4))]
    pub clock_wander_ns_per_sqrt_s: Option<f64>,
    /// Standard deviation of the carrier's relative frequency error, in parts per billion, for range
    /// rates. Default: 50 ppb, the maximum error of a base station (TS 38.104, 6.5.1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e4))]
    pub clock_frequency_std_ppb: Option<f64>,
    /// Offset of the ranges of this radio head, in metres: cables, hardware and mean multipath. `record
    /// survey` estimates it from ranges at known positions. Default: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub range_offset_m: Option<f64>,
    /// Standard deviation of that offset, in metres. Default: `ranging.offset_std_m` of the vehicle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub range_offset_std_m: Option<f64>,
}

/// `[radio_heads.array]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeadArraySettings {
    /// Direction of azimuth 0 of the array, counter-clockwise from +x of the map, in radians.
    #[schemars(range(min = -6.3, max = 6.3))]
    pub mounting_rad: f64,
    /// Standard deviation of `mounting_rad`, in radians.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 3.2))]
    pub mounting_std_rad: f64,
}

impl RadioHeadSettings {
    /// Minimum EIRP of a radio head (dBm).
    pub const MIN_EIRP_DBM: f64 = -150.0;
    /// Maximum EIRP of a radio head (dBm).
    pub const MAX_EIRP_DBM: f64 = 120.0;
}

const fn small_cell() -> f64 {
    10.0
}

/// `[ssb]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SsbSettings {
    /// Period of the SSB burst in ms; 5, 10, 20, 40, 80 or 160 (TS 38.331).
    #[schemars(extend("enum" = [5.0, 10.0, 20.0, 40.0, 80.0, 160.0]))]
    pub period_ms: f64,
    /// Subcarrier spacing in kHz; 15, 30, 120 or 240.
    #[schemars(extend("enum" = [15.0, 30.0, 120.0, 240.0]))]
    pub subcarrier_spacing_khz: f64,
}

impl Default for SsbSettings {
    fn default() -> Self {
        Self {
            period_ms: 20.0,
            subcarrier_spacing_khz: 15.0,
        }
    }
}

impl SsbSettings {
    /// Returns the period in seconds.
    pub fn period_s(&self) -> f64 {
        self.period_ms * 1e-3
    }

    /// Returns the bandwidth of an SSB, 240 subcarriers, in hertz (TS 38.211, 7.4.3.1).
    pub fn bandwidth_hz(&self) -> f64 {
        SUBCARRIERS as f64 * self.subcarrier_spacing_khz * 1e3
    }
}
