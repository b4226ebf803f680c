//! Comparison of the odometry's motion with the angles.
//!
//! Each radio head has a reference: the residual of one of its angles, and the pose at its time. A
//! later angle is predicted from the reference with the path of the odometry. If the odometry is
//! correct, the residual changes by noise only, because the errors of pose, survey and array are
//! common to both angles.
//!
//! * A stop or reversal beyond the friction of tyres is a fault immediately.
//! * Standstill: the squared change of the residual has a χ² distribution. The sum over all radio
//!   heads except the largest is tested, so that one obstructed radio head causes no alarm.
//! * Motion: the likelihood of the odometry is compared with that of a standing vehicle, of reversed
//!   motion and of a reversed yaw rate, by a cumulative sum for each radio head (Page 1954). The sum
//!   over all radio heads except the largest is tested. The scatter of each radio head is measured.
//! * A fault ends after a log-likelihood ratio in favour of the odometry without a contradiction.

use crate::expected_angle::ExpectedAngle;
use crate::geometry::{Pose, wrap_angle};
use crate::localize::AngleUpdate;
use crate::observation::{MeasurementKind, OdometrySample};
use crate::radio_head::RadioHead;

use super::fault::Fault;

/// Interval of the bursts that are received at standstill, in seconds, so that two of them are
/// received within the required detection time.
const STANDSTILL_INTERVAL_S: f64 = 0.5;
/// Maximum speed of a standing vehicle, in m/s.
const STANDING_MPS: f64 = 0.01;
/// Minimum speed for the confirmation of a standstill, in m/s.
const MIN_MOVING_MPS: f64 = 0.5;
/// Maximum motion between two angles at standstill, in metres.
const STANDING_M: f64 = 0.02;
/// Maximum heading change between two angles at standstill, in radians.
const STANDING_RAD: f64 = 0.1;
/// Standard deviation of an angle at standstill in addition to its noise, in radians, due to
/// scatterers that move.
const STANDING_SIGMA_RAD: f64 = 0.02;
/// Minimum standard deviation of an angle in motion in addition to its noise, in radians, due to
/// changing multipath.
const MOVING_SIGMA_RAD: f64 = 0.06;
/// Weight of the newest comparison in the measured scatter of a radio head. A fault is reported after
/// a few comparisons, and increases the scatter little until then.
const SCATTER_WEIGHT: f64 = 1.0 / 64.0;
/// Number of angles as which the minimum scatter counts in the measured one: the first comparison at
/// most doubles it ([`OUTLIER`]).
const FIRST_COUNT: f64 = 7.0;
/// Maximum acceleration due to the friction of tyres, in m/s².
const FRICTION_MPS2: f64 = 10.0;
/// Minimum change of the speed that is compared with the maximum acceleration, in m/s. A smaller
/// change may be noise, or a step of the commanded wheel speed of a small robot.
const SUDDEN_MPS: f64 = 1.0;
/// Normal quantile of the false-alarm rate of one test at standstill, 1e-6.
const QUANTILE: f64 = 4.753;
/// Number of consecutive tests at standstill that must exceed the threshold.
const CONFIRMATIONS: u32 = 2;
/// Threshold of one cumulative log-likelihood ratio: false-alarm rate 1e-6 for each excursion from zero (Wald).
const EVIDENCE: f64 = 13.8;
/// Maximum of one radio head's sum. If there are two radio heads, one of them alone can reach the
/// threshold.
const MAX_EVIDENCE: f64 = 14.5;
/// Drift of the sum at each angle, so that hypotheses with the same fit as the odometry gain no
/// evidence.
const DRIFT: f64 = 0.25;
/// Squared normalised residual above which an angle is an outlier under a hypothesis.
const OUTLIER: f64 = 9.0;
/// Minimum squared normalised difference between the hypotheses for a comparison.
const DISTINCT: f64 = 8.0;
/// Maximum age of a reference in motion, in seconds. The direction of a distant radio head changes
/// slowly.
const MOVING_AGE_S: f64 = 5.0;
/// Maximum age of a reference at standstill, in seconds.
const STANDING_AGE_S: f64 = 30.0;
/// Time in seconds after which the only radio head gets a new reference if its angle has jumped.
const JUMPED_S: f64 = 1.0;
/// Number of jumps of the only radio head within [`STANDING_AGE_S`] that indicate motion.
const SINGLE_JUMPS: u32 = 3;
/// Duration without a contradicting angle after which a fault can end, in seconds.
const CONFIRMED_S: f64 = 1.5;
/// Variance of the normalised residual under an unknown motion: its angles typically deviate from the
/// odometry by five standard deviations.
const UNKNOWN_MOTION_VARIANCE: f64 = 25.0;
/// Maximum log-likelihood ratio of one angle in favour of the odometry, so that a fault ends after
/// at least four angles ([`EVIDENCE`]).
const MAX_CONFIRMATION: f64 = 0.5 * OUTLIER;

