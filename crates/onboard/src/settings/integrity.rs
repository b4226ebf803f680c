//! Integrity monitoring: fault probabilities and integrity risk.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::error::SettingsError;

/// Correlation time of the position error, in seconds: errors at times this far apart are treated
/// as independent. An error beyond the level lasts for 1.6 s on average in simulated drives
/// (docs/integrity.md).
pub const ERROR_CORRELATION_S: f64 = 3.0;

/// `[integrity]`: the tracker monitors its sources and computes a protection level. Without this
/// table, the defaults apply.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IntegritySettings {
    /// Whether integrity is monitored. With `false`, every source is trusted and no protection
    /// level is computed.
    pub enabled: bool,
    /// Alert limit: protection level above which the position must not be used, in metres.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub alert_limit_m: f64,
    /// Target integrity risk per hour: expected number of times that the error exceeds the
    /// protection level without an alarm.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub risk_per_hour: f64,
    /// Prior probability of each fault, at any time.
    pub fault_probability: FaultProbability,
}

/// `[integrity.fault_probability]`: prior probability that a source is faulty, at any time. Faults
/// are independent. An error within the standard deviations of the site and vehicle files is not a
/// fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FaultProbability {
    /// Fault of a radio head: moved or spoofed. Default: 1e-3 where its bias is estimated
    /// (`receiver.multipath_bias_probability`); else 0.01. Where it is estimated, this is the probability that the biases
    /// of radio heads persist over hundreds of metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-9, max = 0.5))]
    pub radio_head: Option<f64>,
    /// Prior probability of wheel slip, each time that the vehicle starts to move. An odometer
    /// noisier than specified is 90 times as probable. Trackers that model the noise weight it by
    /// the angles.
    #[schemars(range(min = 1e-9, max = 0.5))]
    pub odometer: f64,
    /// Displacement of all radio heads relative to the map. A filter estimates it, and the angles weigh that filter.
    /// Without a map the radio heads define the frame, and this fault does not exist.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub site_frame_offset: f64,
    /// Prior probability of an array fault (mounting or phases). The monitor does not detect this
    /// fault: its probability is subtracted from the integrity risk.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub array: f64,
}

impl Default for IntegritySettings {
    fn default() -> Self {
        Self {
            enabled: true,
            alert_limit_m: 1.5,
            risk_per_hour: 1.0,
            fault_probability: FaultProbability::default(),
        }
    }
}

impl Default for FaultProbability {
    fn default() -> Self {
        Self {
            radio_head: None,
            odometer: 1e-3,
            site_frame_offset: 0.01,
            array: 1e-5,
        }
    }
}

impl IntegritySettings {
    /// Returns settings without integrity monitoring: every source is trusted.
    pub fn off() -> Self {
        Self {
            enabled: false,
            ..Self::default()
        }
    }
}

impl FaultProbability {
    /// Returns the prior probability of a fault of each radio head, with or without estimated biases.
    pub fn of_radio_head(&self, estimates_bias: bool) -> f64 {
        self.radio_head
            .unwrap_or(if estimates_bias { 1e-3 } else { 0.01 })
    }
}

impl IntegritySettings {
    /// Returns the maximum probability that the error exceeds the protection level at one
    /// independent epoch. It is the integrity risk per hour, less that of unmonitored faults,
    /// divided by the number of independent epochs per hour (Blanch, Walter, Enge, Lee, Pervan,
    /// Rippl, Spletter and Kropp, IEEE Transactions on Aerospace and Electronic Systems 51, 2015).
    pub fn risk_per_epoch(&self) -> f64 {
        let monitored = self.risk_per_hour - self.fault_probability.array;
        monitored * ERROR_CORRELATION_S / 3600.0
    }

    /// Returns an error if a fault is more probable than the integrity risk permits.
    ///
    /// # Errors
    /// [`SettingsError::Value`].
    pub fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let array = self.fault_probability.array;
        check.that(
            array < self.risk_per_hour,
            "integrity.fault_probability.array",
            array,
            &format!(
                "the fault is not monitored: it must be below integrity.risk_per_hour, {}",
                self.risk_per_hour
            ),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_risk_per_hour_counts_independent_epochs() {
        let mut settings = IntegritySettings {
            risk_per_hour: 1e-3,
            ..IntegritySettings::default()
        };
        settings.fault_probability.array = 4e-4;
        assert!((settings.risk_per_epoch() / 5e-7 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn unmonitored_faults_above_the_risk_are_rejected_by_key() {
        let check = Check { file: "cart.toml" };
        let mut settings = IntegritySettings::default();
        assert!(settings.check(check).is_ok());
        (settings.risk_per_hour, settings.fault_probability.array) = (0.3, 0.3);
        let message = settings.check(check).unwrap_err().to_string();
        assert!(message.contains("integrity.fault_probability"), "{message}");
    }
}
