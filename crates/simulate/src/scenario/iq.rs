//! Hardware of the receiver in simulations with IQ samples.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[iq]`: used with `fidelity = "iq"` and for simulated recordings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IqSettings {
    /// Standard deviation of the frequency error of the receiver's oscillator in parts per million,
    /// drawn once per run. The error affects the carrier frequency and the sample clock.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub oscillator_ppm: f64,
    /// Resolution of the A/D converter in bits, for each of I and Q.
    #[schemars(range(min = 1, max = 24))]
    pub adc_bits: u8,
    /// Standard deviation of the phase error of each receive channel in radians, drawn once per
    /// run.
    #[schemars(range(min = 0.0, max = 6.3))]
    pub channel_phase_rad: f64,
    /// Standard deviation of the gain error of each receive channel in dB, drawn once per run.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub channel_gain_db: f64,
    /// True errors of the clocks of vehicle and radio heads, relative to those of the site file and
    /// of the vehicle's `[ranging]`. They have an effect only if the vehicle uses one-way delays.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub clock_error_scale: f64,
}

impl Default for IqSettings {
    fn default() -> Self {
        Self {
            oscillator_ppm: 0.5,
            adc_bits: 12,
            channel_phase_rad: 0.0,
            channel_gain_db: 0.0,
            clock_error_scale: 1.0,
        }
    }
}
