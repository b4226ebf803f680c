//! Posterior Cramér–Rao bound of the localization error on a route.
//!
//! For a state with additive Gaussian process and measurement noise, the posterior information
//! obeys (Tichavský, Muravchik and Nehorai 1998)
//! `J⁺ = (F J⁻¹ Fᵀ + Q)⁻¹ + Σ Hᵀ R⁻¹ H`,
//! with the Jacobians evaluated at the true states. The inverse of `J` is a lower bound of the mean
//! squared error of every estimator. The true path is the lane centre, because a lateral wander of
//! centimetres does not change the geometry. The whole road is assumed to be surveyed.
//!
//! The variance of an angle is the sum of two terms. The thermal term is the Cramér–Rao bound of
//! the snapshots at the SNR of the link budget. The scatter term is correlated over successive SSBs
//! with the coefficient
//! [`ArrayModel::correlation`](onboard::localize::ekf::ArrayModel::correlation). White noise
//! replaces the scatter, with the spectral density of the scatter in the direction of the line of
//! sight. The replacement is accurate if the state changes little within a wavelength. With traced
//! paths, the Rician K factor is taken from the paths at each position, and a radio head without a
//! line of sight gives no information. Without traced paths, walls reduce the nominal K factor by
//! their attenuation of the direct path.

use onboard::gaussian::{Gaussian, Matrix, identity, product};
use onboard::geometry::{Point, Pose};
use onboard::localize::ekf::EkfConfig;
use onboard::localize::ekf::angle_model::{AngleModel, RoadFrame};
use onboard::localize::ekf::motion::{Reading, Step};
use onboard::localize::ekf::state::{ACROSS, ALONG, Belief, CURVATURE, HEADING, SCALE, STATES};
use onboard::localize::{Ekf, InitialPose};
use onboard::manifold::scatter_bound;
use onboard::radio_head::RadioHead;
use onboard::road::Road;
use onboard::settings::{Check, SettingsError};
use onboard::thermal::ThermalNoise;
use onboard::walls::Walls;

use crate::channel::Paths;
use crate::ideal_filter::IdealFilter;
use crate::scenario::Scenario;
use crate::world::MotionProfile;

/// Bound at one SSB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundPoint {
    /// Time (s).
    pub time_s: f64,
    /// Distance along the road (m).
    pub along_m: f64,
    /// True pose on the road.
    pub pose: Pose,
    /// Lower bound of the RMS horizontal error (m).
    pub position_rms_m: f64,
    /// Lower bound of the standard deviation along the road (m).
    pub along_std_m: f64,
    /// Lower bound of the standard deviation across the road (m).
    pub across_std_m: f64,
    /// Lower bound of the standard deviation of the heading (rad).
    pub heading_std_rad: f64,
    /// Lower bound of the standard deviation of the odometer's scale.
    pub scale_std: f64,
}

/// Calculator of the bound of a scenario.
#[derive(Clone, Debug)]
pub struct Bound {
    config: EkfConfig,
    map: bool,
    road: Road,
    motion: MotionProfile,
    heads: Vec<RadioHead>,
    thermal: ThermalNoise,
    start: InitialPose,
    period_s: f64,
    traced: Option<Traced>,
    walls: Walls,
}

/// Traced paths, and the index of each radio head in their file.
#[derive(Clone, Debug)]
struct Traced {
    paths: Paths,
    heads: Vec<Option<usize>>,
}

impl Bound {
    /// Creates the bound of a scenario for the nominal site and vehicle. A vehicle without a
    /// tracker gets the tracker's default settings.
    ///
    /// # Errors
    /// [`SettingsError`] if the road cannot be built.
    pub fn new(scenario: &Scenario) -> Result<Self, SettingsError> {
        let (site, vehicle) = (&scenario.site, &scenario.vehicle);
        let check = Check {
            file: &scenario.name,
        };
        let road = scenario.path(check)?;
        let start = &vehicle.start;
        let traced = scenario.traced_paths(check)?.map(|paths| {
            let received = site.radio_heads.iter();
            let received = received.filter(|head| vehicle.receiver.receives(head.pci));
            Traced {
                heads: received.map(|head| paths.head(head)).collect(),
                paths,
            }
        });
        Ok(Self {
            config: EkfConfig::new(site, vehicle),
            map: site.road.is_some() && vehicle.follows_road(),
            motion: MotionProfile::new(&scenario.motion, vehicle, road.length_m()),
            heads: RadioHead::received_by(site, vehicle),
            thermal: ThermalNoise::new(site, vehicle),
            start: InitialPose {
                pose: road.pose(scenario.motion.start_at_m),
                // Without a given start, the prior standard deviation of the position is the length
                // of the road.
                position_std_m: if start.known {
                    start.position_std_m
                } else {
                    road.length_m()
                },
                heading_std_rad: if start.known {
                    start.heading_std_rad
                } else {
                    std::f64::consts::PI
                },
            },
            road,
            period_s: site.ssb.period_s(),
            traced,
            walls: Walls::new(site),
        })
    }

