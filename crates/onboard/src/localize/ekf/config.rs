//! What the filter assumes of vehicle, road and radio.

use super::angle_model::{AngleModel, ArrayModel};
use super::motion::{MotionNoise, PathBend, Yaw};
use crate::gaussian::normal_quantile;
use crate::road::LaneKeeping;
use crate::settings::{DriveKind, LocalizerSettings, RoadSettings, Site, TrackerSettings, Vehicle};

/// The best lane keeping that the filter takes for granted, whatever is said (m).
const LEAST_LANE_RMS_M: f64 = 0.02;

/// It turns back to the middle of the lane with a yaw rate within so many deviations.
const SIGMAS_OF_SWING: f64 = 5.0;

/// Wavelength along the road of the errors of its survey, of points every few metres (m).
const SURVEY_WAVELENGTH_M: f64 = 15.0;

/// Assumptions of the filter, SI and radians: what site and vehicle state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EkfConfig {
    /// What the vehicle's kinematics allow.
    pub drive: DriveKind,
    /// The array.
    pub array: ArrayModel,
    /// Rician K of the channel as a power ratio: what scatter adds to each angle's variance.
    pub rician_k: f64,
    /// Probability that an angle is any, as scatter made another lobe the highest; none where the gate
    /// refuses so many anyway.
    pub wrong_lobe: Option<f64>,
    /// How many sound angles the gate refuses, as a share.
    pub outlier_probability: f64,
    /// Measured variance of the angles over what is stated, where that is believed.
    pub heard_noise_ratio: Option<f64>,
    /// How the vehicle keeps to its lane; used with a map.
    pub lane_keeping: LaneKeeping,
    /// How the path bends; used without a map.
    pub path_bend: PathBend,
    /// Noise of the motion.
    pub noise: MotionNoise,
    /// Metres that the odometer reads per metre driven, by its data sheet.
    pub odometer_scale: f64,
    /// Standard deviation of that at the start.
    pub odometer_scale_std: f64,
    /// Surveyed direction of the array's axis from the vehicle's forward axis (rad).
    pub mounting_rad: f64,
    /// Angle random walk of the gyroscope (rad/√s).
    pub yaw_noise_rad_per_sqrt_s: f64,
    /// Its bias by the data sheet (rad/s).
    pub yaw_rate_bias_radps: f64,
    /// Standard deviation of that at the start (rad/s); 0 takes it as calibrated.
    pub yaw_rate_bias_std_radps: f64,
    /// Standard deviation of the yaw rate's scale at the start: where two wheels tell the turn,
    /// that of their distance.
    pub yaw_rate_scale_std: f64,
    /// Standard deviation of the array's mounting angle at the start (rad); 0 takes it as known.
    pub mounting_std_rad: f64,
    /// Phase offset that calibration is known to have left (rad per element).
    pub phase_rad: f64,
    /// Standard deviation of that at the start (rad per element); 0 takes the array
    /// as calibrated.
    pub phase_std_rad: f64,
    /// What mounting angle (rad) and phase (rad per element) may be off by that are taken as exact only because
    /// nothing is stated: standard deviations.
    pub unstated_array_std_rad: [f64; 2],
    /// Standard deviation of how far the site plan as a whole is off, in x and y (m); 0 takes it as exact.
    pub datum_std_m: f64,
    /// Largest squared Mahalanobis distance of an innovation that is used (χ², one degree).
    pub gate: f64,
    /// Acceleration to reckon with where odometry is missing (m/s²).
    pub acceleration_mps2: f64,
    /// Acceleration that the vehicle cannot do: the odometer slipped (m/s²).
    pub slip_acceleration_mps2: f64,
    /// Whether the odometer may slip without a jump of the speed.
    pub may_slip: bool,
    /// Standard deviation of a reading of the speed (m/s).
    pub speed_noise_mps: f64,
    /// Yaw rate that no sample can exceed (rad/s), nor the vehicle as it keeps its lane.
    pub top_yaw_rate_radps: f64,
    /// Random walk of the heading by what tells the yaw rate, per distance (rad/√m) and per angle
    /// turned (rad/√rad).
    pub yaw_noise_rad_per_sqrt_m: f64,
    /// See there.
    pub yaw_noise_rad_per_sqrt_rad: f64,
    /// Standard deviation of the angles' lateness (s); 0 takes their times as exact.
    pub lateness_std_s: f64,
    /// The bias of the angles that is stated.
    pub phase_bias: PhaseBias,
    /// Prior probability that the angles of a radio head have a time-correlated (multipath) bias; 0 if the filter
    /// estimates no bias.
    pub bias_probability: f64,
    /// Time between odometry samples above which they are reported as a gap (s).
    pub gap_s: f64,
    /// Speed that no odometry sample can exceed (m/s).
    pub top_speed_mps: f64,
}