/// Faults that the odometry is compared with in motion.
const FAULTS: [Fault; 3] = [
    Fault::OdometryFrozen,
    Fault::OdometryReversed,
    Fault::YawRateReversed,
];

/// Reference angle of one radio head.
#[derive(Debug, Clone, Copy)]
struct Reference {
    head: RadioHead,
    time_s: f64,
    pose: Pose,
    /// Pose on the path of the odometry.
    path: Pose,
    residual_rad: f64,
    variance: f64,
    /// Variance of an angle in motion in addition to its noise (rad²).
    scatter: f64,
    /// Number of angles from which the scatter was measured.
    compared: u32,
    /// Evidence of each of [`FAULTS`].
    evidence: [f64; FAULTS.len()],
    /// Time of the first jump of the angle at standstill, in seconds.
    jumped_s: Option<f64>,
    /// Number of jumps of the angle at standstill.
    jumps: u32,
    /// Whether the next angle replaces the reference.
    is_stale: bool,
}

impl Reference {
    /// Updates the scatter with the squared change of the residual of two angles under the best
    /// hypothesis, which a fault does not increase, minus their own variances (rad²).
    fn learn(&mut self, excess: f64) {
        self.compared = self.compared.saturating_add(1);
        let weight = SCATTER_WEIGHT.max(1.0 / (FIRST_COUNT + f64::from(self.compared)));
        let learned = self.scatter + weight * (0.5 * excess - self.scatter);
        self.scatter = learned.max(MOVING_SIGMA_RAD.powi(2));
    }
}

/// Angle of a burst with the quantities that are compared.
#[derive(Debug, Clone, Copy)]
struct BurstAngle {
    kind: MeasurementKind,
    head: RadioHead,
    time_s: f64,
    value_rad: f64,
    variance: f64,
    /// Pose of the localizer at the time of the angle.
    pose: Pose,
    /// Pose on the path of the odometry.
    path: Pose,
}

/// Statistics over the radio heads of a burst.
#[derive(Debug, Default)]
struct Burst {
    standing: u32,
    sum: f64,
    largest: f64,
    /// Log-likelihood ratio in favour of the odometry.
    good: f64,
    bad: u32,
    /// Number of jumps of the radio head that was compared last.
    jumps: u32,
}

/// Monitor that compares the odometry's motion with the angles.
#[derive(Debug)]
pub struct MotionMonitor {
    expected_angle: ExpectedAngle,
    references: Vec<Reference>,
    last: Option<OdometrySample>,
    /// Pose on the path of the odometry, from any start.
    path: Pose,
    /// Distance at this pose (m).
    distance_m: f64,
    /// Heading of the localizer at the last burst (rad), without a yaw rate.
    heading_rad: Option<f64>,
    /// Last speed other than zero, without sign, in m/s.
    moving_mps: f64,
    standing_since_s: Option<f64>,
    received_s: f64,
    suspicions: u32,
    /// Time of the last angle that contradicts the odometry, in seconds, and log-likelihood ratio in
    /// favour of the odometry since then.
    confirmed: (f64, f64),
}

