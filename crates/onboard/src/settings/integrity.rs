//! Whom the tracker mistrusts, and the risk that is left.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::error::SettingsError;

/// `[integrity]`: the tracker mistrusts its sources and states a protection level. It does so without this
/// table, too, by these defaults.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IntegritySettings {
    /// Whether it does. `false` takes every source at its word, and no position has a protection level.
    pub enabled: bool,
    /// Protection level in metres above which the position is not to be relied on.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub alert_limit_m: f64,
    /// Target integrity risk: how often in an hour the error may come to exceed the protection
    /// level without an alarm.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub risk_per_hour: f64,
    /// Time in seconds after which the error may be beyond the level anew: so many epochs of an hour are
    /// independent.
    #[schemars(range(min = 0.01, max = 600.0))]
    pub error_correlation_s: f64,
    /// How probable each fault is, at any time.
    pub fault_probability: FaultProbability,
}

/// `[integrity.fault_probability]`: probabilities of being at fault, at any time, each independently of
/// the others. What is wrong within the standard deviations of site and vehicle is no fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FaultProbability {
    /// Fault of a radio head: moved or spoofed. Default: 1e-3 where its bias is estimated
    /// (`receiver.phase_bias_probability`) and two other radio heads exist to separate it from the position; else 0.01.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-9, max = 0.5))]
    pub radio_head: Option<f64>,
    /// Of the odometer: it slips, each time that the vehicle sets off; that it is noisier than stated is ninety times as
    /// probable. Trackers that expect it count as probable as the angles leave it.
    #[schemars(range(min = 1e-9, max = 0.5))]
    pub odometer: f64,
    /// Displacement of all radio heads relative to the map. A filter estimates it, and the angles weigh that filter.
    /// Without a map the radio heads define the frame, and this fault does not exist.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub all_radio_heads: f64,
    /// Of the array: its mounting or its phases. Nobody watches it: it comes off the risk.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub array: f64,
}

impl Default for IntegritySettings {
    fn default() -> Self {
        Self {
            enabled: true,
            alert_limit_m: 1.5,
            risk_per_hour: 1.0,
            error_correlation_s: 3.0,
            fault_probability: FaultProbability::default(),
        }
    }
}

impl Default for FaultProbability {
    fn default() -> Self {
        Self {
            radio_head: None,
            odometer: 1e-3,
            all_radio_heads: 0.01,
            array: 1e-5,
        }
    }
}

impl IntegritySettings {
    /// Switched off: every source is taken at its word.
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
    /// Probability with which an independent epoch may exceed the protection level: what a fault that
    /// nobody watches leaves of the hour's risk, by the epochs of an hour that are independent
    /// (Blanch, Walter, Enge, Lee, Pervan, Rippl, Spletter and Kropp, IEEE Transactions on Aerospace
    /// and Electronic Systems 51, 2015).
    pub fn risk_per_epoch(&self) -> f64 {
        let monitored = self.risk_per_hour - self.fault_probability.array;
        monitored * self.error_correlation_s / 3600.0
    }

    /// Refuses a fault that is likelier than the risk can bear.
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
                "nobody watches it: it must be below integrity.risk_per_hour, {}",
                self.risk_per_hour
            ),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_hour_is_as_many_epochs_as_are_independent() {
        let mut settings = IntegritySettings {
            risk_per_hour: 1e-3,
            error_correlation_s: 36.0,
            ..IntegritySettings::default()
        };
        settings.fault_probability.array = 4e-4;
        assert!((settings.risk_per_epoch() / 6e-6 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn faults_that_the_risk_cannot_bear_are_refused_by_key() {
        let check = Check { file: "cart.toml" };
        let mut settings = IntegritySettings::default();
        assert!(settings.check(check).is_ok());
        (settings.risk_per_hour, settings.fault_probability.array) = (0.3, 0.3);
        let told = settings.check(check).unwrap_err().to_string();
        assert!(told.contains("integrity.fault_probability"), "{told}");
    }
}
