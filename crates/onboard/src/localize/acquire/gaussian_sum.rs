//! Search for an unknown initial pose.
//!
//! On a road, there is one hypothesis (filter) for each metre and each permitted direction of
//! travel; without a road, one for each cell of a grid and each of twelve headings. The hypotheses
//! form a Gaussian sum (Sorenson and Alspach 1971), weighted by the likelihoods of the angles.
//! Hypotheses with a low likelihood, or off the road, are removed; hypotheses that meet are merged.
//! The vehicle is located when the remaining hypotheses, merged to one Gaussian, have a small
//! covariance.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::clone_in_place::clone_in_place;
use crate::gaussian::CERTAIN_SIGMAS;
use crate::geometry::{Area, Point, Pose, wrap_angle};
use crate::localize::ekf::state::{ACROSS, ALONG, HEADING, STATES};
use crate::localize::ekf::{Ekf, EkfConfig, PredictedMeasurement};
use crate::localize::modes::{log_likelihood, log_likelihood_as_stated};
use crate::localize::output::{InitialPose, PoseEstimate};
use crate::localize::output::{OdometryResult, UpdateReason, UpdateResult};
use crate::observation::AngleMeasurement;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::range::RangeModel;
use crate::road::Road;

/// Distance between initial hypotheses (m). Within it, an angle is sufficiently linear for the
/// filter, also at the ends of a narrow bend.
const SPACING_M: f64 = 1.0;

/// Maximum difference of log-likelihoods from the best hypothesis; e^−25 is one in 10¹¹.
const BEHIND: f64 = 25.0;

/// Maximum standard deviation of the position, along the longer axis of its ellipse, for a located
/// vehicle (m). Another position 100 m away then has a probability below 2 in 100 000.
const FOUND_STD_M: f64 = 0.4;

/// Maximum probability of the opposite direction of travel for a located vehicle.
const MAX_OPPOSITE_ODDS: f64 = 1e-5;

/// Maximum standard deviation of the heading for a located vehicle without a road (rad).
const FOUND_STD_RAD: f64 = 0.2;

/// Minimum number of radio heads that determine a position without a road.
pub(super) const MIN_HEADS: usize = 3;

/// Number of initial headings in each grid cell.
const HEADINGS: u32 = 12;
/// Maximum number of hypotheses.
const MAX_HYPOTHESES: f64 = 4000.0;

/// Minimum weight of a remaining hypothesis relative to the best, in the reported covariance. The
/// next angles may make it the best one, and its position is then at most five standard deviations
/// away.
const MIN_WEIGHT: f64 = 0.05;

/// Maximum number of updates of hypotheses for each radio head and second. While many hypotheses
/// remain, a search uses a part of the angles: with four radio heads and 4 µs for an update, it needs
/// a third of a processor core.
const MAX_UPDATES_PER_S: f64 = 20_000.0;

/// Maximum number of hypotheses that the protection level covers one by one.
const MAX_SEPARATE_HYPOTHESES: usize = 64;

/// Log-likelihood of an angle, given a filter and its prediction.
type LogLikelihood = fn(&Ekf, &Result<PredictedMeasurement, UpdateReason>) -> f64;

/// Region of the search.
#[derive(Clone, Debug)]
enum Ground {
    Roads(Vec<Arc<Road>>),
    Plane(Area),
}

clone_in_place! {
    /// Hypothesis of the pose.
    #[derive(Debug)]
    struct Hypothesis {
        /// Index of the road of the hypothesis; 0 without a road.
        road: usize,
        /// A filter is large, and hypotheses are sorted.
        ekf: Box<Ekf>,
        log_likelihood: f64,
    }
}

impl Hypothesis {
    /// Returns the distance along its road, and the standard deviation of that distance (m).
    fn along_m(&self) -> (f64, f64) {
        let belief = self.ekf.belief();
        (
            belief.mean[ALONG],
            belief.covariance[ALONG][ALONG].max(0.0).sqrt(),
        )
    }

