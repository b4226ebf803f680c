//! Extended Kalman filter: members and accessors.

use std::sync::Arc;

use super::config::EkfConfig;
use super::odometer::{SampleInterval, SpeedJumps};
use super::range::{BlockedPath, ClockStepTest, LatePath, RangeNoise};
use super::state::{
    ANGLE_TIME_OFFSET, Belief, MOUNTING, PHASE, SCALE, STATES, YAW_RATE_BIAS, YAW_RATE_SCALE,
};
use super::white_noise_fraction::{Residual, WhiteNoiseFraction};
use crate::clone_in_place::clone_in_place;
use crate::gaussian::CERTAIN_SIGMAS;
use crate::gaussian::smoother::Journal;
use crate::localize::bias::{AngleError, ErrorCorrelation, MultipathBias};
use crate::localize::output::InitialPose;
use crate::observation::{MeasurementKind, OdometrySample};
use crate::radio_head::RadioHead;
use crate::road::{Gap, Road};

/// Position off the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum OffMap {
    /// Certainly beyond an end of the road.
    Beyond {
        /// Distance from the end (m).
        by_m: f64,
    },
    /// Possibly within this gap.
    Gap(Gap),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Head {
    pub known: RadioHead,
    pub excluded: bool,
    /// Kind of the last used angle of the radio head.
    pub kind: MeasurementKind,
    /// Distance driven at the last used angle (m).
    pub last_update_m: f64,
    /// Time of the last used angle (s).
    pub last_update_s: f64,
    /// Heading of the vehicle at the last used angle (rad).
    pub last_update_rad: f64,
    /// Residual of the last used angle after its update.
    pub last_residual: Option<Residual>,
    /// Error of the last angle that a wavelength separates from the previous one.
    pub last_error: Option<AngleError>,
    /// First path at the last used angle.
    pub blocked: BlockedPath,
    /// First path according to the ranges, if there are no angles.
    pub late: LatePath,
    /// First path before the delay that was used in the newest test of a clock step.
    pub late_before_step: LatePath,
    /// Time of that delay (s).
    pub clock_test_s: f64,
    /// Distance driven at the last range (m) that was used, or late because of a blocked path.
    pub last_range_m: f64,
    /// Number of successive rejected ranges; without angles, of those that are too short.
    pub rejected_ranges: u16,
}

impl Head {
    /// Creates a radio head without any measurement.
    pub const fn new(known: RadioHead) -> Self {
        Self {
            known,
            excluded: false,
            kind: MeasurementKind::Angle,
            last_update_m: f64::NEG_INFINITY,
            last_update_s: f64::NEG_INFINITY,
            last_update_rad: f64::NEG_INFINITY,
            last_residual: None,
            last_error: None,
            blocked: BlockedPath::NEVER,
            late: LatePath::PRIOR,
            late_before_step: LatePath::PRIOR,
            clock_test_s: f64::NEG_INFINITY,
            last_range_m: f64::NEG_INFINITY,
            rejected_ranges: 0,
        }
    }

    pub fn is(&self, other: &RadioHead) -> bool {
        self.known.sends(other.pci, other.ssb_index)
    }
}

clone_in_place! {
    /// Extended Kalman filter. With a map its coordinates are along and across the road, otherwise
    /// Cartesian.
    #[derive(Debug, PartialEq)]
    pub struct Ekf {
        pub(super) config: EkfConfig,
        pub(super) map: Option<Arc<Road>>,
        pub(super) heads: Vec<Head>,
        pub(super) belief: Belief,
        /// Biases of the radio heads' angles, correlated over metres.
        pub(super) bias: MultipathBias,
        pub(super) odometry: Option<OdometrySample>,
        pub(super) driven_m: f64,
        pub(super) turned_rad: f64,
        /// Position off the map, where the road is unknown.
        pub(super) off_map: Option<OffMap>,
        pub(super) journal: Option<Journal<STATES>>,
        pub(super) sample_interval: SampleInterval,
        pub(super) speed_jumps: SpeedJumps,
        /// Distance by the speeds (m) since the odometer's distance last changed.
        pub(super) unread_m: f64,
        /// White fraction of the angles' noise.
        pub(super) white: WhiteNoiseFraction,
        /// Correlation of the angles' errors, where their biases are estimated.
        pub(super) error_correlation: ErrorCorrelation,
        /// Noise of the ranges relative to the specified one.
        pub(super) range_noise: RangeNoise,
        /// Random walk of the clocks relative to the specified one.
        pub(super) clock_noise: RangeNoise,
        /// Average fraction of blocked paths over the last ten independent ones, according to the ranges.
        pub(super) blocked_fraction: f64,
        /// Time of the last used delay, which determined the vehicle's clock (s).
        pub(super) last_delay_s: f64,
        /// Test of a clock step, while it runs.
        pub(super) clock_test: Option<ClockStepTest>,
        /// Whether a carrier phase has determined the common phase offset since the newest odometry.
        pub(super) knows_common_phase: bool,
    }
}

