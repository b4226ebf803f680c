//! Wake-up policy: when an angle is estimated.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::Check;
use super::error::SettingsError;

/// `[wake_up]`: policy that decides when an angle is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "policy", rename_all = "kebab-case")]
pub enum WakeUpSettings {
    /// Fixed interval.
    Fixed(FixedSettings),
    /// Algorithm 1 of the paper.
    Pid(PidSettings),
    /// A due estimate is deferred until an SSB reaches the SNR threshold.
    Gated(GatedSettings),
    /// Estimates as late as the target error permits; requires the tracker.
    Uncertainty(UncertaintySettings),
}

impl WakeUpSettings {
    /// At every SSB, which is the maximum rate.
    pub const EVERY_SSB: Self = Self::Fixed(FixedSettings {
        interval_ms: Some(1.0),
        ssb_selection: SsbSelection::FirstAfter,
    });
}

/// `policy = "fixed"`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FixedSettings {
    /// Interval in ms. Default: base wake-up time of the platform's power mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub interval_ms: Option<f64>,
    /// SSB that is used if an estimate becomes due between two SSBs.
    #[serde(skip_serializing_if = "SsbSelection::is_first_after")]
    pub ssb_selection: SsbSelection,
}

/// SSB that is used if an estimate becomes due between two SSBs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SsbSelection {
    /// First SSB at or after the due time: never early, up to one SSB period late.
    #[default]
    FirstAfter,
    /// Last SSB at or before the due time: never late, up to one SSB period early.
    LastBefore,
}

impl SsbSelection {
    #[allow(clippy::trivially_copy_pass_by_ref)] // as serde calls it
    const fn is_first_after(&self) -> bool {
        matches!(self, Self::FirstAfter)
    }

    /// Returns the maximum time by which an SSB may precede the due time, exclusive, in seconds.
    pub const fn lead_s(self, period_s: f64) -> f64 {
        match self {
            Self::FirstAfter => 0.0,
            Self::LastBefore => period_s,
        }
    }
}

/// `policy = "pid"`: Algorithm 1 of the paper, and the parameters that the paper does not specify.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PidSettings {
    /// Minimum wake-up time in ms. Default: base wake-up time of the platform's power mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub base_ms: Option<f64>,
    /// Maximum wake-up time in ms. Default: time in which the vehicle drives
    /// `target_error_m` at top speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub t_max_ms: Option<f64>,
    /// Target position error between two estimates in metres; x̃_max of the paper.
    #[schemars(range(min = 1e-3, max = 1e4))]
    pub target_error_m: f64,
    /// SSB that is used if an estimate becomes due between two SSBs.
    #[serde(skip_serializing_if = "SsbSelection::is_first_after")]
    pub ssb_selection: SsbSelection,
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
    /// SNR at which the SNR error is zero.
    pub snr_set_point: SnrSetPoint,
    /// SNR deficit that corresponds to an SNR error of 1, in dB.
    #[schemars(range(min = 0.01, max = 1e3))]
    pub snr_scale_db: f64,
    /// Times at which the inputs of the controller are measured.
    pub sensing: SensingMode,
    /// Definition of Δt in Algorithm 1.
    pub delta_t: DeltaT,
    /// Increase of the wake-up time for u = 1, in ms.
    #[schemars(range(min = 1e-3, max = 3.6e6))]
    pub u_unit_ms: f64,
    /// Bound on the magnitude of the integral; 0 means unbounded.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub integral_clamp: f64,
}

impl Default for PidSettings {
    fn default() -> Self {
        Self {
            base_ms: None,
            t_max_ms: None,
            target_error_m: 1.0,
            ssb_selection: SsbSelection::FirstAfter,
            kp: 0.75,
            ki: 0.08,
            kd: 0.195,
            weight_snr: 0.6,
            weight_velocity: 0.4,
            snr_set_point: SnrSetPoint::Expected { offset_db: 3.0 },
            snr_scale_db: 10.0,
            sensing: SensingMode::EverySsb,
            delta_t: DeltaT::Seconds,
            u_unit_ms: 1000.0,
            integral_clamp: 0.5,
        }
    }
}