    /// Returns the difference of one state from that of another hypothesis.
    fn apart(&self, other: &Self, state: usize) -> f64 {
        let apart = other.ekf.belief().mean[state] - self.ekf.belief().mean[state];
        if state == HEADING {
            wrap_angle(apart)
        } else {
            apart
        }
    }

    /// Whether each component of another pose is within the confidence interval of the difference.
    fn is_at(&self, other: &PoseEstimate) -> bool {
        let own = self.ekf.pose(f64::NEG_INFINITY);
        let (Some(one), Some(two)) = (own.covariance, other.covariance) else {
            return false;
        };
        let apart = own.pose.offset_of(other.pose);
        apart.iter().enumerate().all(|(at, apart)| {
            let variance = one[at][at] + two[at][at];
            apart * apart < CERTAIN_SIGMAS * CERTAIN_SIGMAS * variance
        })
    }

    /// Whether another hypothesis without a road is within one standard deviation in every
    /// direction. The first component decides for most pairs.
    fn meets(&self, other: &Self) -> bool {
        let covariance = &self.ekf.belief().covariance;
        [ALONG, ACROSS, HEADING].into_iter().all(|state| {
            let apart = self.apart(other, state);
            apart * apart < covariance[state][state]
        })
    }

    /// Merges another hypothesis on the same road: the Gaussian with the mean and covariance of
    /// their sum.
    fn absorb(&mut self, other: &Self) {
        let ratio = (other.log_likelihood - self.log_likelihood).exp();
        let weight = ratio / (1.0 + ratio);
        let (mut one, two) = (*self.ekf.belief(), other.ekf.belief());
        let apart: [f64; STATES] = std::array::from_fn(|state| self.apart(other, state));
        for i in 0..STATES {
            one.mean[i] += weight * apart[i];
            for j in 0..STATES {
                one.covariance[i][j] += weight
                    * (two.covariance[i][j] - one.covariance[i][j]
                        + (1.0 - weight) * apart[i] * apart[j]);
            }
        }
        self.ekf.set_belief(&one);
        self.log_likelihood += ratio.ln_1p();
    }
}

clone_in_place! {
    /// Search for the initial pose.
    #[derive(Debug)]
    pub struct GaussianSum {
        config: EkfConfig,
        ground: Ground,
        heads: Vec<RadioHead>,
        hypotheses: Vec<Hypothesis>,
        /// Road and distance along it of each kept hypothesis, while hypotheses are merged: they are
        /// compared pair by pair, and a filter is large.
        kept: Vec<(usize, f64)>,
        /// Time of the last used angle of each radio head (s).
        used_s: Vec<f64>,
        /// Initial number of hypotheses.
        places: usize,
        /// Whether an uncertain hypothesis is penalised for its uncertainty.
        is_as_stated: bool,
        /// Prior probability of a bias, for the filter of the located vehicle.
        multipath_bias_probability: f64,
        /// Model of the ranges, for the filter of the located vehicle. The hypotheses use angles only.
        ranging: Option<RangeModel>,
    }
}

impl GaussianSum {
    /// Creates a search along `road`, in its direction or, with `either_direction`, in both;
    /// without a road, in the area of the radio heads.
    pub fn new(
        config: EkfConfig,
        road: Option<Road>,
        either_direction: bool,
        heads: &[RadioHead],
    ) -> Self {
        let Some(road) = road else {
            return Self::in_plane(config, Self::about(heads), heads);
        };
        let against = either_direction.then(|| Arc::new(road.reversed()));
        let roads = [Arc::new(road)].into_iter().chain(against).collect();
        Self::on(&config, Ground::Roads(roads), heads)
    }

    /// Creates the search for an unknown initial pose without a road. It uses [`Self::as_stated`]
    /// unless the whole area has a fine grid, or the number of radio heads is too small.
    pub fn from_scratch(
        config: EkfConfig,
        road: Option<Road>,
        either_direction: bool,
        heads: &[RadioHead],
    ) -> Self {
        if road.is_none() && Self::serves_as_stated(heads) {
            return Self::as_stated(&config, None, heads);
        }
        Self {
            multipath_bias_probability: config.multipath_bias_probability,
            ..Self::new(config.as_stated(), road, either_direction, heads)
        }
    }

