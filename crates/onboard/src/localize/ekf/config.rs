//! Filter configuration: models of vehicle, road and radio.

use super::angle_model::{AngleModel, ArrayModel};
use super::motion::{MotionNoise, PathBend, Yaw};
use crate::gaussian::normal_quantile;
use crate::range::RangeModel;
use crate::road::LaneKeeping;
use crate::settings::{DriveKind, LocalizerSettings, RoadSettings, Site, TrackerSettings, Vehicle};

/// Minimum lateral standard deviation of the lane keeping, whatever is configured (m).
const MIN_LANE_RMS_M: f64 = 0.02;

/// Maximum yaw rate of the lane keeping, in standard deviations.
const SIGMAS_OF_SWING: f64 = 5.0;

/// Wavelength of the road's survey errors along the road (m), for surveyed points every few metres.
const SURVEY_WAVELENGTH_M: f64 = 15.0;

/// Filter configuration in SI units and radians, from site and vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EkfConfig {
    /// Drive type.
    pub drive: DriveKind,
    /// Antenna array.
    pub array: ArrayModel,
    /// Rician K of the channel as a power ratio, which determines the scatter variance of each
    /// angle.
    pub rician_k: f64,
    /// Probability that the angle is arbitrary because scatter makes another lobe the maximum;
    /// `None` if the gate rejects more angles anyway.
    pub wrong_lobe: Option<f64>,
    /// Ratio of the measured variance of the angles to the specified one, if it is used.
    pub measured_noise_scale: Option<f64>,
    /// Lane keeping model, with a map.
    pub lane_keeping: LaneKeeping,
    /// Curvature model of the path, without a map.
    pub path_bend: PathBend,
    /// Process noise of the motion.
    pub noise: MotionNoise,
    /// Odometer scale according to the data sheet: distance measured per distance driven.
    pub odometer_scale: f64,
    /// Initial standard deviation of the odometer scale.
    pub odometer_scale_std: f64,
    /// Surveyed direction of the array axis relative to the vehicle's forward axis (rad).
    pub mounting_rad: f64,
    /// Angle random walk of the gyroscope (rad/√s).
    pub yaw_noise_rad_per_sqrt_s: f64,
    /// Yaw rate bias according to the data sheet (rad/s).
    pub yaw_rate_bias_radps: f64,
    /// Initial standard deviation of the yaw rate bias (rad/s); 0 means calibrated.
    pub yaw_rate_bias_std_radps: f64,
    /// Initial standard deviation of the yaw rate scale: that of the track width if two wheels
    /// measure the yaw rate.
    pub yaw_rate_scale_std: f64,
    /// Initial standard deviation of the mounting angle (rad); 0 means known.
    pub mounting_std_rad: f64,
    /// Residual phase offset after calibration (rad per element).
    pub phase_rad: f64,
    /// Initial standard deviation of the phase offset (rad per element); 0 means calibrated.
    pub phase_std_rad: f64,
    /// Standard deviations of mounting angle (rad) and phase (rad per element) that are treated as
    /// exact only because none is specified.
    pub unstated_array_std_rad: [f64; 2],
    /// Standard deviation of the displacement of the whole site plan in x and y (m); 0 means exact.
    pub datum_std_m: f64,
    /// Gate of the squared Mahalanobis distance of an innovation (χ², one degree of freedom).
    pub gate: f64,
    /// Acceleration during gaps of the odometry (m/s²).
    pub acceleration_mps2: f64,
    /// Acceleration above which the odometer has slipped (m/s²).
    pub slip_acceleration_mps2: f64,
    /// Whether the odometer may slip without a jump of the speed.
    pub may_slip: bool,
    /// Standard deviation of a speed measurement (m/s).
    pub speed_noise_mps: f64,
    /// Maximum yaw rate of a sample, and of the lane keeping (rad/s).
    pub top_yaw_rate_radps: f64,
    /// Standard deviation of the angles' time offset (s); 0 means exact times.
    pub angle_time_offset_std_s: f64,
    /// Specified time-correlated noise of the angles.
    pub correlated_noise: CorrelatedNoise,
    /// Prior probability that the angles of a radio head have a time-correlated (multipath) bias; 0 if the filter
    /// estimates no bias.
    pub multipath_bias_probability: f64,
    /// Model of the ranges, if the vehicle measures any.
    pub ranging: Option<RangeModel>,
    /// Minimum interval between odometry samples that is reported as a gap (s).
    pub gap_s: f64,
    /// Maximum speed of an odometry sample (m/s).
    pub top_speed_mps: f64,
}