/// Turn over which an error of the angles is forgotten (rad).
const FORGETTING_TURN_RAD: f64 = 0.5;

/// A stated bias of the electrical angle, each radio head's its own: a
/// first-order Gauss–Markov process over time and distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseBias {
    /// Stationary deviation (rad).
    pub std_rad: f64,
    /// Share of each angle's own variance that is of this kind, at most.
    pub share: f64,
    /// Whether it is found while driving how much of that is. Where likelihoods are compared it is not: by what each finds,
    /// one angle would count for more here than there.
    pub is_found: bool,
    /// Time over which it is forgotten (s).
    pub correlation_s: f64,
    /// Distance over which it is forgotten (m).
    pub correlation_m: f64,
}

impl PhaseBias {
    /// How much it has been forgotten so long and so far after (s; m, rad), in time constants. Neither time nor way alone
    /// forgets: a vehicle that stands sees the same error, and one that drives on is not another's sensor. Turning shows the
    /// radio head to another part of it.
    pub(super) fn steps(&self, elapsed_s: f64, (travelled_m, turned_rad): (f64, f64)) -> f64 {
        let by_way =
            travelled_m.abs() / self.correlation_m + turned_rad.abs() / FORGETTING_TURN_RAD;
        (elapsed_s.abs() / self.correlation_s).min(by_way)
    }

    /// Variance (rad²) of an angle of the stated deviation, so long and so far after the radio head's
    /// last one, as if angles were independent: with the correlation `ρ = e^{−Δ}` between neighbours
    /// the mean of many angles has `(1 + ρ)/(1 − ρ) = coth Δ/2` times the variance that independent
    /// ones would leave it.
    pub fn variance(&self, sigma_rad: f64, elapsed_s: f64, moved: (f64, f64)) -> f64 {
        let own = sigma_rad * sigma_rad;
        let (stays, shared) = (self.std_rad * self.std_rad, self.share * own);
        if stays + shared == 0.0 {
            return own;
        }
        let steps = self.steps(elapsed_s, moved);
        // At the same instant nothing new is learnt, but the variance must stay a number.
        own - shared + (stays + shared) / (0.5 * steps.max(1e-4)).tanh()
    }
}

/// How a vehicle with differential drive turns where no yaw rate tells, per metre driven and per second: by half a
/// radian (rad²).
const UNKNOWN_TURN_RAD2: f64 = 0.25;

/// Angle random walk (rad/√s) and bias (rad/s) of a yaw rate that nothing is stated of: a gyroscope's, and that of two
/// wheels.
const USUAL_GYROSCOPE: [f64; 2] = [1e-3, 1e-3];
const USUAL_WHEELS_TURN: [f64; 2] = [0.05, 0.01];

/// An array of which nothing is stated: mounting angle (rad) and phase (rad per element).
const UNSTATED_ARRAY_STD_RAD: [f64; 2] = [0.005, 0.02];

/// What is assumed where nothing is stated, which a zero is, too.
struct Usual {
    odometer_scale_std: f64,
    odometer_m_per_sqrt_m: f64,
    /// Not only over the way: wheels start late, creep, and what they read as they stand is not always zero.
    odometer_m_per_sqrt_s: f64,
    /// Wheels grip as the floor lets them.
    scale_per_sqrt_m: f64,
    mounting_std_rad: f64,
    /// At walking pace turns show it.
    lateness_std_s: f64,
    /// Prior probability of a time-correlated (multipath) bias of a radio head's angles.
    bias_probability: f64,
}

/// On a road, and the best that is taken for granted of any odometer.
const ROAD: Usual = Usual {
    odometer_scale_std: 0.001,
    odometer_m_per_sqrt_m: 0.003,
    odometer_m_per_sqrt_s: 0.0,
    scale_per_sqrt_m: 0.0,
    mounting_std_rad: 0.0,
    lateness_std_s: 0.0,
    // Each of the four sizes of a bias, the smallest of which is what calibration leaves, is equally probable.
    bias_probability: 0.75,
};

