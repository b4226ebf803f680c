//! Integrity monitoring of a bank of filters: protection level and state, recovery from
//! unidentified faults, and the handover between solutions.
//!
//! Under each hypothesis of the [`Bank`], one of its filters is correct within its own covariance,
//! whatever the reported solution is. The protection level is the radius around the reported
//! position that holds for all hypotheses together ([`LevelEquation`]), with the measured noise of
//! the angles. With a single radio head and without estimated biases it is determined by odometry and road, grows with
//! the distance driven, and exceeds the alert limit unless they are precise. `docs/integrity.md`
//! defines the states.

use std::cell::RefCell;

use super::protection_level::{Hypothesis, LevelEquation};
use crate::clone_in_place::clone_in_place;
use crate::gaussian::CERTAIN_SIGMAS;
use crate::geometry::Pose;
use crate::localize::ekf::Ekf;
use crate::localize::modes::{Bank, RECOVERY_S};
use crate::localize::output::{Integrity, IntegrityState, PoseEstimate};
use crate::localize::output::{OdometryResult, SelectedHypothesis, UpdateResult};
use crate::observation::AngleMeasurement;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;
use crate::settings::IntegritySettings;

/// Fraction of the risk below which a hypothesis is neglected.
const NEGLIGIBLE: f64 = 0.1;

/// Previous solution relative to the reported one. When a radio head is excluded, another mode is
/// selected or a restarted bank takes over, the position may change at a single angle. While this
/// change may be reverted, the covariance covers both solutions, which move in parallel.
#[derive(Clone, Copy, Debug)]
struct Handover {
    since_s: f64,
    apart: [f64; 3],
    covariance: [[f64; 3]; 3],
}

impl Handover {
    /// Creates the handover from `before` to `now`; `None` if both agree.
    pub fn new(before: &PoseEstimate, now: &PoseEstimate) -> Option<Self> {
        let covariance = before.covariance?;
        let [[xx, xy, _], [_, yy, _], _] = covariance;
        let [[own_xx, own_xy, _], [_, own_yy, _], _] = now.covariance?;
        let (xx, xy, yy) = (xx + own_xx, xy + own_xy, yy + own_yy);
        let apart = now.pose.offset_of(before.pose);
        let [x_m, y_m, _] = apart;
        let apart2 = yy * x_m * x_m - 2.0 * xy * x_m * y_m + xx * y_m * y_m;
        (apart2 > CERTAIN_SIGMAS.powi(2) * (xx * yy - xy * xy)).then_some(Self {
            since_s: now.time_s,
            apart,
            covariance,
        })
    }

    /// Returns the current pose of the previous solution; `None` after [`RECOVERY_S`].
    pub fn previous_pose(&self, estimate: &PoseEstimate) -> Option<PoseEstimate> {
        let [x_m, y_m, heading_rad] = self.apart;
        (estimate.time_s - self.since_s <= RECOVERY_S).then_some(PoseEstimate {
            pose: Pose {
                x_m: estimate.pose.x_m + x_m,
                y_m: estimate.pose.y_m + y_m,
                heading_rad: estimate.pose.heading_rad + heading_rad,
            },
            covariance: Some(self.covariance),
            ..*estimate
        })
    }
}

clone_in_place! {
    /// Bank of filters and its monitoring. Without monitoring, the bank has one filter.
    #[derive(Debug)]
    pub struct IntegrityMonitor {
        settings: IntegritySettings,
        level: LevelEquation,
        /// Hypotheses of the newest level; the memory is reused.
        hypotheses: RefCell<Vec<Hypothesis>>,
        bank: Bank,
        restarted: Option<Restarted>,
        /// Previous solution.
        handover: Option<Handover>,
        /// Whether the solution was found by a search, and no restarted bank has confirmed it yet.
        is_found: bool,
        /// Distance driven (m) at the last time without an unidentified fault.
        trusted_m: f64,
        /// Time of the last restart of the filters (s).
        begun_s: f64,
        /// Whether the odometer scale certainly contradicted its specification, and has not been
        /// estimated since.
        has_departed: bool,
        now_s: f64,
    }
}

clone_in_place! {
    /// Bank that restarted from an uncertain pose.
    #[derive(Debug)]
    struct Restarted {
        bank: Bank,
        since_s: f64,
    }
}

