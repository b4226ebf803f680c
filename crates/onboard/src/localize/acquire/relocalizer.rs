//! Built-in localizer: searches for the initial pose, tracks, and searches again if the vehicle is
//! lost.
//!
//! While the angles agree with the filter's prediction, no search runs. If most radio heads
//! contradict it, the position becomes unavailable and a search runs in parallel to the filter:
//! first around the filter's position, then in the area of the radio heads, or along the whole
//! road. If the selected hypothesis may explain the contradiction, the filter is only confirmed:
//! the position is unchanged until the search finds a better one. A given start without a road is
//! one hypothesis of several, and is confirmed from the first angle on. The position after a fault
//! of the odometry is treated in the same way, with a road too.
//!
//! A result of the search replaces the filter only if the same angles are more probable there, so
//! that a restart never makes the position worse, or if search and given start have reached one
//! position elsewhere. Meanwhile the covariance covers both; if the filter is refuted, only the
//! nearby search is reported. If the bank restarts by itself meanwhile, the search ends.

use std::cmp::Ordering;
use std::sync::Arc;

use super::consistency::ConsistencyMonitor;
use super::gaussian_sum::{GaussianSum, MIN_HEADS};
use super::heading_search::HeadingSearch;
use super::phase::{Evidence, Phase, Transition};
use super::relocalization_test::{PATIENCE_S, RelocalizationTest};
use crate::BoxError;
use crate::clone_in_place::clone_in_place;
use crate::gaussian::RadialQuantile;
use crate::geometry::{Area, Pose};
use crate::localize::ekf::{Ekf, EkfConfig, FreeMotion};
use crate::localize::integrity::IntegrityMonitor;
use crate::localize::localizer::{Localizer, Recovered, copy_into};
use crate::localize::output::{Integrity, IntegrityState, PoseEstimate};
use crate::localize::output::{OdometryResult, UpdateReason, UpdateResult};
use crate::observation::AngleMeasurement;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::range::RangeMeasurement;
use crate::road::Road;
use crate::settings::IntegritySettings;

/// Distance around the filter's position that is searched first, in addition to three standard
/// deviations (m).
const NEARBY_M: f64 = 2.0;

/// Maximum of three standard deviations for a nearby search (m).
const MAX_NEARBY_M: f64 = 10.0;

/// Minimum time between a search without a better position and the next search (s).
const REST_S: f64 = 10.0;

/// Distance after which a confirmation with few angles ends (m).
const LONG_DISTANCE_M: f64 = 100.0;

/// Probability that the position after a fault of the odometry is wrong, without knowledge of whether
/// the filter without odometry has lost the vehicle.
const AFTER_FAULT: f64 = 0.5;

/// Standard deviation of the start position (m) in the search for the heading with ranges.
const START_STD_M: f64 = 1.0;

/// Configuration that is constant during a drive.
#[derive(Debug)]
struct DriveConfig {
    road: Option<Road>,
    heads: Vec<RadioHead>,
    integrity: IntegritySettings,
    quantile: RadialQuantile,
}

clone_in_place! {
    /// Built-in localizer.
    #[derive(Debug)]
    pub struct Relocalizer {
        drive_config: Arc<DriveConfig>,
        phase: Phase,
        /// Search for the initial pose; `None` once the pose is known.
        search: Option<GaussianSum>,
        /// Solution; `None` during the search for the initial pose.
        solution: Option<Box<IntegrityMonitor>>,
        consistency: ConsistencyMonitor,
        /// Test between the solution and a search in parallel, while it runs.
        test: Option<RelocalizationTest>,
        /// Search for the heading with ranges, while it runs.
        heading: Option<HeadingSearch>,
        /// Whether angles were received. They measure the heading, so that no search with ranges is
        /// necessary, which would ignore the angles.
        has_angles: bool,
        rests_until_s: f64,
        recovered: Option<Recovered>,
        keeps_journal: bool,
        /// Prior probability that the given start is wrong.
        wrong_start: f64,
        /// Whether the odometry is at fault, so that no search is possible.
        is_without_odometry: bool,
    }
}

