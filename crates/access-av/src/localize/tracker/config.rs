//! What the tracker assumes of vehicle, road and radio.

use super::motion::{MotionNoise, PathBend};
use super::sighting::ArrayModel;
use crate::localize::integrity::normal_quantile;
use crate::scenario::{Scenario, TrackerSettings};
use crate::world::LaneKeeping;

/// The best that the tracker takes for granted where nothing is said.
const LEAST_ODOMETER_SCALE_STD: f64 = 0.001;
const LEAST_ODOMETER_NOISE_M_PER_SQRT_M: f64 = 0.003;
const LEAST_WANDER_M: f64 = 0.02;

/// Assumptions of the tracker, SI and radians. They are the tracker's, not the world's: the real
/// odometer may be better or worse than assumed here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerConfig {
    /// The array.
    pub array: ArrayModel,
    /// Rician K of the channel as a power ratio: what scatter adds to each angle's variance.
    pub rician_k: f64,
    /// How the vehicle keeps to its lane; used with a map.
    pub lane_keeping: LaneKeeping,
    /// How the path bends; used without a map.
    pub path_bend: PathBend,
    /// Noise of the motion.
    pub noise: MotionNoise,
    /// Standard deviation of the odometer's scale error at the start.
    pub odometer_scale_std: f64,
    /// Surveyed direction of the array's axis from the vehicle's forward axis (rad).
    pub mounting_rad: f64,
    /// Angle random walk of the gyroscope (rad/√s).
    pub yaw_noise_rad_per_sqrt_s: f64,
    /// Standard deviation of its bias at the start (rad/s); 0 takes it as calibrated.
    pub yaw_rate_bias_std_radps: f64,
    /// Standard deviation of the array's mounting angle at the start (rad); 0 takes it as known.
    pub mounting_std_rad: f64,
    /// Standard deviation of the phase offset at the start (rad per element); 0 takes the array
    /// as calibrated.
    pub phase_std_rad: f64,
    /// Largest squared Mahalanobis distance of an innovation that is used (χ², one degree).
    pub gate: f64,
    /// Acceleration to reckon with where odometry is missing (m/s²).
    pub acceleration_mps2: f64,
    /// Acceleration that the vehicle cannot do: the odometer slipped (m/s²).
    pub leap_mps2: f64,
    /// Time between odometry samples above which they are reported as a gap (s).
    pub gap_s: f64,
    /// Speed that no odometry sample can exceed (m/s).
    pub top_speed_mps: f64,
}

impl TrackerConfig {
    /// What `settings` assume, for the scenario's array and carrier.
    pub fn new(scenario: &Scenario, settings: &TrackerSettings) -> Self {
        let (odometer, wander) = (
            &scenario.odometer,
            scenario.motion.lateral_wander.lane_keeping(),
        );
        let array = &scenario.array;
        let rician_k_db = settings.rician_k_db.unwrap_or(scenario.channel.rician_k_db);
        let lane_keeping = LaneKeeping {
            wander_m: settings
                .wander_rms_m
                .unwrap_or(wander.wander_m.max(LEAST_WANDER_M)),
            ..wander
        };
        Self {
            array: ArrayModel {
                elements: array.elements,
                spacing_wavelengths: array.spacing_wavelengths,
                wavelength_m: scenario.ssb.wavelength_m(),
            },
            rician_k: 10f64.powf(0.1 * rician_k_db),
            lane_keeping,
            path_bend: PathBend {
                curvature_per_m: settings.curvature_rms_per_m,
                correlation_m: settings.curvature_correlation_m,
                steering_rad_per_sqrt_m: lane_keeping.steering_rad_per_sqrt_m(),
            },
            noise: MotionNoise {
                odometer_m_per_sqrt_m: settings.odometer_noise_m_per_sqrt_m.unwrap_or(
                    odometer
                        .noise_m_per_sqrt_m
                        .max(LEAST_ODOMETER_NOISE_M_PER_SQRT_M),
                ),
                scale_per_sqrt_m: settings.odometer_scale_walk_per_sqrt_m,
                mounting_rad_per_sqrt_m: settings
                    .mounting_walk_rad_per_sqrt_m
                    .unwrap_or(array.mounting_drift_rad_per_sqrt_m),
                phase_rad_per_sqrt_m: settings
                    .phase_walk_rad_per_sqrt_m
                    .unwrap_or(array.phase_drift_rad_per_sqrt_m),
            },
            odometer_scale_std: settings
                .odometer_scale_std
                .unwrap_or(odometer.scale_error_std.max(LEAST_ODOMETER_SCALE_STD)),
            mounting_rad: array.mounting_angle_rad,
            yaw_noise_rad_per_sqrt_s: settings.gyro_noise_rad_per_sqrt_s,
            yaw_rate_bias_std_radps: settings.gyro_bias_std_radps,
            mounting_std_rad: settings
                .mounting_std_rad
                .unwrap_or(array.mounting_error_std_rad),
            phase_std_rad: settings.phase_std_rad.unwrap_or(array.phase_error_std_rad),
            gate: normal_quantile(0.5 * settings.outlier_probability).powi(2),
            acceleration_mps2: 2.0 * scenario.motion.acceleration_mps2,
            leap_mps2: 10.0 * scenario.motion.acceleration_mps2,
            gap_s: 5.0 / scenario.odometer.rate_hz,
            top_speed_mps: 1.5 * scenario.motion.top_speed_mps(),
        }
    }

    /// Variance (rad²) that scatter adds to an angle `travelled_m` after the radio head's last
    /// one, see [`ArrayModel::correlation`]. A look never counts for more than one: where
    /// successive errors cancel, they do so at one spacing and for a moment.
    pub fn look_variance(&self, travelled_m: f64, toward: f64) -> f64 {
        let correlation = self.array.correlation(travelled_m, toward).max(1.0);
        self.array.scatter_variance(self.rician_k) * correlation
    }

    /// Variance of the curvature of the path (1/m²) where no map tells: it bends with the road, and
    /// back to the middle of the lane.
    pub fn curvature_variance(&self) -> f64 {
        self.path_bend.curvature_per_m.powi(2) + self.lane_keeping.pull_per_m().powi(2)
    }

    /// Variance of the distance (m²) driven during `duration_s` without odometry.
    pub fn coasting_variance(&self, duration_s: f64) -> f64 {
        let error_m = 0.5 * self.acceleration_mps2 * duration_s * duration_s;
        error_m * error_m
    }
}