impl Ekf {
    /// Creates a filter at a given pose. `map` is the road, if known.
    pub fn new(
        config: EkfConfig,
        map: Option<Arc<Road>>,
        heads: &[RadioHead],
        start: &InitialPose,
    ) -> Self {
        let belief = Self::prior(&config, map.as_deref(), start);
        let mut ekf = Self {
            config,
            map,
            heads: heads.iter().copied().map(Head::new).collect(),
            belief,
            bias: Self::biases(&config, heads),
            odometry: None,
            driven_m: 0.0,
            turned_rad: 0.0,
            off_map: None,
            journal: None,
            sample_interval: SampleInterval::default(),
            speed_jumps: SpeedJumps::default(),
            unread_m: 0.0,
            white: WhiteNoiseFraction::new(config.correlated_noise.share),
            error_correlation: ErrorCorrelation::PRIOR,
            range_noise: RangeNoise::STATED,
            clock_noise: RangeNoise::STATED,
            blocked_fraction: 0.0,
            last_delay_s: f64::NEG_INFINITY,
            clock_test: None,
            knows_common_phase: false,
        };
        ekf.update_off_map();
        ekf
    }

    /// Returns the biases of the angles and the states of the ranges before any measurement.
    pub(super) fn biases(config: &EkfConfig, heads: &[RadioHead]) -> MultipathBias {
        let mut biases = MultipathBias::new(heads.len(), config.multipath_bias_probability);
        if let Some(model) = &config.ranging {
            biases.add_ranges(model, heads);
        }
        biases
    }

    pub(super) fn measure(&mut self, residual: f64, row: &[f64; STATES], variance: f64) {
        let journal = self.journal.as_mut();
        let record = journal.map(|journal| (journal, self.belief.variance_along(row) + variance));
        self.bias.update(&self.belief, residual, row, variance);
        let gain = self.belief.update(residual, row, variance);
        if let Some((journal, total)) = record
            && total > 0.0
        {
            let gains = gain.into_iter().chain(self.bias.gains(total));
            journal.measured(row, None, gains, residual, total);
        }
    }

    /// Returns the time of the newest odometry (s).
    pub fn time_s(&self) -> f64 {
        self.odometry
            .map_or(f64::NEG_INFINITY, |sample| sample.time_s)
    }

    /// Returns the state and its covariance.
    pub const fn belief(&self) -> &Belief {
        &self.belief
    }

    /// Replaces the state and its covariance when filters are merged.
    pub(in crate::localize) fn set_belief(&mut self, belief: &Belief) {
        self.belief = *belief;
        self.bias.decorrelate();
    }

    /// Returns the configuration.
    pub const fn config(&self) -> &EkfConfig {
        &self.config
    }

    /// Returns the estimated constants of the vehicle.
    pub fn constants(&self) -> EstimatedConstants {
        EstimatedConstants::new(&self.config, &self.belief)
    }

    /// Whether the filter estimates a time-correlated bias of the angles.
    pub(in crate::localize) const fn is_with_bias(&self) -> bool {
        !self.bias.is_empty()
    }

    /// Whether the filter has a map.
    pub(in crate::localize) const fn has_map(&self) -> bool {
        self.map.is_some()
    }

    /// Whether the odometer scale certainly differs from the specified one.
    pub(in crate::localize) fn odometer_departs(&self) -> bool {
        let mut scale = self.constants().odometer_scale;
        let walked = self.config.noise.scale_per_sqrt_m * self.driven_m.sqrt();
        scale.stated_std = scale.stated_std.hypot(walked);
        scale.departs()
    }

    /// Whether the angles determine the odometer scale better than its specification.
    pub(in crate::localize) fn knows_odometer(&self) -> bool {
        self.belief.covariance[SCALE][SCALE] < 0.5 * self.config.odometer_scale_std.powi(2)
    }