impl MotionMonitor {
    /// Creates a monitor for this number of radio heads.
    pub fn new(expected_angle: ExpectedAngle, heads: usize) -> Self {
        Self {
            expected_angle,
            references: Vec::with_capacity(heads),
            last: None,
            path: Pose::default(),
            distance_m: 0.0,
            heading_rad: None,
            moving_mps: MIN_MOVING_MPS,
            standing_since_s: None,
            received_s: f64::NEG_INFINITY,
            suspicions: 0,
            confirmed: (f64::NEG_INFINITY, 0.0),
        }
    }

    /// Replaces all references at their next angles, because the pose has changed without motion.
    pub fn restart(&mut self) {
        for reference in &mut self.references {
            (reference.is_stale, reference.evidence) = (true, Default::default());
            (reference.jumped_s, reference.jumps) = (None, 0);
        }
        self.suspicions = 0;
        self.confirmed = (self.last.map_or(f64::NEG_INFINITY, |it| it.time_s), 0.0);
    }

    /// Removes the odometry as well, because its time or distance restarts.
    pub fn forget(&mut self) {
        self.last = None;
        self.standing_since_s = None;
        self.received_s = f64::NEG_INFINITY;
        self.restart();
    }

    /// Processes an odometry sample. Returns a fault if the speed stops or reverses faster than the
    /// friction of tyres permits.
    pub fn odometry(&mut self, sample: &OdometrySample) -> Option<Fault> {
        let last = self.last.replace(*sample).unwrap_or(*sample);
        let duration_s = sample.time_s - last.time_s;
        if let Some(yaw_rate_radps) = sample.yaw_rate_radps {
            self.advance(sample.distance_m, yaw_rate_radps * duration_s);
        }
        if sample.speed_mps.abs() > STANDING_MPS {
            self.moving_mps = sample.speed_mps.abs().max(MIN_MOVING_MPS);
        }
        let change_mps = (sample.speed_mps - last.speed_mps).abs();
        let is_sudden = change_mps >= SUDDEN_MPS && change_mps > FRICTION_MPS2 * duration_s;
        let fault = if !is_sudden || last.speed_mps.abs() < SUDDEN_MPS {
            None
        } else if sample.speed_mps.abs() <= STANDING_MPS {
            Some(Fault::OdometryFrozen)
        } else if sample.speed_mps * last.speed_mps < 0.0 {
            Some(Fault::OdometryReversed)
        } else {
            None
        };
        let stands = sample.speed_mps.abs() <= STANDING_MPS
            && (sample.distance_m - last.distance_m).abs() <= STANDING_MPS * duration_s.max(0.02);
        self.standing_since_s = match self.standing_since_s {
            _ if !stands => None,
            None => Some(sample.time_s),
            since => since,
        };
        fault
    }

    /// Whether the burst at `time_s` must be received: periodically at standstill, and while a
    /// fault is suspected.
    pub fn requests_burst(&self, time_s: f64) -> bool {
        let due = |since_s: f64| {
            self.received_s < since_s || time_s - self.received_s >= STANDSTILL_INTERVAL_S - 1e-5
        };
        self.suspicions > 0 || self.standing_since_s.is_some_and(due)
    }

    /// Records that the burst at `time_s` is received.
    pub const fn received(&mut self, time_s: f64) {
        self.received_s = time_s;
    }