impl IntegrityMonitor {
    /// Creates the monitor of a filter of these radio heads. If monitoring is enabled, a filter from
    /// a search, in contrast to a given one, must be confirmed.
    pub fn new(
        ekf: &Ekf,
        heads: &[RadioHead],
        settings: IntegritySettings,
        found_s: Option<f64>,
    ) -> Self {
        let is_found = settings.enabled && found_s.is_some();
        let found_s = found_s.unwrap_or(f64::NEG_INFINITY);
        Self {
            level: LevelEquation::new(settings.risk_per_epoch()),
            hypotheses: RefCell::default(),
            trusted_m: ekf.driven_m(),
            bank: if settings.enabled {
                Bank::new(ekf, heads, &settings, found_s)
            } else {
                Bank::of_one(ekf, &settings)
            },
            restarted: None,
            handover: None,
            is_found,
            begun_s: found_s,
            has_departed: false,
            now_s: found_s,
            settings,
        }
    }

    /// Returns the selected filter.
    pub fn ekf(&self) -> &Ekf {
        self.bank.leader()
    }

    /// Returns the filter that determines the wake-ups: if the level exceeds the alert limit, that
    /// of the hypothesis with the largest contribution; otherwise the selected one.
    pub fn worst_case(&self) -> &Ekf {
        let (bank, now_s) = (&self.bank, self.ekf().time_s());
        if !self.settings.enabled || self.is_near(bank, now_s) {
            return bank.leader();
        }
        let beyond = |(clean, hypothesis)| {
            let alert_limit_m = self.settings.alert_limit_m;
            (self.level.share_beyond(alert_limit_m, &hypothesis), clean)
        };
        (self.hypotheses_of(bank, now_s).map(beyond))
            .max_by(|(one, _), (other, _)| one.total_cmp(other))
            .map_or(bank.leader(), |(_, clean)| clean)
    }

    /// Returns the time at which a restarted bank last took over (s).
    pub const fn begun_s(&self) -> f64 {
        self.begun_s
    }

    /// Returns the reported bank.
    pub(in crate::localize) const fn bank(&self) -> &Bank {
        &self.bank
    }

    /// Changes the motion model of every filter, because the odometry is at fault or is right again.
    pub fn change_motion(&mut self, change: impl Fn(&mut Ekf)) {
        self.bank.change_motion(change);
        (self.restarted, self.handover, self.has_departed) = (None, None, false);
        self.trusted_m = self.bank.nominal().driven_m();
    }

    /// Keeps a journal for smoothing if there is one filter; the filters of a monitored bank replace
    /// each other.
    pub fn keep_journal(&mut self) {
        if !self.settings.enabled {
            self.bank.keep_journal();
        }
    }