/// Heading change over which an error of the angles decorrelates (rad).
const FORGETTING_TURN_RAD: f64 = 0.5;

/// Specified time-correlated noise of the electrical angle, independent for each radio head: a
/// first-order Gauss–Markov process over time and distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrelatedNoise {
    /// Maximum time-correlated fraction of each angle's own variance.
    pub share: f64,
    /// Whether this fraction is estimated while driving. It is constant where likelihoods are
    /// compared, because different estimates would weight the same angle differently.
    pub is_found: bool,
    /// Correlation time (s).
    pub correlation_s: f64,
    /// Correlation distance (m).
    pub correlation_m: f64,
}

impl CorrelatedNoise {
    /// Returns the decorrelation after a time (s) and a motion (m, rad), in correlation lengths.
    /// Neither time nor distance alone decorrelates the noise: at standstill the error is constant,
    /// and over distance the sensor is the same. A turn exposes another part of the array to the
    /// radio head.
    pub(super) fn steps(&self, elapsed_s: f64, (travelled_m, turned_rad): (f64, f64)) -> f64 {
        let by_distance =
            travelled_m.abs() / self.correlation_m + turned_rad.abs() / FORGETTING_TURN_RAD;
        (elapsed_s.abs() / self.correlation_s).min(by_distance)
    }

    /// Returns the equivalent independent variance (rad²) of an angle with the specified standard
    /// deviation, after a time and motion since the previous angle of the radio head. With the
    /// correlation `ρ = e^{−Δ}` between successive angles, the mean of many angles has
    /// `(1 + ρ)/(1 − ρ) = coth Δ/2` times the variance of independent ones.
    pub fn variance(&self, sigma_rad: f64, elapsed_s: f64, moved: (f64, f64)) -> f64 {
        let own = sigma_rad * sigma_rad;
        let shared = self.share * own;
        if shared == 0.0 {
            return own;
        }
        let steps = self.steps(elapsed_s, moved);
        // At equal times there is no new information, but the variance must remain finite.
        own - shared + shared / (0.5 * steps.max(1e-4)).tanh()
    }
}

/// Variance of the heading change of a differential drive without a yaw rate, per metre and per
/// second: half a radian (rad²).
const UNKNOWN_TURN_RAD2: f64 = 0.25;

/// Angle random walk (rad/√s) and bias (rad/s) of an unspecified gyroscope.
const USUAL_GYROSCOPE: [f64; 2] = [1e-3, 1e-3];
/// Angle random walk (rad/√s) and bias (rad/s) of an unspecified yaw rate of two wheels.
const USUAL_WHEELS_TURN: [f64; 2] = [0.05, 0.01];

/// Standard deviations of an unspecified array: mounting angle (rad) and phase (rad per element).
const UNSTATED_ARRAY_STD_RAD: [f64; 2] = [0.005, 0.02];

/// Default noise of a drive type, for unspecified values and zeros.
struct Usual {
    odometer_scale_std: f64,
    odometer_m_per_sqrt_m: f64,
    /// Noise over time: wheels start with a delay, creep, and have a non-zero output at standstill.
    odometer_m_per_sqrt_s: f64,
    /// Wheel grip varies with the floor.
    scale_per_sqrt_m: f64,
    mounting_std_rad: f64,
    /// At walking pace, a time offset is observable in turns only.
    angle_time_offset_std_s: f64,
    /// Prior probability of a time-correlated (multipath) bias of a radio head's angles.
    multipath_bias_probability: f64,
}

/// Road vehicle, and the minimum noise of any odometer.
const ROAD: Usual = Usual {
    odometer_scale_std: 0.001,
    odometer_m_per_sqrt_m: 0.003,
    odometer_m_per_sqrt_s: 0.0,
    scale_per_sqrt_m: 0.0,
    mounting_std_rad: 0.0,
    angle_time_offset_std_s: 0.0,
    // Each of the four levels of a bias, the smallest of which is a calibration residual, is
    // equally probable.
    multipath_bias_probability: 0.75,
};