impl Relocalizer {
    /// Creates a localizer that tracks with a filter of these radio heads; `road` is the region of
    /// a search if the vehicle is lost.
    pub fn tracking(
        ekf: &Ekf,
        road: Option<Road>,
        heads: &[RadioHead],
        integrity: IntegritySettings,
    ) -> Self {
        let phase = if road.is_none() {
            Phase::Given
        } else {
            Phase::Tracking
        };
        let mut made = Self::new(phase, road, heads, integrity);
        made.wrong_start = integrity
            .fault_probability
            .of_radio_head(ekf.is_with_bias());
        made.heading = HeadingSearch::new(ekf, heads, START_STD_M);
        made.solution = Some(made.solution_of(ekf, None));
        made
    }

    /// Creates a localizer that searches for the initial pose.
    pub fn searching(
        search: GaussianSum,
        road: Option<Road>,
        integrity: IntegritySettings,
    ) -> Self {
        let mut made = Self::new(Phase::Searching, road, search.heads(), integrity);
        made.search = Some(search);
        made
    }

    fn new(
        phase: Phase,
        road: Option<Road>,
        heads: &[RadioHead],
        integrity: IntegritySettings,
    ) -> Self {
        Self {
            phase,
            search: None,
            solution: None,
            consistency: ConsistencyMonitor::new(heads),
            test: None,
            heading: None,
            has_angles: false,
            rests_until_s: f64::NEG_INFINITY,
            recovered: None,
            keeps_journal: false,
            wrong_start: 0.0,
            is_without_odometry: false,
            drive_config: Arc::new(DriveConfig {
                road,
                heads: heads.to_vec(),
                integrity,
                quantile: RadialQuantile::new(integrity.risk_per_epoch()),
            }),
        }
    }

    /// Continues without odometry from a start on: every filter of the bank follows the angles.
    pub(crate) fn begin_free_motion(&mut self, motion: &FreeMotion) {
        self.change_motion(|ekf| ekf.begin_free_motion(motion));
        self.is_without_odometry = true;
    }

    /// Continues with odometry that was at fault, with the specified noise, and with the constants and the speed
    /// noise of the odometry from the filter `before`.
    pub(crate) fn end_free_motion(&mut self, specified: &EkfConfig, before: &Ekf) {
        self.change_motion(|ekf| ekf.end_free_motion(specified, before));
        self.is_without_odometry = false;
        self.wrong_start = AFTER_FAULT;
        self.begin_of_start(f64::NEG_INFINITY);
    }

    fn change_motion(&mut self, change: impl Fn(&mut Ekf)) {
        if let Some(solution) = &mut self.solution {
            solution.change_motion(change);
        }
        self.end_search();
        self.heading = None;
        self.consistency.reset();
    }

    /// Creates the solution of a filter whose position was given, or found at `found_s`.
    fn solution_of(&self, ekf: &Ekf, found_s: Option<f64>) -> Box<IntegrityMonitor> {
        let DriveConfig {
            heads, integrity, ..
        } = &*self.drive_config;
        Box::new(IntegrityMonitor::new(ekf, heads, *integrity, found_s))
    }

    /// Tracks with the result of a search at time `now_s`.
    fn track(&mut self, found: &Ekf, now_s: f64) {
        let mut solution = self.solution_of(found, Some(now_s));
        if self.keeps_journal {
            solution.keep_journal();
        }
        (self.solution, self.search) = (Some(solution), None);
        self.end_search();
        self.consistency.reset();
    }

    /// Replaces the solution with the pose `from` by the result of a search at time `now_s`.
    fn take_over(&mut self, found: &Ekf, from: Pose, now_s: f64) {
        let [x_m, y_m, turned_rad] = from.offset_of(found.pose(now_s).pose);
        self.recovered = Some(Recovered {
            time_s: now_s,
            moved_m: x_m.hypot(y_m),
            turned_rad,
        });
        self.track(found, now_s);
    }