    /// Returns the bound at each SSB of the drive. Every SSB is used.
    pub fn along_route(&self) -> Vec<BoundPoint> {
        let scatter = |travelled_m, angle_model: &AngleModel| {
            scatter_bound(self.config.rician_k, angle_model.aperture)
                * (self.config.array).correlation(travelled_m, angle_model.direction_cosine)
        };
        let mut points = Vec::new();
        self.walk(scatter, |_, belief, time_s, along_m| {
            points.push(self.point(belief, time_s, along_m));
        });
        points
    }

    /// Returns the ideal filter: its errors have exactly the covariance that the tracker reports,
    /// at every `stride`-th SSB.
    pub fn ideal_filter(&self, stride: usize) -> IdealFilter {
        let scatter = |travelled_m, angle_model: &AngleModel| {
            self.config.shared_variance(travelled_m, angle_model)
        };
        let mut filter = IdealFilter::default();
        let (mut since, mut before) = (identity(), [[0.0; STATES]; STATES]);
        let mut number = 0;
        self.walk(scatter, |transition, belief, _, _| {
            since = product(transition, &since);
            if number % stride.max(1) == 0 {
                filter.push(&since, &before, &belief.covariance);
                (since, before) = (identity(), belief.covariance);
            }
            number += 1;
        });
        filter
    }

    /// Propagates the belief along the route with the scatter variance `scatter(travelled,
    /// angle_model)`, and calls `visit(Ψ, belief, time, distance along the road)` at each SSB. Ψ is
    /// the closed-loop transition of the error since the previous SSB.
    fn walk(
        &self,
        scatter: impl Fn(f64, &AngleModel) -> f64,
        mut visit: impl FnMut(&Matrix<STATES>, &Belief, f64, f64),
    ) {
        let map = self.map.then_some(&self.road);
        let mut belief = Ekf::prior(&self.config, map, &self.start);
        let mut last_angle_m = f64::NEG_INFINITY;
        let mut before_m = self.motion.at(0.0).along_m;
        let steps = (self.motion.duration_s() / self.period_s).ceil() as usize + 1;
        for number in 0..steps {
            let time_s = number as f64 * self.period_s;
            let along_m = self.motion.at(time_s).along_m;
            let mut transition = self.advance(&mut belief, along_m - before_m);
            before_m = along_m;
            let travelled_m = along_m - last_angle_m;
            let scatter = |angle_model: &AngleModel| scatter(travelled_m, angle_model);
            self.listen(&mut belief, along_m, scatter, &mut transition);
            last_angle_m = along_m;
            visit(&transition, &belief, time_s, along_m);
        }
    }

    fn advance(&self, belief: &mut Belief, length_m: f64) -> Matrix<STATES> {
        let step = if self.map {
            let middle_m = belief.mean[ALONG] + 0.5 * length_m;
            let road = self.road.bending(middle_m, 0.0);
            let config = &self.config;
            Step::along_lane(
                &belief.mean,
                0.0,
                &Reading::exact(length_m),
                &road,
                &config.lane_keeping,
                &config.noise,
            )
        } else {
            Step::in_plane(
                &belief.mean,
                length_m,
                0.0,
                &self.config.path_bend,
                &self.config.noise,
            )
        };
        belief.spread(&step.jacobian, &step.noise);
        step.jacobian
    }

    /// Sets the state to the true pose and updates the covariance with an angle to each radio head.
    /// The closed-loop transition of the error accumulates in `transition`.
    fn listen(
        &self,
        belief: &mut Belief,
        along_m: f64,
        scatter: impl Fn(&AngleModel) -> f64,
        transition: &mut Matrix<STATES>,
    ) {
        let pose = self.road.pose(along_m);
        let curvature_per_m = self.road.curvature_per_m(along_m);
        let frame = if self.map {
            belief.mean[ALONG] = along_m;
            RoadFrame {
                direction_rad: pose.heading_rad,
                stretch: 1.0,
                curvature_per_m,
            }
        } else {
            belief.mean[ALONG] = pose.x_m;
            belief.mean[ACROSS] = pose.y_m;
            belief.mean[HEADING] = pose.heading_rad;
            belief.mean[CURVATURE] = curvature_per_m;
            RoadFrame::PLANE
        };
        for (number, head) in self.heads.iter().enumerate() {
            let array = &self.config.array;
            let angle_model = AngleModel::new(head, pose, &frame, &belief.mean, array);
            let seen = self.seen(number, head, pose.point());
            if let Some((angle_model, (head, fading))) = angle_model.zip(seen) {
                let row = angle_model.row;
                let thermal = self.thermal_variance(&head, &angle_model);
                let variance = fading * scatter(&angle_model) + thermal;
                let gain = belief.update(0.0, &row, variance);
                // Multiply the accumulated transition by (I − K H).
                let mut seen = [0.0; STATES];
                for j in 0..STATES {
                    for k in 0..STATES {
                        seen[j] += row[k] * transition[k][j];
                    }
                }
                for i in 0..STATES {
                    for j in 0..STATES {
                        transition[i][j] -= gain[i] * seen[j];
                    }
                }
            }
        }
    }