/// With differential drive.
const DIFFERENTIAL: Usual = Usual {
    odometer_scale_std: 0.05,
    odometer_m_per_sqrt_m: 0.05,
    odometer_m_per_sqrt_s: 0.02,
    scale_per_sqrt_m: 0.03,
    mounting_std_rad: 0.02,
    lateness_std_s: 0.1,
    // A wheel slip or a wrong heading shifts the angles of a small robot like a bias does.
    bias_probability: 0.0,
};

impl EkfConfig {
    /// What a filter on a vehicle assumes at a site.
    pub fn new(site: &Site, vehicle: &Vehicle) -> Self {
        let settings = match vehicle.localizer {
            LocalizerSettings::Tracker(settings) => settings,
            LocalizerSettings::DeadReckoning(_) => TrackerSettings::default(),
        };
        let (odometer, array) = (&vehicle.odometer, &vehicle.array);
        let keeping = vehicle.lane_keeping.process();
        let survey_std_m = site.road.as_ref().map_or(0.0, RoadSettings::survey_std_m);
        let lane_keeping = LaneKeeping {
            rms_m: keeping.rms_m.max(LEAST_LANE_RMS_M),
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
        let or_usual = |stated: f64, of: fn(&Usual) -> f64| {
            if stated == 0.0 {
                of(&usual)
            } else {
                stated.max(of(&ROAD))
            }
        };
        let odometer_scale_std = or_usual(odometer.scale_std, |it| it.odometer_scale_std);
        // A data sheet that tells scale and noise tells all; one of them alone does not make the rest exact.
        let is_told = odometer.scale_std > 0.0 && odometer.noise_m_per_sqrt_m > 0.0;
        let walk: fn(&Usual) -> f64 = if is_told {
            |_| 0.0
        } else {
            |it| it.scale_per_sqrt_m
        };
        // A track that is wider than stated turns less.
        let track_share = |width_m| odometer.track_width_std_m / width_m;
        let track_share = odometer.track_width_m.map_or(0.0, track_share);
        let mounting_is_unstated = array.mounting_std_rad.is_none() && !wheels;
        let phase_is_unstated = array.phase_std_rad.is_none() && array.shape.is_row();
        let unstated = [
            (mounting_is_unstated, UNSTATED_ARRAY_STD_RAD[0]),
            (phase_is_unstated, UNSTATED_ARRAY_STD_RAD[1]),
        ]
        .map(|(is_unstated, std_rad)| if is_unstated { std_rad } else { 0.0 });
        let receiver = &vehicle.receiver;
        // A vehicle without integrity monitoring trusts its sources, unless a probability is given.
        let is_monitored = vehicle.integrity_monitor().is_some();
        let usual_bias_probability = if is_monitored {
            usual.bias_probability
        } else {
            0.0
        };
        let bias_probability = (receiver.phase_bias_probability).unwrap_or(usual_bias_probability);
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
            outlier_probability: settings.outlier_probability,
            heard_noise_ratio: None,
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
                scale_per_sqrt_m: or_usual(settings.odometer_scale_walk_per_sqrt_m, walk),
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
            gate: normal_quantile(0.5 * settings.outlier_probability).powi(2),
            acceleration_mps2: 2.0 * vehicle.acceleration_mps2,
            slip_acceleration_mps2: 10.0 * vehicle.acceleration_mps2,
            may_slip: false,
            speed_noise_mps: odometer.speed_noise_mps,
            // A vehicle that is said to swing fast does so, whatever else it is said not to exceed.
            top_yaw_rate_radps: (vehicle.top_yaw_rate_radps)
                .max(SIGMAS_OF_SWING * keeping.pull_per_m() * vehicle.top_speed_mps()),
            yaw_noise_rad_per_sqrt_m: gyroscope.map_or(0.0, |it| it.noise_rad_per_sqrt_m),
            yaw_noise_rad_per_sqrt_rad: gyroscope.map_or(0.0, |it| it.noise_rad_per_sqrt_rad),
            lateness_std_s: receiver.lateness_std_s.unwrap_or(usual.lateness_std_s),
            phase_bias: PhaseBias {
                std_rad: receiver.phase_bias_std_rad,
                share: receiver.phase_bias_share.unwrap_or(0.0),
                is_found: true,
                correlation_s: receiver.phase_bias_correlation_s,
                correlation_m: receiver.phase_bias_correlation_m,
            },
            bias_probability,
            gap_s: 5.0 / odometer.rate_hz,
            top_speed_mps: 1.5 * vehicle.top_speed_mps(),
        };
        config.set_noise_ratio(None);
        config
    }

