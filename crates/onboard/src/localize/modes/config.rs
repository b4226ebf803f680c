//! What integrity monitoring is to promise.

use crate::settings::{FaultProbability, IntegritySettings};

/// However rare a fault is, under it the error is within the level more often than not.
const MOST_CONDITIONAL: f64 = 0.49;

/// What integrity monitoring is to promise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegrityConfig {
    /// Probability with which the error of an independent epoch may exceed the protection level.
    pub risk: f64,
    /// How probable each fault is.
    pub fault_probability: FaultProbability,
    /// Protection level above which the position is not to be relied on (m).
    pub alert_limit_m: f64,
    /// After this time without disagreement a source counts as sound again (s).
    pub recovery_s: f64,
}

impl IntegrityConfig {
    /// Probability with which the error may exceed the level with a radio head at fault, where radio heads are
    /// tested for it.
    pub fn risk_under_fault(&self) -> f64 {
        (self.risk / self.fault_probability.of_radio_head(false)).min(MOST_CONDITIONAL)
    }
}

impl Default for IntegrityConfig {
    fn default() -> Self {
        Self::from(&IntegritySettings::default())
    }
}

impl From<&IntegritySettings> for IntegrityConfig {
    fn from(settings: &IntegritySettings) -> Self {
        Self {
            alert_limit_m: settings.alert_limit_m,
            risk: settings.risk_per_epoch(),
            fault_probability: settings.fault_probability,
            recovery_s: 5.0,
        }
    }
}