    /// Updates the search for the heading, and replaces the solution by its result.
    fn search_heading(&mut self, now_s: f64) {
        let Some(solution) = &self.solution else {
            return;
        };
        let ekf = solution.ekf();
        let Some(search) = &self.heading else {
            let is_contradicted = solution.bank().is_lost() && !self.has_angles;
            if is_contradicted && now_s >= self.rests_until_s {
                self.heading = HeadingSearch::new(ekf, &self.drive_config.heads, NEARBY_M);
                self.rests_until_s = now_s + REST_S;
            }
            return;
        };
        if let Some(found) = search.found().cloned() {
            let from = solution.pose(now_s, std::iter::empty()).pose;
            self.take_over(&found, from, now_s);
            self.heading = None;
        } else if search.is_over(ekf) {
            self.heading = None;
        }
    }

    fn end_search(&mut self) {
        (self.phase, self.test) = (Phase::Tracking, None);
    }

    /// Starts the search of all starts other than the given one; if all of them are nearby, the
    /// usual search.
    fn begin_of_start(&mut self, now_s: f64) {
        let heads = self.drive_config.heads.as_slice();
        let road = self.drive_config.road.as_ref();
        let (true, Some(solution)) = (
            road.is_some() || GaussianSum::serves_as_stated(heads),
            &self.solution,
        ) else {
            return self.begin(Phase::Confirming, now_s);
        };
        let given = solution.ekf();
        let mut search = GaussianSum::as_stated(given.config(), road.cloned(), heads);
        search.resume(given);
        let risk = self.drive_config.integrity.risk_per_epoch();
        self.test = Some(RelocalizationTest::of_start(
            search,
            given,
            self.wrong_start,
            risk,
        ));
        self.phase = Phase::Confirming;
    }

    /// Whether a search verifies the given start.
    fn is_of_start(&self) -> bool {
        self.test
            .as_ref()
            .is_some_and(RelocalizationTest::is_of_start)
    }

    /// Whether another start is more probable than the given one.
    fn other_start_is_likelier(&self) -> bool {
        self.test
            .as_ref()
            .is_some_and(RelocalizationTest::other_start_is_likelier)
    }

    /// Starts a search in parallel to the solution.
    fn begin(&mut self, phase: Phase, now_s: f64) {
        let is_wide = phase == Phase::Relocalizing { wide: true };
        let test = (self.solution.as_ref()).and_then(|solution| {
            let search = self.search_about(solution, now_s, is_wide)?;
            let may_explain_contradictions = solution.bank().may_explain_contradictions();
            Some(RelocalizationTest::new(
                search,
                solution.ekf(),
                may_explain_contradictions,
            ))
        });
        self.phase = if test.is_some() {
            phase
        } else {
            Phase::Tracking
        };
        self.test = test;
    }

    /// Returns a nearby search, or one in the area of the radio heads. It is wide immediately if
    /// both regions are equal.
    fn search_about(
        &self,
        solution: &IntegrityMonitor,
        now_s: f64,
        is_wide: bool,
    ) -> Option<GaussianSum> {
        let (ekf, heads) = (solution.ekf(), self.drive_config.heads.as_slice());
        let mut config = *ekf.config();
        if config.measured_noise_scale.is_some() {
            config.set_noise_scale(Some(solution.bank().noise_scale()));
        }
        let road = self.drive_config.road.as_ref();
        let mut search = match road {
            Some(_) => GaussianSum::new(config, road.cloned(), true, heads),
            None if heads.len() < MIN_HEADS => return None,
            None if is_wide || GaussianSum::is_small(heads) => {
                GaussianSum::new(config, None, true, heads)
            }
            None => {
                let here = solution.pose(now_s, std::iter::empty());
                let three_m = 3.0 * here.principal_variances()[0].sqrt();
                let nearby_m = NEARBY_M + three_m.min(MAX_NEARBY_M);
                let area = Area::around(here.pose.point(), nearby_m);
                GaussianSum::in_plane(config, area, heads)
            }
        };
        search.resume(ekf);
        Some(search)
    }

