//! Ranging of the vehicle: two-way ranges or one-way delays to the radio heads.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[ranging]`: measurement of distances to the radio heads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RangingSettings {
    /// Whether a range contains the clocks.
    pub kind: RangingKind,
    /// Standard deviation of the noise of one range, in metres. Default: that of each range in the
    /// log.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-4, max = 1000.0))]
    pub sigma_m: Option<f64>,
    /// Position of the ranging antenna relative to the odometer's reference point `[forward, left,
    /// up]`, in metres. Default: that of the array.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -100.0, max = 100.0)))]
    pub position_m: Option<[f64; 3]>,
    /// Standard deviation of the relative scale error of the ranges, which all radio heads share.
    /// Default: 0.1 for two-way ranges, whose scale depends on the calibration of the radios; 0 for
    /// one-way delays.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 0.3))]
    pub scale_std: Option<f64>,
    /// Standard deviation of the constant offset of each radio head's ranges, in metres: cables,
    /// hardware and multipath.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub offset_std_m: f64,
    /// Random walk of that offset over the distance driven, in m/√m.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub offset_walk_m_per_sqrt_m: f64,
    /// One-way delays: standard deviation of the vehicle clock's offset, in nanoseconds.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub clock_offset_std_ns: f64,
    /// One-way delays: random walk of the vehicle clock, in ns/√s.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub clock_wander_ns_per_sqrt_s: f64,
    /// One-way delays: standard deviation of the vehicle clock's relative frequency error, in parts
    /// per billion.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub clock_frequency_std_ppb: f64,
    /// One-way delays: random walk of the vehicle clock's frequency error, in ppb/√s.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub clock_drift_walk_ppb_per_sqrt_s: f64,
    /// One-way delays: whether the range rates of received SSBs are used. They measure the
    /// frequency error of the vehicle's clock and, with a known frequency of the radio heads, the
    /// heading.
    pub range_rate: bool,
    /// One-way delays: whether the carrier phases of received SSBs are used. They need clocks whose
    /// random walk between two SSBs is below an eighth of a wavelength.
    pub carrier_phase: bool,
}

/// Kind of the ranges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RangingKind {
    /// Two-way time of flight, as of ultra-wideband radios: no clock offset.
    #[default]
    TwoWay,
    /// One-way delay, as of 5G downlink signals: contains the offsets of the vehicle's clock and of
    /// the radio head's clock.
    OneWay,
}

impl Default for RangingSettings {
    fn default() -> Self {
        Self {
            kind: RangingKind::TwoWay,
            sigma_m: None,
            position_m: None,
            scale_std: None,
            offset_std_m: 3.0,
            offset_walk_m_per_sqrt_m: 0.01,
            clock_offset_std_ns: 1e6,
            clock_wander_ns_per_sqrt_s: 1.0,
            clock_frequency_std_ppb: 2000.0,
            clock_drift_walk_ppb_per_sqrt_s: 1.0,
            range_rate: true,
            carrier_phase: false,
        }
    }
}

/// Standard deviation of the scale of two-way ranges whose calibration is not specified.
const UNSTATED_SCALE_STD: f64 = 0.1;

impl RangingSettings {
    /// Returns the standard deviation of the relative scale error.
    pub fn scale_std(&self) -> f64 {
        self.scale_std.unwrap_or(match self.kind {
            RangingKind::TwoWay => UNSTATED_SCALE_STD,
            RangingKind::OneWay => 0.0,
        })
    }
}