    /// Creates a search with the specified noise only: the uncertainty of a hypothesis reduces its
    /// likelihood, and no bias is estimated before the vehicle is located.
    pub(super) fn as_stated(config: &EkfConfig, road: Option<Road>, heads: &[RadioHead]) -> Self {
        Self {
            is_as_stated: true,
            multipath_bias_probability: config.multipath_bias_probability,
            ..Self::new(config.as_stated(), road, true, heads)
        }
    }

    /// Whether these radio heads determine a position with the specified noise only.
    pub(super) fn serves_as_stated(heads: &[RadioHead]) -> bool {
        heads.len() >= MIN_HEADS && !Self::is_small(heads)
    }

    /// Returns the area of a search without a road.
    fn about(heads: &[RadioHead]) -> Area {
        Area::about(heads.iter().map(|head| head.position))
    }

    /// Creates a search in an area, with any heading.
    pub fn in_plane(config: EkfConfig, area: Area, heads: &[RadioHead]) -> Self {
        Self::on(&config, Ground::Plane(area), heads)
    }

    /// Whether the whole area of these radio heads can be searched with a fine grid.
    pub fn is_small(heads: &[RadioHead]) -> bool {
        Self::about(heads).spacing_m(MAX_HYPOTHESES / f64::from(HEADINGS), SPACING_M) <= SPACING_M
    }

    /// Whether its filters have the same states as a filter that they are compared with.
    pub fn has_model_of(&self, ekf: &Ekf) -> bool {
        self.config.estimates_bias() == ekf.is_with_bias()
    }

    fn on(config: &EkfConfig, ground: Ground, heads: &[RadioHead]) -> Self {
        let mut made = Self {
            config: EkfConfig {
                ranging: None,
                ..*config
            },
            ground,
            heads: heads.to_vec(),
            hypotheses: Vec::new(),
            kept: Vec::new(),
            used_s: vec![f64::NEG_INFINITY; heads.len()],
            places: 0,
            is_as_stated: false,
            multipath_bias_probability: config.multipath_bias_probability,
            ranging: config.ranging,
        };
        made.restart();
        made
    }

    /// Continues the distance of another filter of the same vehicle.
    pub(super) fn resume(&mut self, other: &Ekf) {
        for hypothesis in &mut self.hypotheses {
            hypothesis.ekf.resume(other);
        }
    }

    fn restart(&mut self) {
        let (config, heads) = (self.config, &self.heads);
        let hypothesis = |road: usize, map: Option<&Arc<Road>>, start: InitialPose| Hypothesis {
            road,
            ekf: Box::new(Ekf::new(config, map.cloned(), heads, &start)),
            log_likelihood: 0.0,
        };
        match &self.ground {
            Ground::Roads(roads) => {
                for (number, road) in roads.iter().enumerate() {
                    let count = (road.length_m() / SPACING_M).ceil().max(1.0);
                    let spacing_m = road.length_m() / count;
                    self.hypotheses.extend((0..count as usize).map(|index| {
                        let start = InitialPose {
                            pose: road.pose((index as f64 + 0.5) * spacing_m),
                            position_std_m: 0.5 * spacing_m,
                            heading_std_rad: 1.0,
                        };
                        hypothesis(number, Some(road), start)
                    }));
                }
            }
            Ground::Plane(area) => {
                let spacing_m = area.spacing_m(MAX_HYPOTHESES / f64::from(HEADINGS), SPACING_M);
                let turn_rad = TAU / f64::from(HEADINGS);
                for Point { x_m, y_m } in area.places(spacing_m) {
                    self.hypotheses.extend((0..HEADINGS).map(|number| {
                        let heading_rad = wrap_angle(f64::from(number) * turn_rad);
                        let start = InitialPose {
                            pose: Pose {
                                x_m,
                                y_m,
                                heading_rad,
                            },
                            position_std_m: 0.5 * spacing_m,
                            heading_std_rad: 0.5 * turn_rad,
                        };
                        hypothesis(0, None, start)
                    }));
                }
            }
        }
        self.places = self.hypotheses.len();
        self.kept.clear();
        self.kept.reserve(self.places);
    }