    fn evidence(&self, solution: &IntegrityMonitor, now_s: f64) -> Evidence {
        let odometry_s = solution.ekf().time_s();
        let is = |what: &dyn Fn(&RelocalizationTest) -> bool| self.test.as_ref().is_some_and(what);
        let compared = |it: &RelocalizationTest| it.compare(self.phase == Phase::Confirming);
        let search = self.test.as_ref().map_or(Ordering::Equal, compared);
        let is_of_start = self.is_of_start();
        Evidence {
            is_lost: self.consistency.is_lost(),
            is_consistent: self.consistency.is_consistent(),
            may_explain_contradictions: solution.bank().may_explain_contradictions(),
            pause_has_elapsed: now_s >= self.rests_until_s,
            search,
            is_found: is(&|it| it.search.found().is_some()),
            is_of_start,
            is_merged: is(&RelocalizationTest::is_merged),
            other_start_is_likelier: self.other_start_is_likelier(),
            agrees: is(&|it| {
                it.agrees_with(solution.ekf()) && it.agrees_with(solution.bank().nominal())
            }),
            is_just_reported: is(&|it| it.reported_s == odometry_s),
            has_moved: is(&|it| it.driven_m >= it.min_driven_m()),
            has_moved_far: is(&|it| it.driven_m > LONG_DISTANCE_M),
            maximum_search_duration_reached: is(&|it| it.listened_s > PATIENCE_S),
        }
    }

    /// Advances to the next phase.
    fn advance(&mut self, now_s: f64) {
        let Some(solution) = &self.solution else {
            return;
        };
        let odometry_s = solution.ekf().time_s();
        let evidence = self.evidence(solution, now_s);
        let is_ahead = evidence.search == Ordering::Greater;
        let is_reported = matches!(self.phase, Phase::Relocalizing { .. });
        if let (true, Some(test)) = (is_reported && !evidence.is_just_reported, &mut self.test) {
            test.refutes = is_ahead && evidence.has_moved;
        }
        match self.phase.next(&evidence) {
            Transition::Stay => {}
            Transition::Begin(phase) => self.begin(phase, now_s),
            Transition::Report => {
                let wide = self.is_of_start();
                self.phase = Phase::Relocalizing { wide };
                if let Some(test) = &mut self.test {
                    test.report(odometry_s);
                }
            }
            Transition::TakeOver => {
                if let Some(found) = self.test.as_ref().and_then(|it| it.search.found()) {
                    let from = solution.pose(now_s, std::iter::empty()).pose;
                    self.take_over(&found, from, now_s);
                }
            }
            Transition::End { rests } => {
                if rests {
                    self.rests_until_s = now_s + REST_S;
                    self.consistency.reset();
                }
                self.end_search();
            }
        }
    }
}