    /// Compares the angles of a burst with the odometry. `pose` is the pose at the newer of
    /// odometry and burst; `None` if it is unknown. Returns the detected fault.
    pub fn angles(&mut self, updates: &[AngleUpdate], pose: Option<Pose>) -> Option<Fault> {
        let last = self.last?;
        if last.yaw_rate_radps.is_none() {
            let heading_rad = pose.map(|it| it.heading_rad);
            let before_rad = std::mem::replace(&mut self.heading_rad, heading_rad);
            let turned_rad = heading_rad
                .zip(before_rad)
                .map(|(now, before)| now - before);
            self.advance(last.distance_m, wrap_angle(turned_rad.unwrap_or(0.0)));
        }
        let mut burst = Burst::default();
        for update in updates.iter().filter(|it| it.measured.resolved) {
            let measured = &update.measured;
            if !(measured.phase_rad.is_finite() && measured.phase_sigma_rad.is_finite()) {
                continue;
            }
            // Pose at the time of the angle.
            let ahead_m = (last.time_s - measured.time_s).max(0.0) * last.speed_mps;
            if measured.kind.is_at_head() && update.head.array.is_none() {
                continue;
            }
            let seen = BurstAngle {
                kind: measured.kind,
                head: update.head,
                time_s: measured.time_s,
                value_rad: measured.phase_rad,
                variance: measured.phase_sigma_rad.powi(2),
                pose: pose.unwrap_or_default().along_chord(-ahead_m, 0.0),
                path: self.path.along_chord(-ahead_m, 0.0),
            };
            self.compare(&seen, pose.is_some(), &mut burst);
        }
        self.update_confirmation(&burst, last.time_s);
        if burst.bad == 1 {
            self.forget_jump(last.time_s);
        }
        if burst.standing > 0 && Self::is_moving(&burst) {
            self.suspicions += 1;
        } else if burst.standing > 0 {
            self.suspicions = 0;
        }
        if self.suspicions >= CONFIRMATIONS {
            return Some(Fault::OdometryFrozen);
        }
        let exceeds = |which: usize| {
            let evidence = self
                .references
                .iter()
                .filter_map(|it| it.evidence.get(which));
            let (sum, largest, heads) = (evidence.filter(|it| **it > 0.0))
                .fold((0.0, 0.0_f64, 0.0), |(sum, largest, heads), it| {
                    (sum + it, largest.max(*it), heads + 1.0)
                });
            sum - largest > evidence_threshold(heads - 1.0)
        };
        (0..)
            .zip(FAULTS)
            .find_map(|(which, fault)| exceeds(which).then_some(fault))
    }

    /// Extends the path of the odometry to a distance (m), with a change of the heading.
    fn advance(&mut self, distance_m: f64, turned_rad: f64) {
        let moved_m = distance_m - std::mem::replace(&mut self.distance_m, distance_m);
        self.path = self.path.along_chord(moved_m, turned_rad);
    }

    /// Whether the odometry has agreed with the angles long enough to end its fault.
    pub fn is_confirmed(&self, time_s: f64) -> bool {
        let (since_s, evidence) = self.confirmed;
        time_s - since_s >= CONFIRMED_S && evidence >= EVIDENCE
    }

