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
    /// An estimate that is due waits for an SSB that is not below a set point.
    Gated(GatedSettings),
    /// As late as a bound on the error allows; needs the tracker.
    Uncertainty(UncertaintySettings),
}

impl WakeUpSettings {
    /// At every SSB: none comes more often than that.
    pub const EVERY_SSB: Self = Self::Fixed(FixedSettings {
        interval_ms: Some(1.0),
        serving_ssb: ServingSsb::FirstAfter,
    });
}

/// `policy = "fixed"`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FixedSettings {
    /// Interval in ms; without it, the base wake-up time of the platform's mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub interval_ms: Option<f64>,
    /// Which SSB serves an estimate that falls due between two.
    #[serde(skip_serializing_if = "ServingSsb::is_first_after")]
    pub serving_ssb: ServingSsb,
}

/// Which SSB serves an estimate that falls due, so long after the last one, between two SSBs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ServingSsb {
    /// The first at or after that: never sooner than the wake-up time, up to an SSB period later.
    #[default]
    FirstAfter,
    /// The last at or before it: never later, up to an SSB period sooner.
    LastBefore,
}

impl ServingSsb {
    #[allow(clippy::trivially_copy_pass_by_ref)] // as serde calls it
    const fn is_first_after(&self) -> bool {
        matches!(self, Self::FirstAfter)
    }

    /// How much sooner than the wake-up time an SSB serves it, below this, in seconds.
    pub const fn lead_s(self, period_s: f64) -> f64 {
        match self {
            Self::FirstAfter => 0.0,
            Self::LastBefore => period_s,
        }
    }
}

/// `policy = "pid"`: Algorithm 1 and the choices it leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PidSettings {
    /// Shortest wake-up time in ms; without it, the base wake-up time of the platform's mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub base_ms: Option<f64>,
    /// Longest wake-up time in ms; without it, the time in which the vehicle covers
    /// `position_uncertainty_m` at its top speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub t_max_ms: Option<f64>,
    /// Bound on the position uncertainty between two estimates in metres, the paper's x̃_max.
    #[schemars(range(min = 1e-3, max = 1e4))]
    pub position_uncertainty_m: f64,
    /// Which SSB serves an estimate that falls due between two.
    #[serde(skip_serializing_if = "ServingSsb::is_first_after")]
    pub serving_ssb: ServingSsb,
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
    /// What Algorithm 1 takes for Δt.
    pub delta_t: DeltaT,
    /// What u = 1 adds to the wake-up time, in ms.
    #[schemars(range(min = 1e-3, max = 3.6e6))]
    pub u_unit_ms: f64,
    /// Bound on the magnitude of the integral term's sum; 0 removes it.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub integral_clamp: f64,
}