    /// Predicts every hypothesis.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryResult {
        let ekfs = self.hypotheses.iter_mut();
        ekfs.fold(OdometryResult::NotFinite, |_, hypothesis| {
            hypothesis.ekf.odometry(sample)
        })
    }

    /// Whether an angle of a radio head at `time_s` is used: the interval since its last one is
    /// proportional to the number of hypotheses.
    pub(super) fn is_due(&self, head: &RadioHead, time_s: f64) -> bool {
        let number = head.number_in(&self.heads);
        let last_s = number.and_then(|number| self.used_s.get(number));
        let interval_s = self.hypotheses.len() as f64 / MAX_UPDATES_PER_S;
        last_s.is_none_or(|last_s| time_s - last_s >= interval_s)
    }

    /// Updates every hypothesis with an angle. The verdict is that of the most probable one.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateResult {
        let number = head.number_in(&self.heads);
        if let Some(used_s) = number.and_then(|number| self.used_s.get_mut(number)) {
            *used_s = measured.time_s;
        }
        let mut first = UpdateResult::unused(UpdateReason::Unusable);
        let mut is_used = false;
        let log_likelihood = self.log_likelihood();
        for (rank, hypothesis) in self.hypotheses.iter_mut().enumerate() {
            let predicted = hypothesis.ekf.predict_measurement(head, measured);
            is_used |= predicted.is_ok();
            hypothesis.log_likelihood += log_likelihood(&hypothesis.ekf, &predicted);
            let verdict = hypothesis.ekf.update_predicted(predicted, measured);
            if rank == 0 {
                first = verdict;
            }
        }
        if !is_used {
            return first;
        }
        self.prune();
        // All hypotheses use the noise of the best one, because they share one receiver; otherwise
        // their likelihoods would not be comparable.
        if let Some((best, others)) = self.hypotheses.split_first_mut() {
            for it in others {
                it.ekf.copy_noise_state(&best.ekf);
            }
        }
        first
    }

    /// Returns the function that weights the hypotheses.
    pub(super) fn log_likelihood(&self) -> LogLikelihood {
        if self.is_as_stated {
            log_likelihood_as_stated
        } else {
            log_likelihood
        }
    }

    /// Returns the position of a filter as a hypothesis of this search: with its model, and without
    /// memory of any angle.
    pub(super) fn hypothesis_at(&self, ekf: &Ekf) -> Ekf {
        ekf.as_hypothesis(&self.config)
    }

    /// Sets the noise model of another filter to that of the hypotheses.
    pub(super) fn copy_noise_model_to(&self, ekf: &mut Ekf) {
        if let Some(best) = self.hypotheses.first() {
            ekf.copy_noise_state(&best.ekf);
        }
    }

    fn prune(&mut self) {
        let by_likelihood =
            |a: &Hypothesis, b: &Hypothesis| b.log_likelihood.total_cmp(&a.log_likelihood);
        self.hypotheses.sort_unstable_by(by_likelihood);
        let best = self
            .hypotheses
            .first()
            .map_or(0.0, |best| best.log_likelihood);
        let ground = &self.ground;
        let possible = |hypothesis: &Hypothesis| {
            let Ground::Roads(roads) = ground else {
                return true;
            };
            let (along_m, std_m) = hypothesis.along_m();
            let length_m = roads
                .get(hypothesis.road)
                .map_or(0.0, |road| road.length_m());
            (-3.0 * std_m..=length_m + 3.0 * std_m).contains(&along_m)
        };
        self.hypotheses
            .retain(|hypothesis| possible(hypothesis) && hypothesis.log_likelihood > best - BEHIND);
        let in_plane = matches!(self.ground, Ground::Plane(_));
        self.kept.clear();
        for index in 0..self.hypotheses.len() {
            let (better, rest) = self.hypotheses.split_at_mut(index);
            let Some(hypothesis) = rest.first() else {
                break;
            };
            let (along_m, std_m) = hypothesis.along_m();
            let met = if in_plane {
                let mut others = better.iter().take(self.kept.len());
                others.position(|other| hypothesis.meets(other))
            } else {
                self.kept.iter().position(|(road, other_m)| {
                    *road == hypothesis.road && (other_m - along_m).abs() < std_m
                })
            };
            let met = met.and_then(|at| Some((better.get_mut(at)?, self.kept.get_mut(at)?)));
            if let Some((other, place)) = met {
                other.absorb(hypothesis);
                place.1 = other.along_m().0;
            } else {
                let place = (hypothesis.road, along_m);
                self.hypotheses.swap(self.kept.len(), index);
                self.kept.push(place);
            }
        }
        self.hypotheses.truncate(self.kept.len());
        if self.hypotheses.is_empty() {
            // The best hypothesis has left the road.
            self.restart();
        }
    }

    /// Returns the radio heads.
    pub fn heads(&self) -> &[RadioHead] {
        &self.heads
    }

    /// Returns the number of remaining hypotheses.
    pub fn left(&self) -> usize {
        self.hypotheses.len()
    }

    /// Returns the log-likelihood of the best hypothesis.
    pub(super) fn best(&self) -> f64 {
        self.hypotheses
            .first()
            .map_or(f64::NEG_INFINITY, |best| best.log_likelihood)
    }

    /// Returns the log-likelihood of the angles at all positions other than that of `ekf`, for a
    /// uniform prior over the initial hypotheses.
    pub(super) fn evidence_elsewhere(&self, ekf: &Ekf) -> f64 {
        let best = self.best();
        let weights = self
            .elsewhere(ekf)
            .map(|it| (it.log_likelihood - best).exp());
        best + (weights.sum::<f64>() / self.places.max(1) as f64).ln()
    }

    /// Returns the hypotheses that are not at the position of `ekf`.
    fn elsewhere(&self, ekf: &Ekf) -> impl Iterator<Item = &Hypothesis> + Clone {
        let there = ekf.pose(f64::NEG_INFINITY);
        (self.hypotheses.iter()).filter(move |it| !it.is_at(&there))
    }

    /// Whether every remaining hypothesis has a small covariance, and the position of `ekf` is
    /// within its confidence region.
    pub(super) fn is_at(&self, ekf: &Ekf) -> bool {
        let there = ekf.pose(f64::NEG_INFINITY);
        self.hypotheses.iter().all(|it| {
            let [max_m2, _] = Ekf::principal_variances(it.ekf.belief());
            max_m2 < FOUND_STD_M * FOUND_STD_M && it.is_at(&there)
        })
    }

    /// Returns the odds of another position, the one of `ekf`, above which that position prevents
    /// the result of the search from being reported. With these odds, the contribution of the
    /// position to the variances of position and heading equals the limits for a located vehicle.
    pub(super) fn odds_to_neglect(&self, ekf: &Ekf) -> f64 {
        let (here, there) = (
            Self::mixture(self.hypotheses.iter(), f64::NEG_INFINITY, 0.0),
            ekf.pose(f64::NEG_INFINITY),
        );
        let [x_m, y_m, turned_rad] = here.pose.offset_of(there.pose);
        let of_place = (x_m * x_m + y_m * y_m) / (FOUND_STD_M * FOUND_STD_M);
        let of_heading = turned_rad * turned_rad / (FOUND_STD_RAD * FOUND_STD_RAD);
        of_place.max(of_heading).max(1.0)
    }

    /// Returns one filter for all remaining hypotheses once they determine the position.
    pub fn found(&self) -> Option<Ekf> {
        let all = Self::mixture(self.hypotheses.iter(), f64::NEG_INFINITY, 0.0);
        let is_placed = all.principal_variances()[0] < FOUND_STD_M * FOUND_STD_M;
        let heading_known = match self.ground {
            Ground::Roads(_) => true,
            Ground::Plane(_) => {
                let [.., [.., variance]] = all.covariance.unwrap_or_default();
                variance < FOUND_STD_RAD * FOUND_STD_RAD
            }
        };
        // With the specified noise only, any other position has a probability below one in 10¹¹, so
        // that the covariance of the remaining hypothesis need not be small.
        let is_only = self.is_as_stated && self.hypotheses.len() == 1;
        if !((is_placed || is_only) && heading_known) {
            return None;
        }
        let mut one = self.hypotheses.first()?.clone();
        let best = one.log_likelihood;
        let mut opposite = 0.0;
        for hypothesis in self.hypotheses.iter().skip(1) {
            if hypothesis.road == one.road {
                one.absorb(hypothesis);
            } else {
                opposite += (hypothesis.log_likelihood - best).exp();
            }
        }
        if !one.ekf.is_with_bias() {
            one.ekf.begin_bias(self.multipath_bias_probability);
        }
        if let Some(model) = self.ranging {
            one.ekf.begin_ranging(model);
        }
        (opposite < MAX_OPPOSITE_ODDS).then_some(*one.ekf)
    }

    /// Returns the mean over all hypotheses, weighted by their likelihoods, and a covariance that
    /// covers every hypothesis that may become the best one. The distribution is far from Gaussian
    /// while several hypotheses remain.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        Self::mixture(self.hypotheses.iter(), time_s, MIN_WEIGHT)
    }

    /// Returns the positions other than that of `ekf`, each with its weight: the most probable
    /// hypotheses, and one Gaussian with mean and covariance of all others. The weights sum to one.
    pub(super) fn components_elsewhere(
        &self,
        ekf: &Ekf,
        time_s: f64,
    ) -> impl Iterator<Item = (f64, PoseEstimate)> {
        let best = self.best();
        let weight = move |it: &Hypothesis| (it.log_likelihood - best).exp();
        let total: f64 = self.elsewhere(ekf).map(weight).sum();
        let rest = self.elsewhere(ekf).skip(MAX_SEPARATE_HYPOTHESES);
        let rest_weight = rest.clone().map(weight).sum::<f64>() / total;
        let rest = (rest_weight > 0.0).then(|| (rest_weight, Self::mixture(rest, time_s, 0.0)));
        let single = self.elsewhere(ekf).take(MAX_SEPARATE_HYPOTHESES);
        let single = single.map(move |it| (weight(it) / total, it.ekf.pose(time_s)));
        single.chain(rest)
    }

    /// Returns mean and covariance over hypotheses. In the covariance, the weight of a
    /// hypothesis is at least `min_weight` times the weight of the best.
    fn mixture<'a>(
        hypotheses: impl Iterator<Item = &'a Hypothesis> + Clone,
        time_s: f64,
        min_weight: f64,
    ) -> PoseEstimate {
        let best = (hypotheses.clone())
            .map(|hypothesis| hypothesis.log_likelihood)
            .fold(f64::NEG_INFINITY, f64::max);
        let weighed = hypotheses.map(|hypothesis| {
            let weight = (hypothesis.log_likelihood - best).exp();
            (weight, hypothesis.ekf.pose(time_s))
        });
        let (mut total, mut x_m, mut y_m) = (0.0, 0.0, 0.0);
        let (mut sin, mut cos) = (0.0, 0.0);
        for (weight, PoseEstimate { pose, .. }) in weighed.clone() {
            total += weight;
            x_m += weight * pose.x_m;
            y_m += weight * pose.y_m;
            sin += weight * pose.heading_rad.sin();
            cos += weight * pose.heading_rad.cos();
        }
        let mean = Pose {
            x_m: x_m / total,
            y_m: y_m / total,
            heading_rad: sin.atan2(cos),
        };
        let mut covariance = [[0.0; 3]; 3];
        let mut total = 0.0;
        for (weight, estimate) in weighed {
            let weight = weight.max(min_weight);
            total += weight;
            estimate.add_about(mean, weight, &mut covariance);
        }
        let covariance = covariance.map(|row| row.map(|value| value / total));
        PoseEstimate {
            time_s,
            pose: mean,
            covariance: Some(covariance),
            integrity: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::observation::MeasurementKind;
    use crate::settings::{RangingSettings, Shipped, Site, TomlFile, Vehicle};

    /// Drives from `start_m` until located; returns the error in metres and in standard deviations.
    fn search(seed: u64) -> Option<(f64, f64)> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let site = Site::from_library("trip-2", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("paper-carrier", &Shipped).unwrap();
        let mut config = EkfConfig::new(&site, &vehicle);
        let ranging = RangingSettings::default();
        config.ranging = Some(RangeModel::new(&ranging, &vehicle.array, 0.08));
        let heads = RadioHead::received_by(&site, &vehicle);
        let map = site.build_road().unwrap().unwrap();
        let start_m = rng.random::<f64>() * 200.0;
        let mut search = GaussianSum::from_scratch(config, Some(map.clone()), false, &heads);
        for step in 0..1000 {
            let time_s = f64::from(step) * 0.02;
            let distance_m = 4.0 * time_s;
            search.odometry(&OdometrySample {
                time_s,
                distance_m,
                speed_mps: 4.0,
                yaw_rate_radps: None,
            });
            let truth = map.pose(start_m + distance_m);
            for head in &heads {
                let bearing_rad = truth.point().bearing_rad(head.position);
                let noise: f64 = rng.sample(StandardNormal);
                let phase_rad =
                    std::f64::consts::PI * (bearing_rad - truth.heading_rad).cos() + 0.1 * noise;
                let measured = AngleMeasurement {
                    kind: MeasurementKind::Angle,
                    time_s,
                    phase_rad: wrap_angle(phase_rad),
                    phase_sigma_rad: 0.001,
                    angle_rad: f64::NAN,
                    snr_db: 20.0,
                    resolved: true,
                };
                search.update(head, &measured);
            }
            if let Some(ekf) = search.found() {
                // Only the filter of the located vehicle uses ranges.
                assert!(search.config.ranging.is_none() && ekf.range_scale().is_some());
                let estimate = ekf.pose(time_s);
                let error_m = estimate.pose.point().distance_m(truth.point());
                return Some((error_m, error_m / estimate.principal_variances()[0].sqrt()));
            }
        }
        None
    }

    #[test]
    fn many_hypotheses_use_a_part_of_the_angles() {
        let site = Site::from_library("trip-2", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("paper-carrier", &Shipped).unwrap();
        let heads = RadioHead::received_by(&site, &vehicle);
        let map = site.build_road().unwrap();
        let config = EkfConfig::new(&site, &vehicle);
        let mut search = GaussianSum::from_scratch(config, map, true, &heads);
        assert_eq!(search.left(), 600);
        let measured = AngleMeasurement {
            kind: MeasurementKind::Angle,
            time_s: 0.0,
            phase_rad: 1.0,
            phase_sigma_rad: 0.01,
            angle_rad: f64::NAN,
            snr_db: 20.0,
            resolved: true,
        };
        search.update(&heads[0], &measured);
        let hypotheses = search.left();
        assert!(hypotheses > 1);
        let interval_s = hypotheses as f64 / MAX_UPDATES_PER_S;
        assert!(!search.is_due(&heads[0], 0.99 * interval_s));
        assert!(search.is_due(&heads[0], interval_s) && search.is_due(&heads[1], 0.0));
    }

    #[test]
    fn two_radio_heads_and_the_road_determine_the_pose() {
        let right = (0..100)
            .filter_map(search)
            .filter(|(error_m, sigmas)| *error_m < 2.0 && *sigmas < 4.5)
            .count();
        assert!(right >= 99, "{right} of 100");
    }
}
