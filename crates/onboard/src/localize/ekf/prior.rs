//! Prior of the filter.

use std::sync::Arc;

use super::angle_model::locate;
use super::config::EkfConfig;
use super::filter::{Ekf, Head};
use super::state::{
    ACROSS, ALONG, ANGLE_TIME_OFFSET, Belief, CURVATURE, DATUM, HEADING, MOUNTING, PHASE, SCALE,
    STATES, YAW_RATE_BIAS, YAW_RATE_SCALE,
};
use crate::geometry::{Pose, wrap_angle};
use crate::localize::output::InitialPose;
use crate::radio_head::RadioHead;
use crate::range::RangeModel;
use crate::road::Road;

/// Minimum variance of an exact start, of a micrometre and a microradian: with zero, rounding
/// errors of either sign would remain.
const MIN_VARIANCE: f64 = 1e-12;

impl Ekf {
    /// Returns the prior of the state.
    pub fn prior(config: &EkfConfig, map: Option<&Road>, start: &InitialPose) -> Belief {
        let mut sigma = [0.0; STATES];
        sigma[SCALE] = config.odometer_scale_std;
        sigma[YAW_RATE_BIAS] = config.yaw_rate_bias_std_radps;
        sigma[YAW_RATE_SCALE] = config.yaw_rate_scale_std;
        sigma[MOUNTING] = config.mounting_std_rad;
        sigma[PHASE] = config.phase_std_rad;
        for state in DATUM {
            sigma[state] = config.datum_std_m;
        }
        sigma[ANGLE_TIME_OFFSET] = config.angle_time_offset_std_s;
        let mut mean = [0.0; STATES];
        mean[SCALE] = config.odometer_scale - 1.0;
        mean[YAW_RATE_BIAS] = config.yaw_rate_bias_radps;
        mean[MOUNTING] = config.mounting_rad;
        mean[PHASE] = config.phase_rad;
        let Pose {
            x_m,
            y_m,
            heading_rad,
        } = start.pose;
        let place = map.map(|map| (map, map.project(start.pose.point())));
        let (given, lane) = place.map_or(([x_m, y_m, heading_rad], None), |(map, place)| {
            let along_m = place.along_m;
            let heading_rad = wrap_angle(heading_rad - map.pose(along_m).heading_rad);
            let in_lane = map.gap_between(along_m, along_m).is_none();
            let given = [along_m, place.lateral_m, heading_rad];
            (given, in_lane.then_some(map))
        });
        sigma[ALONG] = start.position_std_m;
        let Some(map) = lane else {
            // Without a lane, only the given pose determines the prior.
            for (state, value) in [ALONG, ACROSS, HEADING].into_iter().zip(given) {
                mean[state] = value;
            }
            sigma[ACROSS] = start.position_std_m;
            sigma[HEADING] = start.heading_std_rad;
            if map.is_none() {
                sigma[CURVATURE] = config.curvature_variance().sqrt();
            }
            return Belief::independent(mean, sigma);
        };
        let [along_m, lateral_m, heading_rad] = given;
        let [offset_variance, heading_variance] = config.lane_keeping.stationary();
        mean[ALONG] = along_m;
        sigma[ACROSS] = offset_variance.sqrt();
        sigma[HEADING] = heading_variance.sqrt();
        let mut belief = Belief::independent(mean, sigma);
        // The given pose is a measurement in addition to the lane keeping. In a bend, the heading
        // also determines the position along the road.
        let curvature_per_m = map.curvature_per_m(along_m);
        for (state, value, std, by_along) in [
            (ACROSS, lateral_m, start.position_std_m, 0.0),
            (HEADING, heading_rad, start.heading_std_rad, curvature_per_m),
        ] {
            let mut row = [0.0; STATES];
            row[state] = 1.0;
            row[ALONG] = by_along;
            let expected = belief.mean[state] + by_along * (belief.mean[ALONG] - along_m);
            belief.update(value - expected, &row, (std * std).max(MIN_VARIANCE));
        }
        belief
    }

    /// Continues the distance of another filter of the same vehicle, and its memory of the angles.
    pub(in crate::localize) fn resume(&mut self, other: &Self) {
        self.odometry = other.odometry;
        self.driven_m = other.driven_m;
        self.copy_noise_state(other);
    }

    /// Sets the white fraction of the angles' noise, the correlation of their errors and the noise of the ranges to those
    /// of another filter of the same receiver.
    pub(in crate::localize) fn copy_noise_state(&mut self, other: &Self) {
        self.white = other.white;
        self.copy_error_correlation(other);
        self.copy_range_noise(other);
    }

    /// Sets the correlation of the angles' errors to that of another filter.
    pub(in crate::localize) const fn copy_error_correlation(&mut self, other: &Self) {
        self.error_correlation = other.error_correlation;
    }