/// Differential drive.
const DIFFERENTIAL: Usual = Usual {
    odometer_scale_std: 0.05,
    odometer_m_per_sqrt_m: 0.05,
    odometer_m_per_sqrt_s: 0.02,
    scale_per_sqrt_m: 0.03,
    mounting_std_rad: 0.02,
    angle_time_offset_std_s: 0.1,
    // Wheel slip or a wrong heading shifts the angles of a small robot like a bias does.
    multipath_bias_probability: 0.0,
};

/// Probability that a correct angle is rejected as an outlier: one angle in 10 000, a few minutes
/// at 50 angles per second.
const OUTLIER_PROBABILITY: f64 = 1e-4;

/// Maximum yaw rate in rad/s: 230 degrees per second, above that of factory vehicles.
const TOP_YAW_RATE_RADPS: f64 = 4.0;

impl EkfConfig {
    /// Creates the configuration of a vehicle at a site.
    pub fn new(site: &Site, vehicle: &Vehicle) -> Self {
        let settings = match vehicle.localizer {
            LocalizerSettings::Tracker(settings) => settings,
            LocalizerSettings::DeadReckoning(_) => TrackerSettings::default(),
        };
        let (odometer, array) = (&vehicle.odometer, &vehicle.array);
        let keeping = vehicle.lane_keeping.process();
        let survey_std_m = site.road.as_ref().map_or(0.0, RoadSettings::survey_std_m);
        let lane_keeping = LaneKeeping {
            rms_m: keeping.rms_m.max(MIN_LANE_RMS_M),
            ..keeping
        }
        .and(&LaneKeeping {
            rms_m: survey_std_m,
            wavelength_m: SURVEY_WAVELENGTH_M,
            ..keeping
        });
        let gyroscope = vehicle.gyroscope.as_ref();
        let wheels = vehicle.drive == DriveKind::Differential;
        let usual_turn = if wheels || odometer.track_width_m.is_some() {
            USUAL_WHEELS_TURN
        } else {
            USUAL_GYROSCOPE
        };
        let [yaw_noise, yaw_bias_std] = gyroscope.map_or(usual_turn, |gyroscope| {
            [gyroscope.noise_rad_per_sqrt_s, gyroscope.bias_std_radps]
        });
        let usual = if wheels { DIFFERENTIAL } else { ROAD };
        let or_usual = |specified: f64, of: fn(&Usual) -> f64| {
            if specified == 0.0 {
                of(&usual)
            } else {
                specified.max(of(&ROAD))
            }
        };
        let odometer_scale_std = or_usual(odometer.scale_std, |it| it.odometer_scale_std);
        // A data sheet with scale and noise is complete; one of them alone does not make the rest
        // exact.
        let is_specified = odometer.scale_std > 0.0 && odometer.noise_m_per_sqrt_m > 0.0;
        let scale_walk = if is_specified {
            0.0
        } else {
            usual.scale_per_sqrt_m
        };
        // If the track is wider than specified, the measured heading change is smaller than the
        // true one.
        let track_share = |width_m| odometer.track_width_std_m / width_m;
        let track_share = odometer.track_width_m.map_or(0.0, track_share);
        let track_width_m = odometer.track_width_m.filter(|_| wheels);
        let spin_radps =
            track_width_m.map_or(0.0, |width_m| 2.0 * vehicle.top_speed_mps() / width_m);
        let mounting_is_unstated = array.mounting_std_rad.is_none() && !wheels;
        let phase_is_unstated = array.phase_std_rad.is_none() && array.shape.is_row();
        let unstated = [
            (mounting_is_unstated, UNSTATED_ARRAY_STD_RAD[0]),
            (phase_is_unstated, UNSTATED_ARRAY_STD_RAD[1]),
        ]
        .map(|(is_unstated, std_rad)| if is_unstated { std_rad } else { 0.0 });
        let receiver = &vehicle.receiver;
        // A vehicle without integrity monitoring trusts its sources, unless a probability is
        // specified.
        let is_monitored = vehicle.integrity_monitor().is_some();
        let usual_multipath_bias_probability = if is_monitored {
            usual.multipath_bias_probability
        } else {
            0.0
        };
        let multipath_bias_probability =
            (receiver.multipath_bias_probability).unwrap_or(usual_multipath_bias_probability);
        let mut config = Self {
            drive: vehicle.drive,
            array: ArrayModel {
                measurand: array.measurand(),
                wavelength_m: site.wavelength_m(),
                position_m: array.position_m,
                position_std_m: array.position_std_m,
            },
            rician_k: 10f64.powf(0.1 * site.rician_k_db),
            wrong_lobe: None,
            measured_noise_scale: None,
            lane_keeping,
            path_bend: PathBend {
                curvature_per_m: settings.curvature_rms_per_m,
                correlation_m: settings.curvature_correlation_m,
                steering_rad_per_sqrt_m: lane_keeping.steering_rad_per_sqrt_m(),
            },
            noise: MotionNoise {
                odometer_m_per_sqrt_m: or_usual(odometer.noise_m_per_sqrt_m, |it| {
                    it.odometer_m_per_sqrt_m
                }),
                odometer_m_per_sqrt_s: or_usual(odometer.noise_m_per_sqrt_s, |it| {
                    it.odometer_m_per_sqrt_s
                }),
                scale_per_sqrt_m: scale_walk,
                yaw_bias_radps_per_sqrt_s: gyroscope
                    .map_or(0.0, |it| it.bias_walk_radps_per_sqrt_s),
                mounting_rad_per_sqrt_m: array.mounting_drift_rad_per_sqrt_m,
                phase_rad_per_sqrt_m: array.phase_drift_rad_per_sqrt_m,
            },
            odometer_scale: odometer.scale,
            odometer_scale_std,
            mounting_rad: array.mounting_rad,
            yaw_noise_rad_per_sqrt_s: yaw_noise,
            yaw_rate_bias_radps: gyroscope.map_or(0.0, |gyroscope| gyroscope.bias_radps),
            yaw_rate_bias_std_radps: yaw_bias_std,
            yaw_rate_scale_std: if wheels { odometer_scale_std } else { 0.0 }.hypot(track_share),
            mounting_std_rad: array.mounting_std_rad.unwrap_or(usual.mounting_std_rad),
            phase_rad: array.phase_rad,
            phase_std_rad: array.phase_std_rad.unwrap_or(0.0),
            unstated_array_std_rad: unstated,
            datum_std_m: 0.0,
            gate: normal_quantile(0.5 * OUTLIER_PROBABILITY).powi(2),
            acceleration_mps2: 2.0 * vehicle.acceleration_mps2,
            slip_acceleration_mps2: 10.0 * vehicle.acceleration_mps2,
            may_slip: false,
            speed_noise_mps: odometer.speed_noise_mps,
            // A fast oscillation of the lane keeping can exceed the usual maximum, and so can a small robot that turns on the
            // spot.
            top_yaw_rate_radps: TOP_YAW_RATE_RADPS
                .max(SIGMAS_OF_SWING * keeping.pull_per_m() * vehicle.top_speed_mps())
                .max(spin_radps),
            angle_time_offset_std_s: receiver
                .angle_time_offset_std_s
                .unwrap_or(usual.angle_time_offset_std_s),
            correlated_noise: CorrelatedNoise {
                share: receiver.correlated_noise_fraction.unwrap_or(0.0),
                is_found: true,
                correlation_s: receiver.noise_correlation_time_s,
                correlation_m: receiver.noise_correlation_distance_m,
            },
            multipath_bias_probability,
            ranging: (vehicle.ranging.as_ref())
                .map(|it| RangeModel::new(it, array, site.wavelength_m())),
            gap_s: 5.0 / odometer.rate_hz,
            top_speed_mps: 1.5 * vehicle.top_speed_mps(),
        };
        config.set_noise_scale(None);
        config
    }