impl PidSettings {
    /// Returns the maximum wake-up time in seconds: as specified, otherwise from x̃_max = v ·
    /// t_max.
    pub fn t_max_s(&self, top_speed_mps: f64) -> f64 {
        let stated_s = self.t_max_ms.map(|ms| ms * 1e-3);
        stated_s.unwrap_or(self.target_error_m / top_speed_mps)
    }

    /// Returns an error if the maximum wake-up time is below the minimum, whose key is `base`.
    ///
    /// # Errors
    /// [`SettingsError::Value`] at the key of the maximum wake-up time, in the table `place`.
    pub fn check_t_max(
        &self,
        base_s: f64,
        base: &str,
        top_speed_mps: f64,
        place: &str,
        check: Check<'_>,
    ) -> Result<(), SettingsError> {
        let (t_max_s, base_ms) = (self.t_max_s(top_speed_mps), base_s * 1e3);
        let (key, value, what) = match self.t_max_ms {
            Some(t_max_ms) => ("t_max_ms", t_max_ms, "it".to_owned()),
            None => (
                "target_error_m",
                self.target_error_m,
                format!(
                    "at the top speed it gives a t_max of {:.1} ms, which",
                    t_max_s * 1e3
                ),
            ),
        };
        let allowed = format!("{what} must not be below {base}, {base_ms} ms");
        let key = format!("{place}.{key}");
        check.that(t_max_s >= base_s - 1e-9, &key, value, &allowed)
    }
}

/// `policy = "gated"`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GatedSettings {
    /// SNR threshold: no angle is estimated from a weaker SSB.
    pub snr_set_point: SnrSetPoint,
    /// Maximum time between two estimates in ms, whatever the SNR. Default: unbounded.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub t_max_ms: Option<f64>,
    /// Trigger: condition that makes an estimate due.
    pub trigger: TriggerSettings,
}

impl Default for GatedSettings {
    fn default() -> Self {
        Self {
            snr_set_point: SnrSetPoint::Expected { offset_db: 3.0 },
            t_max_ms: None,
            trigger: TriggerSettings::Pid(PidSettings::default()),
        }
    }
}

/// Trigger of an estimate, based on the time since the previous one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "policy", rename_all = "kebab-case")]
pub enum TriggerSettings {
    /// Constant time.
    Fixed(FixedSettings),
    /// Algorithm 1 of the paper.
    Pid(PidSettings),
}

/// SNR at which the SNR error is zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SnrSetPoint {
    /// SNR predicted by the link budget at the estimated position, plus an offset.
    Expected {
        /// Offset in dB.
        #[schemars(range(min = -60.0, max = 60.0))]
        offset_db: f64,
    },
    /// Constant SNR for the whole route.
    Absolute {
        /// SNR in dB.
        #[schemars(range(min = -60.0, max = 100.0))]
        snr_db: f64,
    },
}

/// Times at which the inputs of the controller are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensingMode {
    /// Every SSB: the receiver is always on, and angles are estimated at wake-ups.
    #[default]
    EverySsb,
    /// Wake-ups only: the receiver is off in between.
    WakeUp,
}

/// Definition of Δt in Algorithm 1, which integrates over it and divides by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeltaT {
    /// Time since the previous measurement of the inputs, in seconds.
    #[default]
    Seconds,
    /// 1 for each measurement of the inputs.
    Steps,
}

