//! When an angle is estimated.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::error::SettingsError;

/// `[wake_up]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "policy", rename_all = "kebab-case")]
pub enum WakeUpSettings {
    /// At a fixed interval.
    Fixed(FixedSettings),
    /// The paper's Algorithm 1.
    Pid(PidSettings),
    /// As late as a bound on the error allows; needs the tracker.
    Uncertainty(UncertaintySettings),
}

impl Default for WakeUpSettings {
    fn default() -> Self {
        // Every SSB: none comes more often.
        Self::Fixed(FixedSettings {
            interval_ms: Some(1.0),
        })
    }
}

/// `policy = "fixed"`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FixedSettings {
    /// Interval in ms; without it, the base wake-up time of the platform's mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub interval_ms: Option<f64>,
}

/// `policy = "pid"`: Algorithm 1 and the choices it leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PidSettings {
    /// Shortest wake-up time in ms; without it, the base wake-up time of the platform's mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub base_ms: Option<f64>,
    /// Longest wake-up time in ms.
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub t_max_ms: f64,
    /// Proportional gain.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub kp: f64,
    /// Integral gain.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub ki: f64,
    /// Derivative gain.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub kd: f64,
    /// Weight of the SNR error.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub weight_snr: f64,
    /// Weight of the velocity error.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub weight_velocity: f64,
    /// The SNR at which the SNR error is zero.
    pub snr_set_point: SnrSetPoint,
    /// SNR shortfall that counts as an error of 1, in dB.
    #[schemars(range(min = 0.01, max = 1e3))]
    pub snr_scale_db: f64,
    /// When the controller's inputs are sensed.
    pub sensing: SensingMode,
    /// Whether an estimate that is due waits for an SSB that is not below the set point.
    pub deferral: bool,
    /// Bound on the magnitude of the integral term's sum; 0 removes it.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub integral_clamp: f64,
}

impl Default for PidSettings {
    fn default() -> Self {
        Self {
            base_ms: None,
            t_max_ms: 240.0,
            kp: 0.75,
            ki: 0.08,
            kd: 0.195,
            weight_snr: 0.6,
            weight_velocity: 0.4,
            snr_set_point: SnrSetPoint::Expected { offset_db: 3.0 },
            snr_scale_db: 10.0,
            sensing: SensingMode::EverySsb,
            deferral: true,
            integral_clamp: 0.5,
        }
    }
}

/// The SNR at which the SNR error is zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SnrSetPoint {
    /// What the link budget promises at the estimated place, and so much more.
    Expected {
        /// Offset in dB.
        #[schemars(range(min = -60.0, max = 60.0))]
        offset_db: f64,
    },
    /// One value for the whole route.
    Absolute {
        /// SNR in dB.
        #[schemars(range(min = -60.0, max = 100.0))]
        snr_db: f64,
    },
}

/// When the controller's inputs are sensed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensingMode {
    /// At each SSB: the receiver listens always and estimates sometimes.
    #[default]
    EverySsb,
    /// At wake-ups only: the receiver sleeps in between.
    WakeUp,
}

/// `policy = "uncertainty"`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct UncertaintySettings {
    /// Horizontal error to be kept, in metres: the paper's x̃_max. As few angles are estimated as
    /// late as keeps it.
    #[schemars(range(min = 1e-3, max = 1e3))]
    pub bound_m: f64,
    /// Probability with which it is kept.
    #[schemars(range(min = 0.01, max = 0.999_999))]
    pub confidence: f64,
    /// Energy of waking the receiver up, in executions.
    #[schemars(range(min = 0.0, max = 1e3))]
    pub wake_up_cost: f64,
    /// Variance in m² that makes an execution worth its energy before the bound demands it, and
    /// that it must take away where the bound is out of reach. Without it angles are estimated on
    /// the bound's demand alone, and all there are where it is out of reach.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub least_gain_m2: Option<f64>,
}

impl Default for UncertaintySettings {
    fn default() -> Self {
        Self {
            bound_m: 0.3,
            confidence: 0.9,
            wake_up_cost: 0.5,
            least_gain_m2: None,
        }
    }
}

impl WakeUpSettings {
    pub(super) fn check(&self, check: Check<'_>) -> Result<(), SettingsError> {
        let Self::Pid(PidSettings {
            base_ms: Some(base_ms),
            t_max_ms,
            ..
        }) = self
        else {
            return Ok(());
        };
        let allowed = format!("it must not be below wake_up.base_ms, {base_ms}");
        check.that(t_max_ms >= base_ms, "wake_up.t_max_ms", t_max_ms, &allowed)
    }
}