    /// Sets the ratio of the angles' variance to the specified one; `None` for the specified
    /// variance.
    pub(in crate::localize) fn set_noise_scale(&mut self, ratio: Option<f64>) {
        self.config.set_noise_scale(ratio);
    }

    /// Returns the usual interval of the odometry (s).
    pub(in crate::localize) const fn sample_interval_s(&self) -> f64 {
        self.sample_interval.usual_s()
    }

    /// Returns the distance driven since the start (m).
    pub const fn driven_m(&self) -> f64 {
        self.driven_m
    }

    /// Sets the gate of the squared Mahalanobis distance.
    pub fn set_gate(&mut self, gate: f64) {
        self.config.gate = gate;
    }

    /// Returns the relative, physically impossible jump of the speed at the newest odometry; 0 if
    /// there is none.
    pub(in crate::localize) const fn speed_jump(&self) -> f64 {
        self.speed_jumps.speed_jump
    }

    /// Excludes the angles of a radio head, or includes them again.
    pub fn set_excluded(&mut self, head: &RadioHead, excluded: bool) {
        for mine in self.heads.iter_mut().filter(|mine| mine.is(head)) {
            mine.excluded = excluded;
        }
    }
}

/// Constant: specified and estimated value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedConstant {
    /// Specified value.
    pub stated: f64,
    /// Specified standard deviation.
    pub stated_std: f64,
    /// Estimated value.
    pub found: f64,
    /// Standard deviation of the estimate.
    pub std: f64,
}

impl EstimatedConstant {
    /// Returns the difference from the specified value.
    pub fn departure(&self) -> f64 {
        self.found - self.stated
    }

    /// Whether the difference exceeds `least` with certainty.
    pub fn certainly_differs_by(&self, least: f64) -> bool {
        let by = self.departure().abs();
        by > least && by > 2.0 * self.std
    }

    /// Whether the value certainly contradicts its specification: the difference exceeds three
    /// specified standard deviations by three estimated ones. Fewer than 0.27 % of
    /// the drives with a correct specification exceed it.
    pub fn departs(&self) -> bool {
        self.departure().abs() > CERTAIN_SIGMAS * (self.stated_std + self.std)
    }
}

/// Constants of the vehicle, estimated while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimatedConstants {
    /// Odometer scale: distance measured per distance driven.
    pub odometer_scale: EstimatedConstant,
    /// Bias of the yaw rate (rad/s).
    pub yaw_rate_bias_radps: EstimatedConstant,
    /// Scale of the yaw rate: heading change measured per heading change.
    pub yaw_rate_scale: EstimatedConstant,
    /// Direction of the array axis (rad).
    pub mounting_rad: EstimatedConstant,
    /// Residual phase per antenna after calibration (rad).
    pub phase_rad: EstimatedConstant,
    /// Time offset of the angles in addition to the specified one (s).
    pub angle_time_offset_s: EstimatedConstant,
}

impl EstimatedConstants {
    pub(super) fn new(config: &EkfConfig, belief: &Belief) -> Self {
        let constant = |state: usize, offset: f64, (stated, stated_std)| EstimatedConstant {
            stated,
            stated_std,
            found: offset + belief.mean[state],
            std: belief.covariance[state][state].max(0.0).sqrt(),
        };
        let yaw_rate_bias = (config.yaw_rate_bias_radps, config.yaw_rate_bias_std_radps);
        Self {
            odometer_scale: constant(
                SCALE,
                1.0,
                (config.odometer_scale, config.odometer_scale_std),
            ),
            yaw_rate_bias_radps: constant(YAW_RATE_BIAS, 0.0, yaw_rate_bias),
            yaw_rate_scale: constant(YAW_RATE_SCALE, 1.0, (1.0, config.yaw_rate_scale_std)),
            mounting_rad: constant(
                MOUNTING,
                0.0,
                (config.mounting_rad, config.mounting_std_rad),
            ),
            phase_rad: constant(PHASE, 0.0, (config.phase_rad, config.phase_std_rad)),
            angle_time_offset_s: constant(
                ANGLE_TIME_OFFSET,
                0.0,
                (0.0, config.angle_time_offset_std_s),
            ),
        }
    }

    /// Whether mounting or phase calibration of the array are no longer valid.
    pub fn array_departs(&self) -> bool {
        self.mounting_rad.departs() || self.phase_rad.departs()
    }
}
