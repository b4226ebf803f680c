//! The receiver's hardware, where samples are simulated.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Check, Fidelity, Scenario, ScenarioError};

/// `[iq]`: used with `fidelity = "iq"`, and for recordings made of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IqSettings {
    /// Standard deviation of the error of the receiver's oscillator in parts per million, drawn
    /// once per run. It shifts the carrier and stretches the sampling clock alike.
    pub oscillator_ppm: f64,
    /// The same of each radio head's (TS 38.104 allows 0.05).
    pub head_oscillator_ppm: f64,
    /// Bits of the converter, for each of I and Q.
    pub adc_bits: u8,
    /// Full scale of the converter over the root mean square of the strongest symbol, in dB.
    pub adc_headroom_db: f64,
    /// Standard deviation of the phase error of each channel in radians, drawn once per run.
    pub channel_phase_rad: f64,
    /// The same of its gain, in dB.
    pub channel_gain_db: f64,
}

impl Default for IqSettings {
    fn default() -> Self {
        Self {
            oscillator_ppm: 0.5,
            head_oscillator_ppm: 0.02,
            adc_bits: 12,
            adc_headroom_db: 12.0,
            channel_phase_rad: 0.0,
            channel_gain_db: 0.0,
        }
    }
}

impl Scenario {
    pub(super) fn check_iq(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        let iq = &self.iq;
        check.between("iq.oscillator_ppm", iq.oscillator_ppm, 0.0, 1.0)?;
        check.between("iq.head_oscillator_ppm", iq.head_oscillator_ppm, 0.0, 0.2)?;
        check.between("iq.adc_bits", f64::from(iq.adc_bits), 1.0, 24.0)?;
        check.between("iq.adc_headroom_db", iq.adc_headroom_db, -20.0, 60.0)?;
        check.not_negative("iq.channel_phase_rad", iq.channel_phase_rad)?;
        check.between("iq.channel_gain_db", iq.channel_gain_db, 0.0, 20.0)?;
        if self.fidelity == Fidelity::Iq {
            self.check_sends_samples(check)?;
        }
        Ok(())
    }

    /// Refuses delays that snapshots cannot show, or that symbols would run into each other by.
    pub(super) fn check_delay_spread(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        let (key, spread_ns) = ("channel.delay_spread_ns", self.channel.delay_spread_ns);
        // A quarter of the prefix, 18 samples of a symbol's 256: e⁻⁴ of the scatter comes later.
        let prefix_ns = 18.0 / 256.0 * 1e6 / self.ssb.subcarrier_spacing_khz;
        check.between(key, spread_ns, 0.0, 0.25 * prefix_ns)?;
        check.that(
            spread_ns == 0.0 || self.fidelity == Fidelity::Iq,
            key,
            spread_ns,
            "it acts on samples only, with fidelity = \"iq\"; else it must be 0",
        )
    }

    /// Refuses what cannot be sent as samples.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] for a numerology or an SSB index of frequency range 2.
    pub(crate) fn check_sends_samples(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        check.that(
            [15.0, 30.0].contains(&self.ssb.subcarrier_spacing_khz),
            "ssb.subcarrier_spacing_khz",
            self.ssb.subcarrier_spacing_khz,
            "samples can be made at 15 and 30",
        )?;
        let count = if self.ssb.carrier_mhz <= 3000.0 { 4 } else { 8 };
        for (index, head) in self.radio_heads.iter().enumerate() {
            check.that(
                head.ssb_index < count,
                &format!("radio_heads[{index}].ssb_index"),
                head.ssb_index,
                &format!("samples can be made of an index below {count} at this carrier"),
            )?;
        }
        Ok(())
    }
}
