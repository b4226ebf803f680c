//! The tracker: an extended Kalman filter over pose, odometer scale and array calibration,
//! predicted by odometry and updated by electrical angles.
//!
//! The electrical angle `ω = 2π (d/λ) cos θ` has Gaussian noise whose size does not depend on the
//! direction; the angle θ has neither property near end-fire, and a filter that takes θ believes
//! itself far too much there. Scatter is a second noise, the same for every look within half a
//! wavelength of travel, and is counted once per half wavelength.

mod calibration;
mod config;
mod doubt;
mod interface;
pub(super) mod motion;
pub(super) mod sighting;
pub mod state;

use std::sync::Arc;

use crate::geometry::{Pose, wrap_angle};
use crate::localize::gaussian::{Innovation, identity};
use crate::localize::smoother::Journal;
use crate::localize::{AngleMeasurement, PoseEstimate, UpdateReason, UpdateVerdict};
use crate::observation::OdometrySample;
use crate::world::{RadioHead, Track};

pub use calibration::{Calibration, Departure};
pub use config::TrackerConfig;
pub use interface::{InitialPose, OdometryVerdict};
pub use motion::{MotionNoise, PathBend};
pub use sighting::ArrayModel;

use motion::{Step, Yaw};
use sighting::{Footing, Sighting};
use state::{
    ACROSS, ALONG, Belief, CURVATURE, HEADING, MOUNTING, PHASE, SCALE, STATES, YAW_RATE_BIAS,
};

/// Longest step of a forecast (m), where millimetres do not matter.
const FORECAST_STEP_M: f64 = 5.0;

/// Longest step over which the road's curvature is taken as constant (m).
const STEP_M: f64 = 1.0;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Head {
    known: RadioHead,
    excluded: bool,
    /// Distance driven when its last angle was used (m).
    last_look_m: f64,
}

impl Head {
    fn is(&self, other: &RadioHead) -> bool {
        (self.known.pci, self.known.ssb_index) == (other.pci, other.ssb_index)
    }
}

/// The tracker. With a map it works along and across the road, without in the plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracker {
    config: TrackerConfig,
    map: Option<Arc<Track>>,
    heads: Vec<Head>,
    belief: Belief,
    odometry: Option<OdometrySample>,
    driven_m: f64,
    /// Whether the vehicle has driven off the end of the map.
    beyond_map: bool,
    journal: Option<Journal<STATES>>,
}

impl Tracker {
    /// A tracker that starts from a given pose. `map` is the course of the road, if known.
    pub fn new(
        config: TrackerConfig,
        map: Option<Arc<Track>>,
        heads: &[RadioHead],
        start: &InitialPose,
    ) -> Self {
        let belief = Self::prior(&config, map.as_deref(), start);
        let head = |&known| Head {
            known,
            excluded: false,
            last_look_m: f64::NEG_INFINITY,
        };
        Self {
            config,
            map,
            heads: heads.iter().map(head).collect(),
            belief,
            odometry: None,
            driven_m: 0.0,
            beyond_map: false,
            journal: None,
        }
    }