    /// Sets the noise of ranges and clocks, and the probabilities of blocked first paths, to those of another filter of the
    /// same radio heads.
    pub(in crate::localize) fn copy_range_noise(&mut self, other: &Self) {
        self.range_noise = other.range_noise;
        self.clock_noise = other.clock_noise;
        self.copy_paths(other);
    }

    /// Sets the probabilities of blocked first paths to those of another filter of the same radio heads.
    pub(in crate::localize) fn copy_paths(&mut self, other: &Self) {
        self.blocked_fraction = other.blocked_fraction;
        for (mine, theirs) in self.heads.iter_mut().zip(&other.heads) {
            (mine.blocked, mine.late) = (theirs.blocked, theirs.late);
        }
    }

    /// Returns a copy that expects the specified noise of the angles.
    pub(in crate::localize) fn nominal(&self) -> Self {
        let mut ekf = self.clone();
        ekf.set_noise_scale(None);
        ekf
    }

    /// Returns a filter at the same pose with this configuration, without memory of any angle, as a
    /// hypothesis of a search.
    pub(in crate::localize) fn as_hypothesis(&self, config: &EkfConfig) -> Self {
        let heads: Vec<RadioHead> = self.heads.iter().map(|head| head.known).collect();
        Self {
            bias: Self::biases(config, &heads),
            heads: heads.into_iter().map(Head::new).collect(),
            config: *config,
            journal: None,
            ..self.clone()
        }
    }

    /// Estimates a bias of each radio head from now on, with this prior probability; none if it is 0.
    pub(in crate::localize) fn begin_bias(&mut self, probability: f64) {
        self.config.multipath_bias_probability = probability;
        let heads: Vec<RadioHead> = self.heads.iter().map(|head| head.known).collect();
        self.bias = Self::biases(&self.config, &heads);
    }

    /// Uses ranges with this model from now on.
    pub(in crate::localize) fn begin_ranging(&mut self, model: RangeModel) {
        let heads: Vec<RadioHead> = self.heads.iter().map(|head| head.known).collect();
        self.config.ranging = Some(model);
        self.bias.add_ranges(&model, &heads);
    }

    /// Removes the assumption of exactness from unspecified constants of the array.
    pub(in crate::localize) fn uncalibrate_array(&mut self) {
        let config = &mut self.config;
        let stds_rad = std::mem::take(&mut config.unstated_array_std_rad);
        for ((std, state), std_rad) in [
            (&mut config.mounting_std_rad, MOUNTING),
            (&mut config.phase_std_rad, PHASE),
        ]
        .into_iter()
        .zip(stds_rad)
        {
            *std = std.hypot(std_rad);
            self.belief.covariance[state][state] += std_rad * std_rad;
        }
    }

    /// Adds a displacement of the whole site plan with a standard deviation of `std_m` in x and y.
    pub(in crate::localize) fn displace_site(&mut self, std_m: f64) {
        for state in DATUM {
            self.belief.covariance[state][state] += std_m * std_m;
        }
        self.config.datum_std_m = self.config.datum_std_m.hypot(std_m);
    }

    /// Estimates a persistent bias of each radio head.
    pub(in crate::localize) fn expect_persistent_biases(&mut self) {
        self.bias.expect_persistent();
    }

    /// Sets the odometer noise, so that angles determine the distance (m/√m).
    pub(in crate::localize) const fn expect_free_motion(&mut self, m_per_sqrt_m: f64) {
        self.config.noise.odometer_m_per_sqrt_m = m_per_sqrt_m;
    }

    /// Multiplies the odometer noise.
    pub(in crate::localize) fn scale_odometer_noise(&mut self, times: f64) {
        let noise = &mut self.config.noise;
        noise.odometer_m_per_sqrt_m *= times;
        noise.odometer_m_per_sqrt_s *= times;
    }

    /// Returns a filter with this configuration that restarts at the current position, with every
    /// source, a position standard deviation of `position_std_m`, and the heading of the road, or a
    /// standard deviation of 0.3 rad without a map.
    pub(in crate::localize) fn restarted(&self, config: &EkfConfig, position_std_m: f64) -> Self {
        let along_m = self.belief.mean[ALONG];
        let surveyed = |map: &&Arc<Road>| map.gap_between(along_m, along_m).is_none();
        let road = self.map.as_ref().filter(surveyed);
        let pose = match road {
            Some(map) => map.pose(along_m),
            None => locate(&self.belief.mean, 0.0, self.map.as_deref()).0,
        };
        let start = InitialPose {
            pose,
            position_std_m,
            heading_std_rad: if road.is_some() { 1.0 } else { 0.3 },
        };
        let heads: Vec<RadioHead> = self.heads.iter().map(|head| head.known).collect();
        let mut restarted = Self::new(*config, self.map.clone(), &heads, &start);
        // Where the road crosses itself, the nearest point may be on the wrong branch.
        if self.map.is_some() {
            restarted.belief.mean[ALONG] = along_m;
        }
        Self {
            odometry: self.odometry,
            driven_m: self.driven_m,
            ..restarted
        }
    }
}