    /// Predicts every filter.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryResult {
        if let Some(restarted) = &mut self.restarted {
            restarted.bank.odometry(sample);
        }
        self.bank.odometry(sample)
    }

    /// Updates with an angle: the test of its radio head, and every filter that uses the radio
    /// head.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateResult {
        self.update_by(measured.time_s, |bank| bank.update(head, measured))
    }

    /// Updates with a range in the same way.
    pub fn update_range(&mut self, head: &RadioHead, measured: &RangeMeasurement) -> UpdateResult {
        self.update_by(measured.time_s, |bank| bank.update_range(head, measured))
    }

    /// Updates both banks with a measurement at `time_s`.
    fn update_by(
        &mut self,
        time_s: f64,
        update: impl Fn(&mut Bank) -> UpdateResult,
    ) -> UpdateResult {
        if !self.settings.enabled {
            return update(&mut self.bank);
        }
        self.now_s = self.now_s.max(time_s);
        let odometry_s = self.ekf().time_s();
        let (solution_id, before) = (self.solution_id(), self.ekf().pose(odometry_s));
        let verdict = update(&mut self.bank);
        self.bank.update_exclusions(self.now_s);
        if let Some(bank) = self.bank.rebased(self.now_s) {
            (self.bank, self.restarted) = (bank, None);
        }
        if let Some(restarted) = &mut self.restarted {
            update(&mut restarted.bank);
            restarted.bank.update_exclusions(self.now_s);
        }
        self.recover();
        self.hold_departure();
        if self.solution_id() != solution_id {
            let handover = Handover::new(&before, &self.ekf().pose(odometry_s));
            self.handover = handover.or(self.handover);
        }
        verdict
    }

    /// Returns the identity of the solution: hypothesis, number of excluded radio heads, time of
    /// the restart.
    fn solution_id(&self) -> (SelectedHypothesis, usize, f64) {
        (self.bank.selected(), self.bank.faulty(), self.begun_s)
    }

    /// Keeps the state that the odometer scale contradicts its specification until a filter has
    /// estimated the scale. A restarted filter has not.
    fn hold_departure(&mut self) {
        let main = self.bank.nominal();
        self.has_departed =
            main.odometer_departs() || (self.has_departed && !main.knows_odometer());
    }

    /// Starts or ends the recovery from an unidentified fault. If a fault is not identified, the
    /// filters may diverge so far that they reject correct angles as outliers. A second bank then
    /// starts from a pose with the uncertainty of the elapsed distance, and takes over once no test
    /// contradicts it. Until then, or until the first bank is free of contradictions, the state is
    /// not `ok`. The result of a search with possibly faulty angles is confirmed in the same way.
    fn recover(&mut self) {
        let now_s = self.now_s;
        let lost = self.bank.is_lost();
        let Some(restarted) = &self.restarted else {
            if lost || self.is_found {
                self.restart();
            } else {
                self.trusted_m = self.bank.nominal().driven_m();
            }
            return;
        };
        let aged = now_s - restarted.since_s > RECOVERY_S;
        if !lost && !self.is_found && self.bank.quiet_s(now_s) > RECOVERY_S {
            self.restarted = None;
        } else if aged && restarted.bank.is_lost() {
            self.restart();
        } else if restarted.bank.quiet_s(now_s) > RECOVERY_S
            && self.is_near(&restarted.bank, now_s)
            && let Some(restarted) = self.restarted.take()
        {
            self.bank = restarted.bank;
            self.is_found = false;
            self.begun_s = now_s;
        }
    }

    fn restart(&mut self) {
        let untrusted_m = self.bank.nominal().driven_m() - self.trusted_m;
        let position_std_m = self.settings.alert_limit_m + untrusted_m;
        self.restarted = Some(Restarted {
            bank: self.bank.restarted(position_std_m, self.now_s),
            since_s: self.now_s,
        });
    }

    /// Returns the pose at `time_s`. `others` are positions of a search, each with the probability
    /// that it is correct instead of the bank.
    pub fn pose(
        &self,
        time_s: f64,
        others: impl Iterator<Item = (f64, PoseEstimate)>,
    ) -> PoseEstimate {
        let mut pose = self.bank.leader().pose(time_s);
        if !self.settings.enabled {
            return pose;
        }
        let mixture = self.bank.mixture();
        pose.mix(mixture.map(|(probability, right)| (probability, right.pose(time_s))));
        pose.integrity = Some(self.integrity(time_s, others));
        let handover = self.handover.as_ref();
        if let Some(handover) = handover.and_then(|it| it.previous_pose(&pose)) {
            pose.cover(&handover);
        }
        let restarted = self.restarted.iter().map(|it| it.bank.nominal());
        for other in self.bank.candidates().chain(restarted) {
            pose.cover(&other.pose(time_s));
        }
        pose
    }

    /// Returns protection level and state at `time_s`.
    fn integrity(
        &self,
        time_s: f64,
        others: impl Iterator<Item = (f64, PoseEstimate)>,
    ) -> Integrity {
        let mut hypotheses = self.hypotheses.borrow_mut();
        hypotheses.clear();
        hypotheses.extend(self.hypotheses_of(&self.bank, time_s).map(|(_, it)| it));
        let selected = self.ekf().pose(time_s);
        let other = |(probability, pose): (f64, PoseEstimate)| {
            Hypothesis::new(probability, &pose, 1.0, &selected)
        };
        hypotheses.extend(others.filter_map(other));
        let levels = self.level.solve(&hypotheses);
        let most_are_blocked = self.bank.nominal().most_paths_are_blocked();
        let state = if self.bank.most_heads_are_suspect() || most_are_blocked {
            IntegrityState::Unavailable
        } else if self.has_departed
            || self.restarted.is_some()
            || self.bank.quiet_s(self.now_s) <= RECOVERY_S
            || levels.horizontal_m > self.settings.alert_limit_m
        {
            IntegrityState::Degraded
        } else {
            IntegrityState::Ok
        };
        Integrity {
            protection_level_m: levels.horizontal_m,
            protection_level_along_m: levels.along_m,
            protection_level_across_m: levels.across_m,
            state,
            hypothesis: self.bank.selected(),
            faulty: self.bank.faulty(),
        }
    }

    /// Whether the error is within the alert limit with the required probability.
    fn is_near(&self, bank: &Bank, time_s: f64) -> bool {
        let hypotheses = self.hypotheses_of(bank, time_s).map(|(_, it)| it);
        self.level.holds(self.settings.alert_limit_m, hypotheses)
    }

    /// Returns the hypotheses that are not negligible, each with the filter that is correct under
    /// it.
    fn hypotheses_of<'a>(
        &self,
        bank: &'a Bank,
        time_s: f64,
    ) -> impl Iterator<Item = (&'a Ekf, Hypothesis)> {
        let selected = bank.leader().pose(time_s);
        let measured_noise_scale = bank.noise_scale();
        let negligible = NEGLIGIBLE * self.level.risk();
        (bank.hypotheses())
            .filter(move |(probability, _)| *probability > negligible)
            .filter_map(move |(probability, right)| {
                let pose = right.pose(time_s);
                let noise_scale = right.config().unexpected_noise(measured_noise_scale);
                let hypothesis = Hypothesis::new(probability, &pose, noise_scale, &selected);
                hypothesis.map(|it| (right, it))
            })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::localize::modes::trip::{angle, trip_with_bias};

    /// Maximum change of the position at one angle, in standard deviations.
    const MAX_DEVIATIONS: f64 = 5.0;

    #[test]
    fn the_new_solution_covers_the_previous_one() {
        // The odometer measures 1.5 times the distance, and a radio head is received by a
        // reflection later. Neither fault explains the other.
        const READS: f64 = 1.5;
        const HIDDEN_S: f64 = 8.0;
        const OFF_RAD: f64 = -0.6;
        let (heads, road, ekf) = trip_with_bias(0.9);
        let mut guard = IntegrityMonitor::new(&ekf, &heads, IntegritySettings::default(), None);
        let mut farthest_m: f64 = 0.0;
        let mut last = guard.pose(0.0, std::iter::empty());
        for step in 1..150 {
            let time_s = f64::from(step) * 0.1;
            guard.odometry(&OdometrySample {
                time_s,
                distance_m: 4.0 * READS * time_s,
                speed_mps: 4.0,
                yaw_rate_radps: None,
            });
            let truth = road.pose(4.0 * time_s);
            for (number, head) in heads.iter().enumerate() {
                let bearing_rad = truth.point().bearing_rad(head.position) - truth.heading_rad;
                let is_off = number == 0 && time_s > HIDDEN_S;
                let off_rad = if is_off { OFF_RAD } else { 0.0 };
                let before = guard.pose(time_s, std::iter::empty());
                guard.update(head, &angle(time_s, PI * bearing_rad.cos() + off_rad));
                last = guard.pose(time_s, std::iter::empty());
                let moved_m = last.pose.point().distance_m(before.pose.point());
                let [before_m2, now_m2] = [&before, &last].map(|it| it.principal_variances()[0]);
                let std_m = before_m2.max(now_m2).sqrt();
                assert!(moved_m < MAX_DEVIATIONS * std_m, "{moved_m} of {std_m} m");
                farthest_m = farthest_m.max(moved_m);
            }
        }
        assert!(farthest_m > 5.0, "{farthest_m}");
        // The handover ends eventually.
        let std_m = last.principal_variances()[0].sqrt();
        assert!(std_m < 0.5 * farthest_m, "{std_m} m");
    }

    #[test]
    fn the_state_stays_ok_when_an_uncalibrated_array_becomes_nominal() {
        const TURNED_RAD: f64 = 0.02;
        let (heads, road, ekf) = trip_with_bias(0.0);
        let settings = IntegritySettings::default();
        let mut monitor = IntegrityMonitor::new(&ekf, &heads, settings, None);
        for step in 1..600 {
            let time_s = f64::from(step) * 0.1;
            monitor.odometry(&OdometrySample {
                time_s,
                distance_m: 4.0 * time_s,
                speed_mps: 4.0,
                yaw_rate_radps: None,
            });
            let truth = road.pose(4.0 * time_s);
            for head in &heads {
                let bearing_rad = truth.point().bearing_rad(head.position) - truth.heading_rad;
                monitor.update(head, &angle(time_s, PI * (bearing_rad - TURNED_RAD).cos()));
            }
            let integrity = monitor.integrity(time_s, std::iter::empty());
            let is_ok = integrity.state == IntegrityState::Ok;
            let is_wide = integrity.protection_level_m > settings.alert_limit_m;
            assert!(is_ok || is_wide, "{time_s} s: {integrity:?}");
        }
        // The selected mode has become the nominal one, so that the bank has no separate filter for
        // it.
        let selected = monitor.bank().selected();
        assert_eq!(selected, SelectedHypothesis::UncalibratedArray);
        assert!(monitor.bank().rebased(60.0).is_none());
    }
}