    /// Returns the assumed ratio of the angles' variance to the specified one.
    pub fn noise_scale(&self) -> f64 {
        self.measured_noise_scale.unwrap_or(1.0)
    }

    /// Sets the ratio of the angles' variance to the specified one, as with a lower Rician K;
    /// `None` for the specified variance.
    pub fn set_noise_scale(&mut self, ratio: Option<f64>) {
        self.measured_noise_scale = ratio;
        let rician_k = self.rician_k / self.noise_scale();
        let wrong_lobe = (self.array.measurand).wrong_lobe_probability(rician_k);
        self.wrong_lobe = Some(wrong_lobe).filter(|&it| it > OUTLIER_PROBABILITY);
    }

    /// Returns the maximum ratio of the variance: that of scatter as strong as the direct wave (a
    /// Rician K of 0 dB). Larger deviations are not scatter around a line of sight, and averaging
    /// does not remove them.
    pub const fn max_noise_scale(&self) -> f64 {
        self.rician_k.max(1.0)
    }

    /// Returns the configuration without bias estimation and with the specified noise of the angles.
    #[must_use]
    pub fn as_stated(mut self) -> Self {
        self.set_noise_scale(None);
        self.multipath_bias_probability = 0.0;
        self
    }

    /// Whether a time-correlated bias of the angles is estimated.
    pub const fn estimates_bias(&self) -> bool {
        self.multipath_bias_probability > 0.0
    }

