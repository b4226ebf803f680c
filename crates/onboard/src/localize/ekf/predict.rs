//! Prediction with an odometry sample.

use super::filter::{Ekf, OffMap};
use super::motion::{Reading, Step, Yaw};
use super::state::{ACROSS, ALONG, Belief, HEADING, SCALE, STATES, YAW_RATE_BIAS};
use crate::gaussian::CERTAIN_SIGMAS;
use crate::localize::output::OdometryResult;
use crate::observation::OdometrySample;
use crate::road::Gap;
use crate::settings::DriveKind;

/// Maximum step with constant curvature of the road (m).
const STEP_M: f64 = 1.0;

/// Maximum number of steps per sample. After a kilometre without odometry, the number of bends is
/// unknown anyway.
pub(super) const MAX_STEPS: f64 = 1000.0;

/// Speeds above this multiple of the vehicle's top speed are replaced by it.
const WILD: f64 = 10.0;

/// Minimum change of the speed for slip, in standard deviations of a speed measurement.
const SIGMAS_OF_SLIP: f64 = 5.0;
/// Maximum increase of the odometer scale's standard deviation by slip.
pub(in crate::localize) const MAX_SLIP: f64 = 0.3;

/// Range of the ratio between the distance by the speeds and the measured distance in which the
/// distance by the speeds is used.
const DRIVEN_BY_READ: [f64; 2] = [0.5, 1e3];

/// Random walk of the odometer scale if slip without a jump of the speed is possible (per √m).
const SLIP_WALK_PER_SQRT_M: f64 = 0.1;

/// Standard deviation of the position at which the vehicle adopts a new curvature (m). A real
/// vehicle does so over about its own length, not at a point as in maps of arcs.
const TRANSITION_M: f64 = 0.5;

/// Gate of the yaw rate's squared Mahalanobis distance on a road: 6σ.
const TURN_GATE: f64 = 36.0;

/// Standard deviation of the change of the yaw rate that a rejected yaw rate may have hidden
/// (rad/s).
const REFUSED_RADPS: f64 = 0.5;

/// Noise of a yaw rate that may be at fault (rad/√s): as an error of 0.1 rad/s with a correlation
/// time of 5 s.
pub(super) const FAULTY_YAW_NOISE_RAD_PER_SQRT_S: f64 = 0.3;

/// Random walk of the yaw rate during lost samples: spectral density of a white angular
/// acceleration (rad²/s³), a change of 0.5 rad/s within half a second.
const YAW_RATE_WALK: f64 = 0.5;