impl Default for PidSettings {
    fn default() -> Self {
        Self {
            base_ms: None,
            t_max_ms: None,
            position_uncertainty_m: 1.0,
            serving_ssb: ServingSsb::FirstAfter,
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
    /// Longest wake-up time in seconds: x̃_max = v · t_max, unless it is stated.
    pub fn t_max_s(&self, top_speed_mps: f64) -> f64 {
        let stated_s = self.t_max_ms.map(|ms| ms * 1e-3);
        stated_s.unwrap_or(self.position_uncertainty_m / top_speed_mps)
    }

    /// Refuses a longest wake-up time below the shortest, which `base` names.
    ///
    /// # Errors
    /// [`SettingsError::Value`] at the key of `place` that states the longest.
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
                "position_uncertainty_m",
                self.position_uncertainty_m,
                format!(
                    "at the top speed that is a t_max of {:.1} ms, which",
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
    /// No angle is estimated from an SSB that is weaker.
    pub snr_set_point: SnrSetPoint,
    /// Longest time from one estimate to the next in ms, however weak the SSB is then; without it,
    /// a good SSB is waited for as long as it takes.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub latest_ms: Option<f64>,
    /// What makes an estimate due.
    pub due: DueSettings,
}

impl Default for GatedSettings {
    fn default() -> Self {
        Self {
            snr_set_point: SnrSetPoint::Expected { offset_db: 3.0 },
            latest_ms: None,
            due: DueSettings::Pid(PidSettings::default()),
        }
    }
}

/// What makes an estimate due, so long after the last one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "policy", rename_all = "kebab-case")]
pub enum DueSettings {
    /// A constant time.
    Fixed(FixedSettings),
    /// The paper's Algorithm 1.
    Pid(PidSettings),
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

/// What Algorithm 1 takes for Δt, over which it integrates and by which it divides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeltaT {
    /// The time since the inputs were sensed before, in seconds.
    #[default]
    Seconds,
    /// One for every time that they are sensed.
    Steps,
}

/// `policy = "uncertainty"`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct UncertaintySettings {
    /// Horizontal error at which it wakes up, in metres: the paper's x̃_max. The next angles are
    /// estimated as late, and as few of them, as keep the error below it by the localizer's own
    /// covariance. A set point of the wake-ups, not the error that a drive reaches: where the
    /// covariance is too small or no radio head is in reach, errors are larger. `access-av tune`
    /// finds the set point for an error that is to be reached.
    #[schemars(range(min = 1e-3, max = 1e3))]
    pub bound_m: f64,
    /// Probability that the error is below `bound_m` at a wake-up, if the covariance is right.
    #[schemars(range(min = 0.01, max = 0.999_999))]
    pub confidence: f64,
    /// Shortest time from one wake-up to the next in ms: what the computer needs for an estimate.
    /// Without it, a wake-up may follow at the next SSB.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 3.6e6))]
    pub base_ms: Option<f64>,
    /// Energy of a wake-up before its first angle, in executions: the receiver's, and of receiving a
    /// burst. Without it, what the platform says of both; where it says nothing, 0.5.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1e9))]
    pub wake_up_cost: Option<f64>,
    /// Variance in m² that makes a wake-up for one angle worth its energy before the bound demands
    /// it, and that it must take away where the bound is out of reach; one for several angles must
    /// take away as much more as it costs more.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub least_gain_m2: f64,
    /// How much stronger than by the link budget an SSB may come, in dB. With it the receiver
    /// listens wherever an SSB as strong as that would be worth its energy, and what is sensed
    /// decides; without it all goes by the link budget, which keeps the receiver off for longer.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 40.0))]
    pub snr_headroom_db: Option<f64>,
}

impl Default for UncertaintySettings {
    fn default() -> Self {
        Self {
            bound_m: 0.3,
            confidence: 0.9,
            base_ms: None,
            wake_up_cost: None,
            least_gain_m2: 1.5e-4,
            snr_headroom_db: None,
        }
    }
}

impl WakeUpSettings {
    /// The settings of Algorithm 1, where it is what makes an estimate due.
    pub const fn pid_mut(&mut self) -> Option<&mut PidSettings> {
        match self {
            Self::Pid(pid)
            | Self::Gated(GatedSettings {
                due: DueSettings::Pid(pid),
                ..
            }) => Some(pid),
            Self::Fixed(_) | Self::Gated(_) | Self::Uncertainty(_) => None,
        }
    }

    /// The key of the wake-up time that may be left to the platform.
    pub(super) const fn base_key(&self) -> &'static str {
        match self {
            Self::Fixed(_) => "wake_up.interval_ms",
            Self::Pid(_) | Self::Uncertainty(_) => "wake_up.base_ms",
            Self::Gated(GatedSettings {
                due: DueSettings::Fixed(_),
                ..
            }) => "wake_up.due.interval_ms",
            Self::Gated(_) => "wake_up.due.base_ms",
        }
    }

    /// The wake-up time that a vehicle's settings may leave to its platform, if there is one.
    pub(super) const fn base_ms(&mut self) -> Option<&mut Option<f64>> {
        match self {
            Self::Fixed(fixed) => Some(&mut fixed.interval_ms),
            Self::Pid(pid) => Some(&mut pid.base_ms),
            Self::Gated(gated) => Some(match &mut gated.due {
                DueSettings::Fixed(fixed) => &mut fixed.interval_ms,
                DueSettings::Pid(pid) => &mut pid.base_ms,
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
                let (base_ms, base) = match &gated.due {
                    DueSettings::Fixed(fixed) => (fixed.interval_ms, "wake_up.due.interval_ms"),
                    DueSettings::Pid(pid) => {
                        t_max(pid, "wake_up.due")?;
                        (pid.base_ms, "wake_up.due.base_ms")
                    }
                };
                let base_ms = base_ms.unwrap_or(0.0);
                let latest_ms = gated.latest_ms.unwrap_or(f64::INFINITY);
                let allowed = format!("it must not be below {base}, {base_ms}");
                check.that(
                    latest_ms >= base_ms,
                    "wake_up.latest_ms",
                    latest_ms,
                    &allowed,
                )
            }
            Self::Fixed(_) | Self::Uncertainty(_) => Ok(()),
        }
    }
}
