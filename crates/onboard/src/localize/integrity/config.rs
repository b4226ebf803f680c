//! What the guard is to promise.

use crate::settings::IntegritySettings;

/// What the guard is to promise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegrityConfig {
    /// Probability with which the error may exceed the protection level, no source being at fault.
    pub risk: f64,
    /// The same with one source at fault, which is rare in itself.
    pub risk_under_fault: f64,
    /// Protection level above which the position is not to be relied on (m).
    pub alert_limit_m: f64,
    /// Statistic at which a radio head counts as faulty, in standard deviations.
    pub detection_threshold: f64,
    /// Statistic below which a faulty radio head counts as sound again ...
    pub recovery_threshold: f64,
    /// ... after this time (s).
    pub recovery_s: f64,
}

impl Default for IntegrityConfig {
    fn default() -> Self {
        Self {
            risk: 8e-4,
            risk_under_fault: 1e-2,
            alert_limit_m: 1.5,
            detection_threshold: 5.5,
            recovery_threshold: 3.5,
            recovery_s: 5.0,
        }
    }
}

impl From<&IntegritySettings> for IntegrityConfig {
    fn from(settings: &IntegritySettings) -> Self {
        Self {
            alert_limit_m: settings.alert_limit_m,
            risk: settings.risk,
            ..Self::default()
        }
    }
}