    /// Compares an angle with the reference of its radio head, which is replaced after use.
    fn compare(&mut self, seen: &BurstAngle, has_pose: bool, burst: &mut Burst) {
        let sends = |it: &Reference| it.head.sends(seen.head.pci, seen.head.ssb_index);
        let Some(place) = self.references.iter().position(sends) else {
            if self.references.len() < self.references.capacity() {
                let reference = self.reference(seen);
                self.references.push(reference);
            }
            return;
        };
        let Some(reference) = self.references.get(place).copied() else {
            return;
        };
        let has_yaw_rate = self.last.is_some_and(|it| it.yaw_rate_radps.is_some());
        let motion = seen.path.seen_from(reference.path);
        let age_s = seen.time_s - reference.time_s;
        let stands = motion.x_m.hypot(motion.y_m) <= STANDING_M
            && wrap_angle(motion.heading_rad).abs() <= STANDING_RAD;
        let change_rad = |motion: Pose| {
            let pose = reference.pose.after(motion);
            let residual_rad =
                (self.expected_angle).residual_rad(seen.kind, pose, &seen.head, seen.value_rad);
            wrap_angle(residual_rad - reference.residual_rad)
        };
        let mut next = reference;
        let mut has_served = false;
        // The fading of the last centimetres before a stop differs from that at standstill.
        let is_of_motion = |since_s: f64| reference.time_s < since_s;
        if reference.is_stale || (stands && self.standing_since_s.is_some_and(is_of_motion)) {
            has_served = true;
        } else if stands && self.standing_since_s.is_some() {
            let variance = seen.variance + reference.variance + 2.0 * STANDING_SIGMA_RAD.powi(2);
            let change = change_rad(motion);
            let squared = change.powi(2) / variance;
            // An angle confirms the standstill if a continued motion would have changed it.
            let driven_rad = change_rad(Pose {
                x_m: self.moving_mps * age_s,
                ..Pose::default()
            });
            let driven = wrap_angle(driven_rad).powi(2) / variance;
            burst.standing += 1;
            burst.sum += squared;
            burst.largest = burst.largest.max(squared);
            if squared < OUTLIER {
                burst.good += confirmation(squared, driven);
                next.jumped_s = None;
            } else {
                burst.bad += 1;
                next.jumped_s.get_or_insert(seen.time_s);
            }
            burst.jumps = next.jumps;
            next.evidence = Default::default();
            if age_s > STANDING_AGE_S {
                (has_served, next.jumps) = (true, 0);
            }
        } else if has_pose {
            let own = seen.variance + reference.variance;
            let variance = own + 2.0 * reference.scatter;
            let expected_rad = change_rad(motion);
            let mut others_rad = alternatives(motion).map(change_rad);
            if !has_yaw_rate {
                others_rad[2] = expected_rad;
            }
            let apart = others_rad.map(|it| wrap_angle(it - expected_rad).powi(2) / variance);
            let is_distinct = apart.iter().any(|it| *it >= DISTINCT);
            let squared = expected_rad.powi(2) / variance;
            has_served = is_distinct || age_s > MOVING_AGE_S;
            if has_served {
                let others = others_rad.map(|it| it.powi(2) / variance);
                let least = others.into_iter().fold(squared, f64::min);
                next.learn(least.min(OUTLIER) * variance - own);
                for (evidence, other) in next.evidence.iter_mut().zip(others) {
                    let ratio = 0.5 * (squared.min(OUTLIER) - other.min(OUTLIER));
                    *evidence = (*evidence + ratio - DRIFT).clamp(0.0, MAX_EVIDENCE);
                }
                if squared >= OUTLIER {
                    burst.bad += 1;
                } else {
                    let known = confirmation(squared, others.into_iter().fold(0.0, f64::max));
                    let unknown = unknown_motion(squared);
                    // Without a yaw rate, the heading change is that of the localizer.
                    burst.good += if has_yaw_rate && unknown < 0.0 {
                        known.min(unknown)
                    } else {
                        known
                    };
                }
            }
        } else {
            has_served = true;
        }
        if has_served {
            next = Reference {
                scatter: next.scatter,
                compared: next.compared,
                evidence: next.evidence,
                jumps: if stands { next.jumps } else { 0 },
                ..self.reference(seen)
            };
        }
        if let Some(slot) = self.references.get_mut(place) {
            *slot = next;
        }
    }

    fn reference(&self, seen: &BurstAngle) -> Reference {
        Reference {
            head: seen.head,
            time_s: seen.time_s,
            pose: seen.pose,
            path: seen.path,
            residual_rad: self.expected_angle.residual_rad(
                seen.kind,
                seen.pose,
                &seen.head,
                seen.value_rad,
            ),
            variance: seen.variance,
            scatter: MOVING_SIGMA_RAD.powi(2),
            compared: 0,
            evidence: Default::default(),
            jumped_s: None,
            jumps: 0,
            is_stale: false,
        }
    }

    /// Marks the reference of the only radio head for replacement if its angle at standstill has
    /// jumped for [`JUMPED_S`]: the radio head may be obstructed.
    fn forget_jump(&mut self, now_s: f64) {
        let has_jumped =
            |it: &&mut Reference| it.jumped_s.is_some_and(|at_s| now_s - at_s > JUMPED_S);
        if let Some(reference) = self.references.iter_mut().find(has_jumped) {
            reference.jumps += 1;
            reference.is_stale = true;
        }
    }

    /// Whether the angles of a burst show motion although the odometry reports standstill.
    fn is_moving(burst: &Burst) -> bool {
        if burst.standing > 1 {
            return burst.sum - burst.largest > chi_squared(f64::from(burst.standing - 1));
        }
        // The only radio head may be obstructed. In motion, its angle jumps repeatedly.
        burst.sum > chi_squared(1.0) && burst.jumps >= SINGLE_JUMPS
    }