    /// Moves the state by one odometry sample.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryVerdict {
        let yaw_is_finite = sample.yaw_rate_radps.is_none_or(f64::is_finite);
        let finite = sample.time_s.is_finite()
            && sample.distance_m.is_finite()
            && sample.speed_mps.is_finite();
        if !finite || !yaw_is_finite {
            return OdometryVerdict::NotFinite;
        }
        let Some(previous) = self.odometry else {
            self.odometry = Some(*sample);
            self.ask(sample.time_s);
            return OdometryVerdict::First;
        };
        let duration_s = sample.time_s - previous.time_s;
        if duration_s == 0.0 {
            return OdometryVerdict::Duplicate;
        }
        if duration_s < 0.0 {
            return OdometryVerdict::TimeBackwards;
        }
        self.odometry = Some(*sample);
        // A jump of the speed that no vehicle can do is a jump of the odometer's scale: slip.
        let leap_mps = (sample.speed_mps - previous.speed_mps).abs();
        if leap_mps > self.config.leap_mps2 * duration_s.max(0.02) {
            let leap = leap_mps / previous.speed_mps.abs().max(sample.speed_mps.abs());
            self.belief.covariance[SCALE][SCALE] += leap * leap;
        }
        let moved_m = sample.distance_m - previous.distance_m;
        // A counter that was reset or overflowed says nothing of the distance: the speeds do.
        let jumped = moved_m.abs() > self.config.top_speed_mps * duration_s + 0.1;
        let reading_m = if jumped {
            0.5 * (previous.speed_mps + sample.speed_mps) * duration_s
        } else {
            moved_m
        };
        let yaw = sample.yaw_rate_radps.map(|rate| Yaw {
            turn_rad: rate * duration_s,
            duration_s,
            variance: self.config.yaw_noise_rad_per_sqrt_s.powi(2) * duration_s,
        });
        self.advance(reading_m, yaw);
        if jumped {
            self.add_along_variance(self.config.coasting_variance(duration_s));
        }
        self.ask(sample.time_s);
        if jumped {
            OdometryVerdict::DistanceJump { jump_m: moved_m }
        } else if duration_s > self.config.gap_s {
            OdometryVerdict::AfterGap { gap_s: duration_s }
        } else if self.beyond_map {
            OdometryVerdict::BeyondMap {
                by_m: self.off_map_m(),
            }
        } else {
            OdometryVerdict::Accepted
        }
    }

    /// Corrects the state by one electrical angle to a radio head.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateVerdict {
        let looked = match self.look(head, measured) {
            Ok(looked) if looked.excluded => {
                return self.verdict(UpdateReason::Excluded, None);
            }
            Ok(looked) => looked,
            Err(reason) => return self.verdict(reason, None),
        };
        let mahalanobis2 = looked.innovation.mahalanobis2();
        if mahalanobis2 > self.config.gate {
            return self.verdict(UpdateReason::Outlier, Some(mahalanobis2));
        }
        let innovation = looked.innovation;
        let (mut residual, mut variance) = (innovation.residual, innovation.measurement_variance);
        if !measured.resolved {
            let Some(likely) = doubt::equivalent(&innovation) else {
                return self.verdict(UpdateReason::Outlier, Some(mahalanobis2));
            };
            (residual, variance) = likely;
        }
        self.measure(residual, &looked.row, variance);
        if let Some(head) = self.heads.get_mut(looked.head) {
            head.last_look_m = looked.place_m;
        }
        self.verdict(UpdateReason::Consistent, Some(mahalanobis2))
    }

    /// The innovation that an angle to an excluded radio head would bring; it counts as a look.
    pub(in crate::localize) fn rehearse_excluded(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Option<Innovation> {
        let looked = self.look(head, measured).ok()?;
        self.heads.get_mut(looked.head)?.last_look_m = looked.place_m;
        Some(looked.innovation)
    }

    fn verdict(&self, reason: UpdateReason, mahalanobis2: Option<f64>) -> UpdateVerdict {
        UpdateVerdict {
            accepted: reason == UpdateReason::Consistent,
            reason,
            mahalanobis_squared: mahalanobis2,
            threshold: Some(self.config.gate),
        }
    }

    fn look(&self, head: &RadioHead, measured: &AngleMeasurement) -> Result<Look, UpdateReason> {
        let sigma = measured.phase_sigma_rad;
        let usable = measured.time_s.is_finite()
            && measured.phase_rad.is_finite()
            && sigma.is_finite()
            && sigma > 0.0;
        if !usable {
            return Err(UpdateReason::Unusable);
        }
        if measured.time_s < self.time_s() {
            return Err(UpdateReason::TimeReversed);
        }
        let (index, head) = (self.heads.iter().enumerate())
            .find(|(_, mine)| mine.is(head))
            .ok_or(UpdateReason::UnknownRadioHead)?;
        let (ahead_m, ahead_variance) = self.coasting(measured.time_s);
        let (pose, footing) = locate(&self.belief.mean, ahead_m, self.map.as_deref());
        let (mounting, offset) = (self.belief.mean[MOUNTING], self.belief.mean[PHASE]);
        let array = &self.config.array;
        let sighting = Sighting::new(head.known.position, pose, &footing, mounting, offset, array)
            .ok_or(UpdateReason::Unusable)?;
        let bend = sighting.bend(&self.belief.covariance);
        let place_m = self.driven_m + ahead_m;
        let scatter = (self.config).look_variance(place_m - head.last_look_m, sighting.toward);
        let measurement_variance =
            sigma * sigma + scatter + sighting.row[ALONG].powi(2) * ahead_variance + bend.variance;
        let residual = wrap_angle(measured.phase_rad - sighting.phase_rad - bend.shift_rad);
        let innovation = (self.belief).innovation(residual, &sighting.row, measurement_variance);
        Ok(Look {
            head: index,
            excluded: head.excluded,
            place_m,
            row: sighting.row,
            innovation,
        })
    }

    /// Time of the newest odometry (s).
    pub fn time_s(&self) -> f64 {
        self.odometry
            .map_or(f64::NEG_INFINITY, |sample| sample.time_s)
    }

    /// The state and its covariance.
    pub const fn belief(&self) -> &Belief {
        &self.belief
    }

    /// Replaces the state and its covariance, where several trackers become one.
    pub(in crate::localize) const fn set_belief(&mut self, belief: &Belief) {
        self.belief = *belief;
    }

    /// What the tracker assumes.
    pub const fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// How far the array has come from its survey.
    pub fn calibration(&self) -> Calibration {
        Calibration::new(&self.config, &self.belief)
    }

    /// Distance driven since the start (m).
    pub const fn driven_m(&self) -> f64 {
        self.driven_m
    }

    /// The innovation that an angle would bring; `None` where it would bring none.
    pub fn innovation(&self, head: &RadioHead, measured: &AngleMeasurement) -> Option<Innovation> {
        self.look(head, measured)
            .ok()
            .filter(|looked| !looked.excluded)
            .map(|looked| looked.innovation)
    }

    /// Sets the largest squared Mahalanobis distance of an angle that is used.
    pub fn set_gate(&mut self, gate: f64) {
        self.config.gate = gate;
    }

    /// Leaves the angles of a radio head unused, or uses them again.
    pub fn set_excluded(&mut self, head: &RadioHead, excluded: bool) {
        for mine in self.heads.iter_mut().filter(|mine| mine.is(head)) {
            mine.excluded = excluded;
        }
    }

    /// The same tracker begun anew where it is, every source in use, its place known to
    /// `position_std_m` and its heading by the road alone, or without a map by a quarter turn.
    pub(in crate::localize) fn restarted(&self, position_std_m: f64) -> Self {
        let along_m = self.belief.mean[ALONG];
        let pose = match &self.map {
            Some(map) => map.pose(along_m),
            None => locate(&self.belief.mean, 0.0, None).0,
        };
        let start = InitialPose {
            pose,
            position_std_m,
            heading_std_rad: if self.map.is_some() { 1.0 } else { 0.3 },
        };
        let heads: Vec<RadioHead> = self.heads.iter().map(|head| head.known).collect();
        let mut restarted = Self::new(self.config, self.map.clone(), &heads, &start);
        // Where the road crosses itself its nearest place may be another one.
        if self.map.is_some() {
            restarted.belief.mean[ALONG] = along_m;
        }
        Self {
            odometry: self.odometry,
            driven_m: self.driven_m,
            ..restarted
        }
    }

    /// Keeps a journal from now on, from which the drive can be smoothed; it grows by about 2 kB
    /// with each odometry sample.
    pub fn keep_journal(&mut self) {
        self.journal.get_or_insert_default();
    }

    /// The poses at the odometry samples since the journal was begun, by everything that is known
    /// now; none without a journal.
    pub fn smoothed(&self) -> Vec<PoseEstimate> {
        let journal = self.journal.iter();
        let beliefs = journal.flat_map(Journal::smoothed);
        beliefs
            .map(|(time_s, belief)| self.pose_of(&belief, time_s, 0.0, 0.0))
            .collect()
    }

    /// The pose at `time_s`, carried on from the newest odometry at its speed.
    pub fn pose(&self, time_s: f64) -> PoseEstimate {
        let (lag_m, lag_variance) = self.coasting(time_s);
        self.pose_of(&self.belief, time_s, lag_m, lag_variance)
    }

    /// The pose of a belief, `lag_m` further on than it says.
    fn pose_of(&self, belief: &Belief, time_s: f64, lag_m: f64, lag_variance: f64) -> PoseEstimate {
        let map = self.map.as_deref();
        let (pose, footing) = locate(&belief.mean, lag_m, map);
        let (sin, cos) = footing.direction_rad.sin_cos();
        // (x, y, heading) by (along, across, heading).
        let jacobian = [
            [cos * footing.stretch, -sin, 0.0],
            [sin * footing.stretch, cos, 0.0],
            [footing.curvature_per_m, 0.0, 1.0],
        ];
        let mut inner = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                inner[i][j] = belief.covariance[i][j];
            }
        }
        inner[0][0] += lag_variance;
        let mut covariance = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    for l in 0..3 {
                        covariance[i][j] += jacobian[i][k] * inner[k][l] * jacobian[j][l];
                    }
                }
            }
        }
        PoseEstimate {
            time_s,
            pose,
            covariance: Some(covariance),
            integrity: None,
        }
    }

    /// The belief at `time_s`, had the vehicle driven on at its speed and heard nothing.
    pub fn forecast(&self, time_s: f64) -> Belief {
        let lag_s = (time_s - self.time_s()).max(0.0);
        let speed_mps = self.odometry.map_or(0.0, |sample| sample.speed_mps);
        if speed_mps == 0.0 {
            return self.belief;
        }
        self.carry(self.belief, speed_mps * lag_s)
    }

    /// A belief carried on by what the odometer would read, nothing being heard.
    pub fn carry(&self, mut belief: Belief, reading_m: f64) -> Belief {
        let steps = (reading_m.abs() / FORECAST_STEP_M).ceil();
        for _ in 0..steps as usize {
            self.step(&belief, reading_m / steps).apply(&mut belief);
        }
        belief
    }

    /// Variances of a belief's horizontal error along its principal axes, larger first (m²).
    pub fn principal_variances(belief: &Belief) -> [f64; 2] {
        let [[aa, ab, ..], [_, bb, ..], ..] = belief.covariance;
        let half = (0.25 * (aa - bb) * (aa - bb) + ab * ab).sqrt();
        let mean = 0.5 * (aa + bb);
        [mean + half, (mean - half).max(0.0)]
    }

    /// What an angle of thermal variance `thermal(distance)` to `head` would make of a belief
    /// `ahead_m` further on than the newest odometry.
    pub fn rehearse(
        &self,
        belief: &Belief,
        ahead_m: f64,
        head: &RadioHead,
        thermal: impl Fn(f64) -> f64,
    ) -> Option<Belief> {
        let known = self.heads.iter().find(|mine| mine.is(head))?;
        if known.excluded {
            return None;
        }
        let (pose, footing) = locate(&belief.mean, 0.0, self.map.as_deref());
        let (mounting, offset) = (belief.mean[MOUNTING], belief.mean[PHASE]);
        let array = &self.config.array;
        let place = known.known.position;
        let sighting = Sighting::new(place, pose, &footing, mounting, offset, array)?;
        let travelled_m = self.driven_m + ahead_m - known.last_look_m;
        let variance =
            thermal(sighting.range_m) + self.config.look_variance(travelled_m, sighting.toward);
        let mut rehearsed = *belief;
        rehearsed.update(0.0, &sighting.row, variance);
        Some(rehearsed)
    }

    /// The belief before any measurement.
    pub(super) fn prior(
        config: &TrackerConfig,
        map: Option<&Track>,
        start: &InitialPose,
    ) -> Belief {
        let mut sigma = [0.0; STATES];
        sigma[SCALE] = config.odometer_scale_std;
        sigma[YAW_RATE_BIAS] = config.yaw_rate_bias_std_radps;
        sigma[MOUNTING] = config.mounting_std_rad;
        sigma[PHASE] = config.phase_std_rad;
        let mut mean = [0.0; STATES];
        mean[MOUNTING] = config.mounting_rad;
        let Some(map) = map else {
            mean[ALONG] = start.pose.x_m;
            mean[ACROSS] = start.pose.y_m;
            mean[HEADING] = start.pose.heading_rad;
            sigma[ALONG] = start.position_std_m;
            sigma[ACROSS] = start.position_std_m;
            sigma[HEADING] = start.heading_std_rad;
            // The path bends with the road, and back to the middle of the lane.
            let pull_per_m = config.lane_keeping.pull_per_m();
            sigma[CURVATURE] = config.path_bend.curvature_per_m.hypot(pull_per_m);
            return Belief::independent(mean, sigma);
        };
        let place = map.project(start.pose.point());
        let [offset_variance, heading_variance] = config.lane_keeping.stationary();
        mean[ALONG] = place.along_m;
        sigma[ALONG] = start.position_std_m;
        sigma[ACROSS] = offset_variance.sqrt();
        sigma[HEADING] = heading_variance.sqrt();
        let mut belief = Belief::independent(mean, sigma);
        // The given pose is a measurement beside what lane keeping already says.
        let heading_rad = wrap_angle(start.pose.heading_rad - map.pose(place.along_m).heading_rad);
        // Where the road bends, the heading tells of the place along it.
        let curvature_per_m = map.curvature_per_m(place.along_m);
        for (state, value, std, by_along) in [
            (ACROSS, place.lateral_m, start.position_std_m, 0.0),
            (HEADING, heading_rad, start.heading_std_rad, curvature_per_m),
        ] {
            let mut row = [0.0; STATES];
            row[state] = 1.0;
            row[ALONG] = by_along;
            let expected = belief.mean[state] + by_along * (belief.mean[ALONG] - place.along_m);
            belief.update(value - expected, &row, std * std);
        }
        belief
    }

    /// Speed along the heading (m/s).
    pub fn speed_mps(&self) -> f64 {
        let reading = self.odometry.map_or(0.0, |sample| sample.speed_mps);
        reading / (1.0 + self.belief.mean[SCALE])
    }

    /// Distance driven since the newest odometry, and its variance.
    fn coasting(&self, time_s: f64) -> (f64, f64) {
        let Some(sample) = self.odometry else {
            return (0.0, 0.0);
        };
        let lag_s = (time_s - sample.time_s).max(0.0);
        (
            self.speed_mps() * lag_s,
            self.config.coasting_variance(lag_s),
        )
    }

    fn advance(&mut self, reading_m: f64, yaw: Option<Yaw>) {
        let steps = (reading_m.abs() / STEP_M).ceil().max(1.0);
        let share = 1.0 / steps;
        let yaw = yaw.map(|yaw| Yaw {
            turn_rad: yaw.turn_rad * share,
            duration_s: yaw.duration_s * share,
            variance: yaw.variance * share,
        });
        for _ in 0..steps as usize {
            let mut step = self.step(&self.belief, reading_m * share);
            if let Some(yaw) = yaw {
                let (residual, row, variance) = step.turn_seen(&self.belief.mean, &yaw);
                self.measure(residual, &row, variance);
                step = self
                    .step(&self.belief, reading_m * share)
                    .informed(&self.belief.mean, &yaw);
            }
            if let Some(journal) = &mut self.journal {
                journal.moved(&step.jacobian);
            }
            step.apply(&mut self.belief);
        }
        self.driven_m += reading_m.abs() / (1.0 + self.belief.mean[SCALE]);
        self.watch_the_ends();
    }

    /// How far beyond the nearer end of the map the vehicle is believed to be (m); 0 on it.
    fn off_map_m(&self) -> f64 {
        let along_m = self.belief.mean[ALONG];
        (self.map.as_ref()).map_or(0.0, |map| (along_m - map.length_m()).max(-along_m).max(0.0))
    }

    /// Beyond its ends the map goes on straight, but nothing says that the road does. Where the
    /// vehicle is certainly there, the path bends as it does without a map; along and across stay
    /// what they are. Back on the map it keeps to its lane again.
    fn watch_the_ends(&mut self) {
        let beyond = self.off_map_m() > 3.0 * self.belief.covariance[ALONG][ALONG].sqrt();
        if beyond == self.beyond_map {
            return;
        }
        self.beyond_map = beyond;
        if beyond {
            let curvature_per_m = self.config.path_bend.curvature_per_m;
            self.belief.covariance[CURVATURE][CURVATURE] = curvature_per_m * curvature_per_m;
            return;
        }
        let mut forget = identity();
        forget[CURVATURE][CURVATURE] = 0.0;
        if let Some(journal) = &mut self.journal {
            journal.moved(&forget);
        }
        self.belief.mean[CURVATURE] = 0.0;
        self.belief.spread(&forget, &[[0.0; STATES]; STATES]);
        let variances = self.config.lane_keeping.stationary();
        for (state, variance) in [ACROSS, HEADING].into_iter().zip(variances) {
            let mut row = [0.0; STATES];
            row[state] = 1.0;
            self.measure(-self.belief.mean[state], &row, variance);
        }
    }

    fn measure(&mut self, residual: f64, row: &[f64; STATES], variance: f64) {
        if let Some(journal) = &mut self.journal {
            journal.measured(&self.belief, residual, row, variance);
        }
        self.belief.update(residual, row, variance);
    }

    fn ask(&mut self, time_s: f64) {
        if let Some(journal) = &mut self.journal {
            journal.asked(time_s, &self.belief);
        }
    }

    fn step(&self, belief: &Belief, reading_m: f64) -> Step {
        let (mean, config) = (&belief.mean, &self.config);
        match &self.map {
            Some(map) if !self.beyond_map => {
                let middle_m = mean[ALONG] + 0.5 * reading_m;
                let curvature_per_m = map.curvature_per_m(middle_m);
                Step::along_lane(
                    mean,
                    reading_m,
                    curvature_per_m,
                    &config.lane_keeping,
                    &config.noise,
                )
            }
            _ => Step::in_plane(mean, reading_m, &config.path_bend, &config.noise),
        }
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
}

/// An angle as the belief meets it.
struct Look {
    head: usize,
    excluded: bool,
    place_m: f64,
    row: [f64; STATES],
    innovation: Innovation,
}

/// The pose `ahead_m` further on than the state says, and the road under it.
fn locate(mean: &[f64; STATES], ahead_m: f64, map: Option<&Track>) -> (Pose, Footing) {
    let Some(map) = map else {
        let pose = Pose {
            x_m: mean[ALONG],
            y_m: mean[ACROSS],
            heading_rad: mean[HEADING],
        };
        return (pose.along_arc(ahead_m, mean[CURVATURE]), Footing::PLANE);
    };
    let along_m = mean[ALONG] + ahead_m;
    let road = map.pose(along_m);
    let curvature_per_m = map.curvature_per_m(along_m);
    let footing = Footing {
        direction_rad: road.heading_rad,
        stretch: 1.0 - curvature_per_m * mean[ACROSS],
        curvature_per_m,
    };
    let across_m = mean[ACROSS] + ahead_m * mean[HEADING];
    let heading_rad = road.heading_rad + mean[HEADING];
    let pose = Pose {
        heading_rad,
        ..road.offset_left(across_m)
    };
    (pose, footing)
}