impl Ekf {
    /// Predicts the state with one odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryResult {
        if !sample.is_finite() {
            return OdometryResult::NotFinite;
        }
        let max_mps = WILD * self.config.top_speed_mps;
        let sample = &OdometrySample {
            speed_mps: sample.speed_mps.clamp(-max_mps, max_mps),
            ..*sample
        };
        let Some(previous) = self.odometry else {
            self.odometry = Some(*sample);
            self.record_output(sample.time_s);
            return OdometryResult::First;
        };
        let duration_s = sample.time_s - previous.time_s;
        if duration_s == 0.0 {
            return OdometryResult::Duplicate;
        }
        if duration_s < 0.0 {
            return OdometryResult::TimeBackwards;
        }
        self.odometry = Some(*sample);
        self.detect_slip(&previous, sample, duration_s);
        let moved_m = sample.distance_m - previous.distance_m;
        // After a reset or overflow of the counter, the speeds determine the distance.
        let jumped = moved_m.abs() > self.config.top_speed_mps * duration_s + 0.1;
        let reading_m = if jumped {
            0.5 * (previous.speed_mps + sample.speed_mps) * duration_s
        } else {
            moved_m
        };
        let mean_mps = 0.5 * (previous.speed_mps + sample.speed_mps);
        let reading = self.reading(reading_m, mean_mps * duration_s);
        let read_radps = sample.yaw_rate_radps;
        let credible = |rate: &f64| rate.abs() <= self.config.top_yaw_rate_radps;
        let refused = read_radps.filter(|rate| !credible(rate));
        // If the yaw rate was rejected, the vehicle continues its turn, or changes it within
        // physical limits.
        let rate = read_radps.filter(credible);
        let before = previous.yaw_rate_radps.filter(credible);
        let rate = rate.or(before.filter(|_| refused.is_some()));
        // If samples were lost, the yaw rate is unknown until the last of the lost samples was due.
        let covered_s = self.sample_interval.covered_s(duration_s);
        let lost_s = duration_s - covered_s;
        let mut covered = reading;
        if let (Some(rate), true) = (rate, lost_s > 0.0) {
            covered = reading.share(covered_s / duration_s);
            let guessed = (self.follows_yaw_rate())
                .then(|| self.guessed_yaw(before.unwrap_or(rate), rate, lost_s));
            self.advance(reading.share(lost_s / duration_s), lost_s, guessed);
        }
        let yaw = rate.map(|rate| {
            let mut yaw = self.yaw(rate, covered_s);
            let change_rad = (before.unwrap_or(rate) - rate) * covered_s;
            if refused.is_some() {
                yaw.variance += (REFUSED_RADPS * covered_s).powi(2);
            } else if self.follows_yaw_rate() {
                // The yaw rate changed at an unknown time between two samples, which is uniformly
                // distributed.
                yaw.variance += change_rad * change_rad / 12.0;
            }
            yaw
        });
        let last_s = if yaw.is_some() { covered_s } else { duration_s };
        self.advance(covered, last_s, yaw);
        self.advance_ranges(reading_m, duration_s);
        self.bias.advance_persistent(reading_m);
        if jumped {
            self.add_along_variance(self.config.coasting_variance(duration_s));
        }
        self.record_output(sample.time_s);
        if jumped {
            OdometryResult::DistanceJump { jump_m: moved_m }
        } else if let Some(radps) = refused {
            OdometryResult::YawRateRefused { radps }
        } else if duration_s > self.config.gap_s {
            OdometryResult::AfterGap { gap_s: duration_s }
        } else {
            match self.off_map {
                Some(OffMap::Beyond { by_m }) => OdometryResult::BeyondMap { by_m },
                Some(OffMap::Gap(Gap { from_m, to_m })) => {
                    OdometryResult::InMapGap { from_m, to_m }
                }
                None => OdometryResult::Accepted,
            }
        }
    }

    /// Models slip if the speed jumps beyond physical limits, as a jump of the odometer scale, or
    /// if the vehicle starts to move and may slip without a jump. The wheels of a differential
    /// drive may follow a command immediately.
    fn detect_slip(&mut self, previous: &OdometrySample, sample: &OdometrySample, duration_s: f64) {
        if self.config.drive != DriveKind::Road {
            return;
        }
        let usual_mps = SIGMAS_OF_SLIP * self.config.speed_noise_mps;
        let mut min_mps = usual_mps.max(self.config.slip_acceleration_mps2 * duration_s.max(0.02));
        if (sample.speed_mps - previous.speed_mps).abs() > min_mps {
            min_mps += self.bend_mps(sample.speed_mps, duration_s);
        }
        (self.speed_jumps).step(previous.speed_mps, sample.speed_mps, min_mps);
        let sets_off = previous.speed_mps == 0.0 && sample.speed_mps != 0.0;
        let unseen = self.config.may_slip && sets_off;
        self.slip(if unseen {
            MAX_SLIP
        } else {
            self.speed_jumps.speed_jump
        });
    }

    /// Returns the measured distance and the distance by the speeds, which determines the noise. A
    /// measured distance that is too short by chance, or because of the counter's resolution, is
    /// not more precise. With noise in proportion to the measured distance, the odometer would
    /// dominate the yaw rate whenever it measures too little.
    fn reading(&mut self, read_m: f64, driven_m: f64) -> Reading {
        self.unread_m += driven_m;
        if read_m == 0.0 {
            return Reading::exact(read_m);
        }
        let share = std::mem::take(&mut self.unread_m) / read_m;
        if share == 0.0 || !share.is_finite() {
            return Reading::exact(read_m); // no speed, or no time
        }
        let [least, most] = DRIVEN_BY_READ;
        let driven_m = read_m * share.abs().clamp(least, most).copysign(share);
        Reading { read_m, driven_m }
    }

    /// Returns the change of the speed due to the start or end of a bend, whose inner side is
    /// shorter.
    pub(in crate::localize) fn bend_mps(&self, speed_mps: f64, duration_s: f64) -> f64 {
        let Some(map) = &self.map else {
            return 0.0;
        };
        let (mean, covariance) = (&self.belief.mean, &self.belief.covariance);
        let reach_m =
            CERTAIN_SIGMAS * covariance[ALONG][ALONG].sqrt() + speed_mps.abs() * duration_s;
        let aside_m = mean[ACROSS].abs() + CERTAIN_SIGMAS * covariance[ACROSS][ACROSS].sqrt();
        let [before, after] = [-reach_m, reach_m].map(|by| map.curvature_per_m(mean[ALONG] + by));
        (after - before).abs() * aside_m * speed_mps.abs()
    }

    /// Adds the variance of a relative change of the odometer scale.
    fn slip(&mut self, by: f64) {
        let variance = &mut self.belief.covariance[SCALE][SCALE];
        *variance = variance.max((*variance + by * by).min(MAX_SLIP * MAX_SLIP));
    }

    /// Returns the yaw rate measurement of a step.
    fn yaw(&self, rate_radps: f64, duration_s: f64) -> Yaw {
        Yaw {
            turn_rad: rate_radps * duration_s,
            duration_s,
            is_measured: true,
            variance: self.config.yaw_noise_rad_per_sqrt_s.powi(2) * duration_s,
        }
    }

    /// Returns the heading change between two yaw rates with lost samples in between: the mean of
    /// both, and a Brownian bridge.
    fn guessed_yaw(&self, from_radps: f64, to_radps: f64, duration_s: f64) -> Yaw {
        let change_rad = (to_radps - from_radps) * duration_s;
        let wander = YAW_RATE_WALK * duration_s.powi(3);
        let max_rad = self.config.top_yaw_rate_radps * duration_s;
        Yaw {
            turn_rad: 0.5 * (from_radps + to_radps) * duration_s,
            duration_s,
            is_measured: false,
            variance: ((change_rad * change_rad).max(wander) / 12.0).min(max_rad * max_rad),
        }
    }

    /// Whether the yaw rate alone determines the heading.
    fn follows_yaw_rate(&self) -> bool {
        self.config.drive == DriveKind::Differential || self.map.is_none()
    }

    fn advance(&mut self, reading: Reading, duration_s: f64, yaw: Option<Yaw>) {
        let steps = (reading.read_m.abs() / STEP_M).ceil().clamp(1.0, MAX_STEPS);
        let share = 1.0 / steps;
        let yaw = yaw.map(|yaw| Yaw {
            turn_rad: yaw.turn_rad * share,
            duration_s: yaw.duration_s * share,
            variance: yaw.variance * share,
            ..yaw
        });
        for _ in 0..steps as usize {
            let step = self.next_step(reading.share(share), duration_s * share, yaw);
            if let Some(journal) = &mut self.journal {
                journal.moved(&step.jacobian);
            }
            step.apply(&mut self.belief);
            self.bias.moved(&step.jacobian);
        }
        self.turned_rad += yaw.map_or(0.0, |yaw| yaw.turn_rad.abs()) * steps;
        self.driven_m += reading.read_m.abs() / (1.0 + self.belief.mean[SCALE]);
        self.update_off_map();
    }

    /// Returns the step of an odometry sample, and updates the current state with the gyroscope.
    fn next_step(&mut self, reading: Reading, duration_s: f64, yaw: Option<Yaw>) -> Step {
        let read_m = reading.read_m;
        if self.config.drive == DriveKind::Differential {
            let turn = yaw.unwrap_or_else(|| self.config.unknown_turn(read_m, duration_s));
            if read_m == 0.0 && turn.turn_rad == 0.0 && turn.is_measured {
                return Step::standing(&self.belief.mean); // the wheels do
            }
            return Step::turning(&self.belief.mean, read_m, &turn, &self.config.noise);
        }
        if let (None, Some(yaw)) = (&self.map, yaw) {
            if read_m != 0.0 {
                return Step::turning(&self.belief.mean, read_m, &yaw, &self.config.noise);
            }
            // Steered wheels at standstill do not turn the vehicle: the measured yaw rate is the
            // bias.
            let mut row = [0.0; STATES];
            row[YAW_RATE_BIAS] = yaw.duration_s;
            let expected = self.belief.mean[YAW_RATE_BIAS] * yaw.duration_s;
            self.measure(yaw.turn_rad - expected, &row, yaw.variance);
            return Step::standing(&self.belief.mean);
        }
        let step = self.step(&self.belief, &reading);
        let Some(yaw) = yaw else {
            return step;
        };
        let (residual, row, mut variance) = step.turn_seen(&self.belief.mean, &yaw);
        // The weight of an improbable measurement is reduced to that at the gate (Huber).
        let surprise = self.belief.innovation(residual, &row, variance);
        if surprise.mahalanobis2() > TURN_GATE {
            variance += residual * residual / TURN_GATE - surprise.variance;
        }
        self.measure(residual, &row, variance);
        self.step(&self.belief, &reading)
            .informed(&self.belief.mean, &yaw)
    }

    /// Returns the expected step for an odometer measurement.
    pub(super) fn step(&self, belief: &Belief, reading: &Reading) -> Step {
        let (mean, config, read_m) = (&belief.mean, &self.config, reading.read_m);
        if config.drive == DriveKind::Differential {
            let straight_on = Yaw {
                turn_rad: 0.0,
                duration_s: 0.0,
                variance: 0.0,
                is_measured: false,
            };
            return Step::turning(mean, read_m, &straight_on, &config.noise);
        }
        let noise = &config.noise;
        let Some(map) = &self.map else {
            return Step::in_plane(mean, read_m, 0.0, &config.path_bend, noise);
        };
        let middle_m = mean[ALONG] + 0.5 * read_m;
        if self.off_map.is_some() {
            let curvature_per_m = map.curvature_per_m(middle_m);
            return Step::in_plane(mean, read_m, curvature_per_m, &config.path_bend, noise);
        }
        let variance = |state: usize| belief.covariance[state][state].max(0.0);
        let road = map.bending(middle_m, variance(ALONG).sqrt().max(TRANSITION_M));
        let keeping = &config.lane_keeping;
        Step::along_lane(mean, variance(HEADING), reading, &road, keeping, noise)
    }

    fn add_along_variance(&mut self, variance: f64) {
        if self.map.is_some() {
            self.belief.covariance[ALONG][ALONG] += variance;
            return;
        }
        let (sin, cos) = self.belief.mean[HEADING].sin_cos();
        let direction = [cos, sin];
        for i in 0..2 {
            for j in 0..2 {
                self.belief.covariance[i][j] += variance * direction[i] * direction[j];
            }
        }
    }

    /// Models slip from now on: a change of the scale at once and whenever the vehicle starts to
    /// move (if the speed does not reveal it), with every jump of the speed beyond its
    /// acceleration, and with every metre of a differential drive, whose speed may jump. The yaw
    /// rate of a road vehicle may be wrong, too. A differential drive has no other source of the
    /// heading: a filter without it would know nothing between two angles.
    pub(in crate::localize) fn expect_slip(&mut self, by: f64) {
        let config = &mut self.config;
        config.may_slip = true;
        config.slip_acceleration_mps2 = config.acceleration_mps2;
        if config.drive == DriveKind::Differential {
            config.noise.scale_per_sqrt_m = SLIP_WALK_PER_SQRT_M;
        } else {
            config.yaw_noise_rad_per_sqrt_s =
                (config.yaw_noise_rad_per_sqrt_s).max(FAULTY_YAW_NOISE_RAD_PER_SQRT_S);
        }
        self.slip(by);
    }
}