    /// Records whether the angles of a burst contradict or confirm the odometry.
    fn update_confirmation(&mut self, burst: &Burst, now_s: f64) {
        // If the odometry reports standstill, a motion of the vehicle first changes the angles of
        // near radio heads.
        let is_wrong =
            burst.bad > 1 || (burst.bad == 1 && (burst.good <= 0.0 || burst.standing > 0));
        if is_wrong {
            self.confirmed = (now_s, 0.0);
        } else {
            self.confirmed.1 = (self.confirmed.1 + burst.good).max(0.0);
        }
    }
}

/// Returns the motion of the vehicle under each of [`FAULTS`], for the motion of the odometry.
fn alternatives(motion: Pose) -> [Pose; FAULTS.len()] {
    let (backward_m, right_m) = (-motion.x_m, -motion.y_m);
    [
        Pose::default(),
        Pose {
            x_m: backward_m,
            y_m: right_m,
            ..motion
        },
        Pose {
            y_m: right_m,
            heading_rad: -motion.heading_rad,
            ..motion
        },
    ]
}

/// Returns the log-likelihood ratio in favour of the odometry, with a drift, for the squared
/// normalised residuals of the odometry and of an alternative.
fn confirmation(squared: f64, other: f64) -> f64 {
    let ratio = 0.5 * (other - squared);
    ratio.clamp(-MAX_CONFIRMATION, MAX_CONFIRMATION) - DRIFT
}

/// Returns the log-likelihood ratio in favour of the odometry against an unknown motion, for the
/// squared normalised residual of the odometry.
fn unknown_motion(squared: f64) -> f64 {
    0.5 * (UNKNOWN_MOTION_VARIANCE.ln() - squared * (1.0 - 1.0 / UNKNOWN_MOTION_VARIANCE))
}

/// Returns the threshold for the sum of `sums` cumulative sums. The height of an excursion from
/// zero has at most an exponential distribution (Wald), so that twice the sum of n heights has a χ²
/// distribution with 2n degrees of freedom.
fn evidence_threshold(sums: f64) -> f64 {
    if sums > 1.0 {
        0.5 * chi_squared(2.0 * sums)
    } else {
        EVIDENCE
    }
}