    /// Returns the variance (rad²) of an angle due to thermal noise, for the array's effective
    /// aperture in the direction of the radio head.
    fn thermal_variance(&self, head: &RadioHead, angle_model: &AngleModel) -> f64 {
        let mean = self.config.array.measurand.mean_aperture();
        self.thermal.variance(head, angle_model.range_m) * (mean / angle_model.aperture)
    }

    /// Returns a radio head as received at `place`, and the ratio of the scatter variance there to
    /// the scatter variance at the nominal K factor. Returns `None` without a line of sight,
    /// because the radio head then gives no information.
    fn seen(&self, number: usize, head: &RadioHead, place: Point) -> Option<(RadioHead, f64)> {
        let Some(traced) = &self.traced else {
            let passing = self.walls.passing(head.position, place);
            return Some((self.walls.seen(head, place)?, passing.recip()));
        };
        let number = traced.heads.get(number).copied().flatten()?;
        let k = (traced.paths.rician_k(number, place)).filter(|k| *k > 0.0)?;
        Some((*head, self.config.rician_k / k))
    }

    fn point(&self, belief: &Belief, time_s: f64, along_m: f64) -> BoundPoint {
        let pose = self.road.pose(along_m);
        let (sin, cos) = pose.heading_rad.sin_cos();
        let (along, across) = if self.map {
            ([1.0, 0.0], [0.0, 1.0])
        } else {
            ([cos, sin], [-sin, cos])
        };
        let variance = |[first, second]: [f64; 2]| {
            let mut row = [0.0; STATES];
            row[ALONG] = first;
            row[ACROSS] = second;
            belief.variance_along(&row)
        };
        let (along, across) = (variance(along), variance(across));
        BoundPoint {
            time_s,
            along_m,
            pose,
            position_rms_m: (along + across).sqrt(),
            along_std_m: along.sqrt(),
            across_std_m: across.sqrt(),
            heading_std_rad: belief.covariance[HEADING][HEADING].sqrt(),
            scale_std: belief.covariance[SCALE][SCALE].sqrt(),
        }
    }

    /// Returns the bound of the RMS position error (m) at `place` for `angles` independent angles of
    /// every radio head. The heading is known with the standard deviation `heading_std_rad`, and
    /// the position has a flat prior. The information is averaged over eight headings. Returns
    /// `None` if the radio heads leave one direction unobservable.
    pub fn at(&self, place: Point, angles: f64, heading_std_rad: f64) -> Option<f64> {
        const HEADINGS: u32 = 8;
        const VAGUE_M: f64 = 1e4;
        let mut information = 0.0;
        for turn in 0..HEADINGS {
            let heading_rad = std::f64::consts::TAU * f64::from(turn) / f64::from(HEADINGS);
            let mut sigma = [0.0; STATES];
            sigma[ALONG] = VAGUE_M;
            sigma[ACROSS] = VAGUE_M;
            sigma[HEADING] = heading_std_rad;
            let mut belief = Gaussian::independent([0.0; STATES], sigma);
            let pose = Pose {
                x_m: place.x_m,
                y_m: place.y_m,
                heading_rad,
            };
            let array = &self.config.array;
            for (number, head) in self.heads.iter().enumerate() {
                let angle_model =
                    AngleModel::new(head, pose, &RoadFrame::PLANE, &[0.0; STATES], array)?;
                let Some((head, fading)) = self.seen(number, head, place) else {
                    continue;
                };
                let scatter = scatter_bound(self.config.rician_k, angle_model.aperture);
                let thermal = self.thermal_variance(&head, &angle_model);
                belief.update(0.0, &angle_model.row, (fading * scatter + thermal) / angles);
            }
            let [along, across] = [ALONG, ACROSS].map(|i| belief.covariance[i][i]);
            information += 1.0 / (along + across);
        }
        let rms_m = (f64::from(HEADINGS) / information).sqrt();
        (rms_m < 0.1 * VAGUE_M).then_some(rms_m)
    }
}
