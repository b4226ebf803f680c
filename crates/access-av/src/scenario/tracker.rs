//! What the tracker is told of vehicle, road and radio. It need not be the truth: that is in
//! `[odometer]`, `[motion]` and `[channel]`. What is not given here is taken from there as from a
//! data sheet, but never as better than the best that wheels and lanes can be.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Check, ScenarioError};

/// `[localizer]` with `kind = "tracker"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerSettings {
    /// Whether the road's course is known to it.
    pub map: bool,
    /// Assumed standard deviation of the odometer's scale error; without it, the odometer's, but
    /// at least 0.001.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub odometer_scale_std: Option<f64>,
    /// Assumed noise of the odometer, in metres per root of a metre; without it, the odometer's,
    /// but at least 0.003.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub odometer_noise_m_per_sqrt_m: Option<f64>,
    /// Assumed lateral wander in metres (root mean square), used with a map; without it, the
    /// motion's, but at least 0.02.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wander_rms_m: Option<f64>,
    /// Assumed curvature of the path in 1/m (root mean square); without a map.
    pub curvature_rms_per_m: f64,
    /// Distance over which the curvature is forgotten, in metres.
    pub curvature_correlation_m: f64,
    /// Assumed Rician K in dB; without it, the channel's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rician_k_db: Option<f64>,
    /// Assumed angle random walk of the gyroscope in rad/√s, where there is one.
    pub gyro_noise_rad_per_sqrt_s: f64,
    /// Assumed standard deviation of its bias in rad/s.
    pub gyro_bias_std_radps: f64,
    /// How far the array's mounting angle may be off, in radians; without it, what the array's
    /// errors say. 0 takes it as surveyed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting_std_rad: Option<f64>,
    /// How it walks, in radians per root of a metre driven; without it, what the array's drift says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting_walk_rad_per_sqrt_m: Option<f64>,
    /// How far its phase calibration may be off, in radians per element; without it, what the
    /// array's errors say. 0 takes it as exact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_std_rad: Option<f64>,
    /// How it walks, in radians per root of a metre driven; without it, what the array's drift says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_walk_rad_per_sqrt_m: Option<f64>,
    /// How the odometer's scale walks, per root of a metre driven.
    pub odometer_scale_walk_per_sqrt_m: f64,
    /// Probability with which a good angle is taken for an outlier.
    pub outlier_probability: f64,
    /// Whether it mistrusts its sources and states a protection level.
    pub integrity: bool,
    /// Protection level in metres above which the position is not to be relied on.
    pub alert_limit_m: f64,
    /// Probability with which the error may exceed the protection level.
    pub integrity_risk: f64,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self {
            map: true,
            odometer_scale_std: None,
            odometer_noise_m_per_sqrt_m: None,
            wander_rms_m: None,
            curvature_rms_per_m: 0.001,
            curvature_correlation_m: 400.0,
            rician_k_db: None,
            gyro_noise_rad_per_sqrt_s: 1e-3,
            gyro_bias_std_radps: 1e-3,
            mounting_std_rad: None,
            mounting_walk_rad_per_sqrt_m: None,
            phase_std_rad: None,
            phase_walk_rad_per_sqrt_m: None,
            odometer_scale_walk_per_sqrt_m: 0.0,
            outlier_probability: 1e-4,
            integrity: false,
            alert_limit_m: 1.5,
            integrity_risk: 8e-4,
        }
    }
}

impl TrackerSettings {
    pub(super) fn check(&self, check: &Check<'_>) -> Result<(), ScenarioError> {
        for (key, value) in [
            (
                "localizer.odometer_scale_std",
                self.odometer_scale_std.unwrap_or_default(),
            ),
            (
                "localizer.odometer_noise_m_per_sqrt_m",
                self.odometer_noise_m_per_sqrt_m.unwrap_or_default(),
            ),
            (
                "localizer.wander_rms_m",
                self.wander_rms_m.unwrap_or_default(),
            ),
            ("localizer.curvature_rms_per_m", self.curvature_rms_per_m),
            (
                "localizer.gyro_noise_rad_per_sqrt_s",
                self.gyro_noise_rad_per_sqrt_s,
            ),
            ("localizer.gyro_bias_std_radps", self.gyro_bias_std_radps),
            (
                "localizer.mounting_std_rad",
                self.mounting_std_rad.unwrap_or_default(),
            ),
            (
                "localizer.mounting_walk_rad_per_sqrt_m",
                self.mounting_walk_rad_per_sqrt_m.unwrap_or_default(),
            ),
            (
                "localizer.phase_std_rad",
                self.phase_std_rad.unwrap_or_default(),
            ),
            (
                "localizer.phase_walk_rad_per_sqrt_m",
                self.phase_walk_rad_per_sqrt_m.unwrap_or_default(),
            ),
            (
                "localizer.odometer_scale_walk_per_sqrt_m",
                self.odometer_scale_walk_per_sqrt_m,
            ),
        ] {
            check.not_negative(key, value)?;
        }
        check.positive(
            "localizer.curvature_correlation_m",
            self.curvature_correlation_m,
        )?;
        check.between(
            "localizer.rician_k_db",
            self.rician_k_db.unwrap_or_default(),
            -30.0,
            200.0,
        )?;
        check.positive("localizer.alert_limit_m", self.alert_limit_m)?;
        check.between("localizer.integrity_risk", self.integrity_risk, 1e-12, 0.5)?;
        check.between(
            "localizer.outlier_probability",
            self.outlier_probability,
            1e-12,
            0.5,
        )
    }
}