/// Returns the quantile of the χ² distribution at the false-alarm rate of one test (Wilson and
/// Hilferty 1931).
fn chi_squared(freedom: f64) -> f64 {
    let share = 2.0 / (9.0 * freedom);
    freedom * (1.0 - share + QUANTILE * share.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::localize::{AngleMeasurement, UpdateReason, UpdateResult};
    use crate::settings::{Shipped, Site, TomlFile, Vehicle};

    #[test]
    fn thresholds_of_sums_are_quantiles_of_the_gamma_distribution() {
        // Quantiles at the probability 1e-6 of exceedance (scipy.stats.gamma.isf).
        for (sums, quantile) in [
            (1.0, 13.82),
            (2.0, 16.69),
            (3.0, 19.13),
            (7.0, 27.32),
            (15.0, 41.02),
        ] {
            let threshold = evidence_threshold(sums);
            assert!(
                (threshold / quantile - 1.0).abs() < 0.06,
                "{sums}: {threshold}"
            );
        }
    }

    /// Feeds the monitor with a drive at a site at `speed_mps` along `motion`, which returns the true and the
    /// reported yaw rate (rad/s) at a time (s), and with noise of the angles (rad) as a function of
    /// the number of the burst and of the radio head. Returns time (s) and fault of the first report.
    fn first_report_of(
        (site, speed_mps, duration_s): (&str, f64, f64),
        motion: impl Fn(f64) -> [f64; 2],
        noise_rad: impl Fn(u32, u32) -> f64,
    ) -> Option<(f64, Fault)> {
        let site = Site::from_library(site, &Shipped).unwrap();
        let vehicle = Vehicle::from_library("tugger", &Shipped).unwrap();
        let heads = RadioHead::received_by(&site, &vehicle);
        let expected_angle = ExpectedAngle::new(&vehicle);
        let mut monitor = MotionMonitor::new(expected_angle.clone(), heads.len());
        let mut pose = Pose::default();
        for step in 0..(50.0 * duration_s) as u32 {
            let time_s = 0.02 * f64::from(step);
            let [yaw_rate_radps, reported_radps] = motion(time_s);
            let sample = OdometrySample {
                time_s,
                distance_m: speed_mps * time_s,
                speed_mps,
                yaw_rate_radps: Some(reported_radps),
            };
            monitor.odometry(&sample);
            let updates: Vec<AngleUpdate> = (heads.iter().enumerate())
                .map(|(number, &head)| {
                    let residual_rad =
                        expected_angle.residual_rad(MeasurementKind::Angle, pose, &head, 0.0);
                    AngleUpdate {
                        number,
                        head,
                        measured: AngleMeasurement {
                            kind: MeasurementKind::Angle,
                            time_s,
                            phase_rad: noise_rad(step, number as u32) - residual_rad,
                            phase_sigma_rad: 0.02,
                            angle_rad: f64::NAN,
                            snr_db: 20.0,
                            resolved: true,
                        },
                        verdict: UpdateResult::unused(UpdateReason::Unusable),
                    }
                })
                .collect();
            if let Some(fault) = monitor.angles(&updates, Some(pose)) {
                return Some((time_s, fault));
            }
            pose = pose.along_chord(0.02 * speed_mps, 0.02 * yaw_rate_radps);
        }
        None
    }

    /// Drives through a bend with a radius of 8 m. Returns the first report for the reported yaw rate
    /// (rad/s) as a function of the time and of the true one.
    fn first_report(reported: impl Fn(f64, f64) -> f64) -> Option<(f64, Fault)> {
        let motion = |time_s: f64| {
            let rate = if time_s > 2.0 { 0.25 } else { 0.0 };
            [rate, reported(time_s, rate)]
        };
        // Deterministic noise of 0.02 rad.
        let noise_rad = |step: u32, head: u32| 0.03 * f64::from(7 * step + 3 * head).sin();
        first_report_of(("yard", 2.0, 10.0), motion, noise_rad)
    }

    #[test]
    fn strong_scatter_is_no_fault() {
        // As with a Rician factor of 5 dB: independent over some metres.
        const SIGMA_RAD: f64 = 0.3;
        let heads = 8;
        for seed in 0..10 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let scatter: Vec<f64> = (0..heads * 200)
                .map(|_| SIGMA_RAD * rng.sample::<f64, _>(StandardNormal))
                .collect();
            let noise_rad = |step: u32, head: u32| scatter[(heads * (step / 25) + head) as usize];
            let found = first_report_of(("campus", 5.5, 100.0), |_| [0.0; 2], noise_rad);
            assert_eq!(found, None, "{seed}");
        }
    }

    #[test]
    fn an_unknown_motion_is_more_likely_than_the_odometry_above_1_8_standard_deviations() {
        assert!(unknown_motion(1.8_f64.powi(2)) > 0.0);
        assert!(unknown_motion(1.9_f64.powi(2)) < 0.0);
        // Ratio of two normal densities with the variances 1 and 25.
        let density = |variance: f64| (-0.5 * 4.0 / variance).exp() / variance.sqrt();
        let expected = (density(1.0) / density(25.0)).ln();
        assert!((unknown_motion(4.0) - expected).abs() < 1e-12);
    }

    #[test]
    fn a_reversed_yaw_rate_is_reported_within_a_second_of_the_bend() {
        let (time_s, fault) = first_report(|_, rate| -rate).unwrap();
        assert_eq!(fault, Fault::YawRateReversed);
        assert!(time_s > 2.0 && time_s < 3.0, "{time_s}");
        // Reversed within the bend.
        let within = |time_s: f64, rate: f64| if time_s > 5.0 { -rate } else { rate };
        let (time_s, fault) = first_report(within).unwrap();
        assert_eq!(fault, Fault::YawRateReversed);
        assert!(time_s > 5.0 && time_s < 6.0, "{time_s}");
    }

    #[test]
    fn a_yaw_rate_with_a_scale_error_or_a_bias_is_not_reversed() {
        for reported in [
            |_: f64, rate: f64| rate,
            |_, rate| 0.8 * rate,
            |_, rate| rate + 0.02,
        ] {
            assert_eq!(first_report(reported), None);
        }
    }
}