    /// How many times the variance that is stated the angles are taken to have.
    pub fn noise_ratio(&self) -> f64 {
        self.heard_noise_ratio.unwrap_or(1.0)
    }

    /// Believes that the angles have so many times the variance that is stated, as of less Rician K; or what is
    /// stated.
    pub fn set_noise_ratio(&mut self, ratio: Option<f64>) {
        self.heard_noise_ratio = ratio;
        let rician_k = self.rician_k / self.noise_ratio();
        let wrong_lobe = (self.array.measurand).wrong_lobe_probability(rician_k);
        self.wrong_lobe = Some(wrong_lobe).filter(|&it| it > self.outlier_probability);
    }

    /// How many times the stated variance noise may have: until scatter is as strong as the direct wave (a Rician K of
    /// 0 dB). What strays farther does not scatter about a line of sight, and is not averaged out.
    pub const fn most_noise_ratio(&self) -> f64 {
        self.rician_k.max(1.0)
    }

    /// Returns the configuration without bias estimation and with the specified noise of the angles.
    #[must_use]
    pub fn as_stated(mut self) -> Self {
        self.set_noise_ratio(None);
        self.bias_probability = 0.0;
        self
    }

    /// Whether a time-correlated bias of the angles is estimated.
    pub const fn estimates_bias(&self) -> bool {
        self.bias_probability > 0.0
    }

    /// How many times the variance that it expects angles have that are heard to have so many times what is stated.
    pub fn unexpected_noise(&self, heard: f64) -> f64 {
        let expects = self.heard_noise_ratio.is_some() || self.estimates_bias();
        if expects { 1.0 } else { heard }
    }

    /// Variance (rad²) by scatter of an angle `travelled_m` after the radio head's last one, see
    /// [`ArrayModel::correlation`]. An angle never counts for more than one: where successive errors
    /// cancel, they do so at one spacing and for a moment.
    /// [`AngleModel`] tells the aperture and the cosine `toward`.
    pub fn scatter_variance(&self, travelled_m: f64, aperture: f64, toward: f64) -> f64 {
        let scatter = (self.array.measurand).scatter_variance(self.rician_k, aperture);
        let correlation = self.array.correlation(travelled_m, toward);
        self.noise_ratio() * scatter * correlation.max(1.0)
    }

    /// The same by all that several angles share: scatter and the surveys, whose errors stay until
    /// the radio head is seen from another side, after about its distance.
    pub fn shared_variance(&self, travelled_m: f64, angle_model: &AngleModel) -> f64 {
        let mut variance =
            self.scatter_variance(travelled_m, angle_model.aperture, angle_model.toward);
        if angle_model.survey_variance > 0.0 {
            // Standing still nothing new is learnt, but the variance must stay a number.
            let same_side = angle_model.range_m / travelled_m.abs().max(1e-9);
            variance += angle_model.survey_variance * same_side.max(1.0);
        }
        variance
    }

    /// Variance of the curvature of the path (1/m²) where no map tells: it bends with the road, and
    /// back to the middle of the lane.
    pub fn curvature_variance(&self) -> f64 {
        self.path_bend.curvature_per_m.powi(2) + self.lane_keeping.pull_per_m().powi(2)
    }

    /// The turn of a vehicle with differential drive of which no yaw rate tells: any.
    pub fn unknown_turn(&self, length_m: f64, duration_s: f64) -> Yaw {
        Yaw {
            turn_rad: self.yaw_rate_bias_radps * duration_s,
            duration_s,
            is_told: false,
            variance: UNKNOWN_TURN_RAD2 * length_m.abs() + UNKNOWN_TURN_RAD2 * duration_s,
        }
    }

    /// Variance of the distance (m²) driven during `duration_s` without odometry.
    pub fn coasting_variance(&self, duration_s: f64) -> f64 {
        let error_m = 0.5 * self.acceleration_mps2 * duration_s * duration_s;
        error_m * error_m
    }
}