impl Localizer for Relocalizer {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryResult, BoxError> {
        if let Some(search) = &mut self.search {
            return Ok(search.odometry(sample));
        }
        if let Some(test) = &mut self.test {
            test.odometry(sample);
        }
        if let Some(heading) = &mut self.heading {
            heading.odometry(sample);
        }
        let solution = self.solution.as_mut();
        Ok(solution.map_or(OdometryResult::NotFinite, |it| it.odometry(sample)))
    }

    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        let now_s = measured.time_s;
        (self.heading, self.has_angles) = (None, true);
        if let Some(search) = &mut self.search {
            if !search.is_due(head, now_s) {
                // Not used is not rejected.
                return Ok(UpdateResult {
                    accepted: true,
                    ..UpdateResult::unused(UpdateReason::Consistent)
                });
            }
            let verdict = search.update(head, measured);
            if let Some(found) = search.found() {
                self.track(&found, now_s);
            }
            return Ok(verdict);
        }
        if let (true, Some(solution)) = (self.is_without_odometry, &mut self.solution) {
            return Ok(solution.update(head, measured));
        }
        // The hypotheses of a search predict angles with the states of the filter that they are
        // compared with.
        let is_of_other_model = |test: &RelocalizationTest| {
            (self.solution.as_ref()).is_some_and(|it| !test.search.has_model_of(it.ekf()))
        };
        if self.phase == Phase::Given {
            self.begin_of_start(now_s);
        } else if !self.is_of_start() && self.test.as_ref().is_some_and(is_of_other_model) {
            self.begin(Phase::Confirming, now_s);
        }
        let Some(solution) = &mut self.solution else {
            return Ok(UpdateResult::unused(UpdateReason::Unusable));
        };
        if let Some(test) = &mut self.test {
            test.update(solution.ekf(), head, measured);
        }
        let begun_s = solution.begun_s();
        let verdict = solution.update(head, measured);
        let (has_restarted, noise_scale) =
            (solution.begun_s() > begun_s, solution.bank().noise_scale());
        if has_restarted && self.is_lost() && !self.is_of_start() {
            // The filter that was lost has been replaced.
            self.end_search();
            self.consistency.reset();
        }
        self.consistency.see(head, &verdict, noise_scale);
        self.advance(now_s);
        Ok(verdict)
    }

    fn update_range(
        &mut self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> Result<UpdateResult, BoxError> {
        // A search for the position uses angles only.
        let Some(solution) = &mut self.solution else {
            return Ok(UpdateResult::unused(UpdateReason::Unusable));
        };
        if let Some(heading) = &mut self.heading {
            heading.update(solution.ekf(), head, measured);
        }
        let verdict = solution.update_range(head, measured);
        self.search_heading(measured.time_s);
        Ok(verdict)
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        let quantile = &self.drive_config.quantile;
        let Some(solution) = &self.solution else {
            let mut estimate = self.search.as_ref().ok_or("no search")?.pose(time_s);
            let level_m = quantile.radius(estimate.principal_variances());
            let is_monitored = self.drive_config.integrity.enabled;
            estimate.integrity = is_monitored.then(|| Integrity::unavailable(level_m));
            return Ok(estimate);
        };
        let of_start = self.test.as_ref().filter(|it| it.is_of_start());
        let mut estimate = match of_start {
            Some(test) if !self.is_lost() => solution.pose(time_s, test.other_starts(time_s)),
            _ => solution.pose(time_s, std::iter::empty()),
        };
        if let (true, Some(test)) = (self.is_lost(), &self.test) {
            let searched = test.search.pose(time_s);
            // In a search along the whole road or in the whole area, the best position may be far
            // away.
            let is_near = self.drive_config.road.is_none()
                && self.phase == Phase::Relocalizing { wide: false };
            if is_near && test.refutes {
                (estimate.pose, estimate.covariance) = (searched.pose, searched.covariance);
            } else {
                estimate.cover(&searched);
            }
            let level_m = quantile.radius(estimate.principal_variances());
            if let Some(integrity) = &mut estimate.integrity {
                integrity.state = IntegrityState::Unavailable;
                integrity.raise(level_m);
            }
        }
        if self
            .heading
            .as_ref()
            .is_some_and(HeadingSearch::other_heading_is_likelier)
            && let Some(integrity) = &mut estimate.integrity
        {
            integrity.state = IntegrityState::Unavailable;
        }
        Ok(estimate)
    }

    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        copy_into(self, slot)
    }

    fn hypotheses(&self) -> Option<usize> {
        self.search.as_ref().map(GaussianSum::left)
    }

    fn is_lost(&self) -> bool {
        matches!(self.phase, Phase::Relocalizing { .. }) || self.other_start_is_likelier()
    }

    fn recovered(&self) -> Option<Recovered> {
        self.recovered
    }

    fn ekf(&self) -> Option<&Ekf> {
        self.solution.as_ref().map(|it| it.ekf())
    }

    fn worst_case(&self) -> Option<&Ekf> {
        self.solution.as_ref().map(|it| it.worst_case())
    }

    fn keep_journal(&mut self) {
        self.keeps_journal = true;
        if let Some(solution) = &mut self.solution {
            solution.keep_journal();
        }
    }
}