/// `policy = "uncertainty"`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct UncertaintySettings {
    /// Target horizontal error at which the vehicle wakes up, in metres; x̃_max of the paper.
    /// Angles are estimated as late and as rarely as possible so that the localizer's covariance
    /// stays below it. The actual error exceeds the target if the covariance is too small or no
    /// radio head is in range. `access-av design tune` finds the target for a required error.
    #[schemars(range(min = 1e-3, max = 1e3))]
    pub target_error_m: f64,
    /// Probability that the error is below `target_error_m` at a wake-up, given a correct covariance.
    #[schemars(range(min = 0.01, max = 0.999_999))]
    pub confidence: f64,
    /// Minimum time between two wake-ups in ms: duration of one estimate. Default: one SSB period.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub base_ms: Option<f64>,
    /// Minimum reduction of the position variance, in m², for which a wake-up with one angle is
    /// made before the target requires it. It also applies where the target cannot be reached. A
    /// wake-up with several angles needs a reduction in proportion to its energy.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub min_variance_reduction_m2: f64,
    /// Maximum SNR above the link budget's prediction, in dB. With this key, the receiver is on
    /// wherever an SSB of that SNR would justify its energy, and the measured SNR decides. Default:
    /// the link budget decides, which keeps the receiver off for longer.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 40.0))]
    pub snr_headroom_db: Option<f64>,
}

impl Default for UncertaintySettings {
    fn default() -> Self {
        Self {
            target_error_m: 0.3,
            confidence: 0.9,
            base_ms: None,
            min_variance_reduction_m2: 1.5e-4,
            snr_headroom_db: None,
        }
    }
}

impl WakeUpSettings {
    /// Returns the settings of Algorithm 1, if it is the trigger.
    pub const fn pid_mut(&mut self) -> Option<&mut PidSettings> {
        match self {
            Self::Pid(pid)
            | Self::Gated(GatedSettings {
                trigger: TriggerSettings::Pid(pid),
                ..
            }) => Some(pid),
            Self::Fixed(_) | Self::Gated(_) | Self::Uncertainty(_) => None,
        }
    }

    /// Returns the key of the wake-up time that has a default from the platform.
    pub(super) const fn base_key(&self) -> &'static str {
        match self {
            Self::Fixed(_) => "wake_up.interval_ms",
            Self::Pid(_) | Self::Uncertainty(_) => "wake_up.base_ms",
            Self::Gated(GatedSettings {
                trigger: TriggerSettings::Fixed(_),
                ..
            }) => "wake_up.trigger.interval_ms",
            Self::Gated(_) => "wake_up.trigger.base_ms",
        }
    }

    /// Returns the wake-up time that has a default from the platform, if any.
    pub(super) const fn base_ms(&mut self) -> Option<&mut Option<f64>> {
        match self {
            Self::Fixed(fixed) => Some(&mut fixed.interval_ms),
            Self::Pid(pid) => Some(&mut pid.base_ms),
            Self::Gated(gated) => Some(match &mut gated.trigger {
                TriggerSettings::Fixed(fixed) => &mut fixed.interval_ms,
                TriggerSettings::Pid(pid) => &mut pid.base_ms,
            }),
            Self::Uncertainty(_) => None,
        }
    }

    pub(super) fn check(&self, top_speed_mps: f64, check: Check<'_>) -> Result<(), SettingsError> {
        let t_max = |pid: &PidSettings, place: &str| {
            let (base_s, base) = (
                pid.base_ms.unwrap_or(0.0) * 1e-3,
                format!("{place}.base_ms"),
            );
            pid.check_t_max(base_s, &base, top_speed_mps, place, check)
        };
        match self {
            Self::Pid(pid) => t_max(pid, "wake_up"),
            Self::Gated(gated) => {
                let (base_ms, base) = match &gated.trigger {
                    TriggerSettings::Fixed(fixed) => {
                        (fixed.interval_ms, "wake_up.trigger.interval_ms")
                    }
                    TriggerSettings::Pid(pid) => {
                        t_max(pid, "wake_up.trigger")?;
                        (pid.base_ms, "wake_up.trigger.base_ms")
                    }
                };
                let base_ms = base_ms.unwrap_or(0.0);
                let t_max_ms = gated.t_max_ms.unwrap_or(f64::INFINITY);
                let allowed = format!("it must not be below {base}, {base_ms}");
                check.that(t_max_ms >= base_ms, "wake_up.t_max_ms", t_max_ms, &allowed)
            }
            Self::Fixed(_) | Self::Uncertainty(_) => Ok(()),
        }
    }
}