    /// Returns the measured ratio of the variance relative to the ratio that the filter assumes.
    pub fn unexpected_noise(&self, measured: f64) -> f64 {
        let expects = self.measured_noise_scale.is_some() || self.estimates_bias();
        if expects { 1.0 } else { measured }
    }

    /// Returns the scatter variance (rad²) of an angle `travelled_m` after the previous one of the
    /// radio head, see [`ArrayModel::correlation`]. It is at least that of one angle: cancelling
    /// errors occur at one spacing and briefly. [`AngleModel`] contains the aperture and the cosine
    /// `direction_cosine`.
    pub fn scatter_variance(&self, travelled_m: f64, aperture: f64, direction_cosine: f64) -> f64 {
        let scatter = (self.array.measurand).scatter_variance(self.rician_k, aperture);
        let correlation = self.array.correlation(travelled_m, direction_cosine);
        self.noise_scale() * scatter * correlation.max(1.0)
    }

    /// Returns the variance that several angles share: scatter, and the survey errors, which are
    /// constant until the radio head is received from another side, after about its distance.
    pub fn shared_variance(&self, travelled_m: f64, angle_model: &AngleModel) -> f64 {
        let mut variance = self.scatter_variance(
            travelled_m,
            angle_model.aperture,
            angle_model.direction_cosine,
        );
        if angle_model.survey_variance > 0.0 {
            // At standstill there is no new information, but the variance must remain finite.
            let same_side = angle_model.range_m / travelled_m.abs().max(1e-9);
            variance += angle_model.survey_variance * same_side.max(1.0);
        }
        variance
    }

    /// Returns the variance of the path curvature (1/m²) without a map, including the lane keeping.
    pub fn curvature_variance(&self) -> f64 {
        self.path_bend.curvature_per_m.powi(2) + self.lane_keeping.pull_per_m().powi(2)
    }

    /// Returns the unknown heading change of a differential drive without a yaw rate.
    pub fn unknown_turn(&self, length_m: f64, duration_s: f64) -> Yaw {
        Yaw {
            turn_rad: self.yaw_rate_bias_radps * duration_s,
            duration_s,
            is_measured: false,
            variance: UNKNOWN_TURN_RAD2 * length_m.abs() + UNKNOWN_TURN_RAD2 * duration_s,
        }
    }

    /// Returns the variance of the distance (m²) driven during `duration_s` without odometry.
    pub fn coasting_variance(&self, duration_s: f64) -> f64 {
        let error_m = 0.5 * self.acceleration_mps2 * duration_s * duration_s;
        error_m * error_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Shipped, TomlFile as _};

    /// With one wheel forwards and the other one backwards at the top speed `v`, the yaw rate is `2 v / track width`.
    #[test]
    fn a_small_robot_turns_on_the_spot_faster_than_a_carrier() {
        let site = Site::from_library("yard", &Shipped).unwrap();
        let top = |track_width_m: f64| {
            let text = format!(
                "name = \"robot\"\ndrive = \"differential\"\ntop_speed_kmh = 3.6\n\
                 odometer = {{ track_width_m = {track_width_m:?} }}"
            );
            let vehicle = Vehicle::from_toml(&text, "robot.toml", &Shipped).unwrap();
            EkfConfig::new(&site, &vehicle).top_yaw_rate_radps
        };
        assert_eq!([top(0.16), top(0.8)], [12.5, TOP_YAW_RATE_RADPS]);
    }
}
