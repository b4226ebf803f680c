//! Knows when it is lost, and comes back.
//!
//! As long as angles come from where the filter expects them, this only watches. When most of them
//! do not, the position is declared unavailable, and a search runs beside the filter: about where it
//! believes to be first, then wherever radio heads are, or along all of the road where there is one.
//! Where errors that stay are found but rare, the first angles of one are off as if it were lost: there the
//! search runs silently.
//! A place in the plane that was given is a hypothesis like others: from the first angle on a search
//! about it runs silently, until it has found the same place, has listened for long, or speaks against it.
//! What the search finds takes over only if it foretells the same angles better than the filter
//! did: a restart that would be worse than what it replaces never happens. Meanwhile the covariance
//! covers both; where the filter is refuted, a search nearby speaks alone. A guard that has begun anew
//! by itself meanwhile is searched for no more.

use std::sync::Arc;

use super::consistency::ConsistencyMonitor;
use super::gaussian_sum::{Area, GaussianSum};
use super::relocalization_test::RelocalizationTest;
use super::tracked::Tracked;
use crate::BoxError;
use crate::clone_in_place::clone_in_place;
use crate::geometry::wrap_angle;
use crate::localize::ekf::Ekf;
use crate::localize::localizer::{Localizer, Recovered, copy_into};
use crate::localize::measurement::{AngleMeasurement, OdometryVerdict, UpdateVerdict};
use crate::localize::modes::IntegrityConfig;
use crate::localize::pose_estimate::{IntegrityState, PoseEstimate};
use crate::localize::quantile::RadialQuantile;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::road::Road;

/// How far about the believed place is searched first (m), beyond three of its deviations.
const NEARBY_M: f64 = 2.0;

/// Most of three deviations that count as nearby (m).
const MOST_NEARBY_M: f64 = 10.0;

/// After a find that was no better than the filter nothing is searched for, so long (s).
const REST_S: f64 = 10.0;

/// Radio heads without which a place in the plane cannot be told from others.
const LEAST_HEADS: usize = 3;

/// What does not change on the way.
#[derive(Debug)]
struct Setup {
    road: Option<Road>,
    heads: Vec<RadioHead>,
    integrity: Option<IntegrityConfig>,
    quantile: RadialQuantile,
}

/// A filter, guarded or not, that knows when it is lost.
#[derive(Debug)]
pub struct Relocalizer {
    setup: Arc<Setup>,
    tracked: Tracked,
    watch: ConsistencyMonitor,
    test: Option<RelocalizationTest>,
    /// Whether the first angle is to begin the search that confirms the place that was given.
    is_to_confirm: bool,
    rests_until_s: f64,
    recovered: Option<Recovered>,
    keeps_journal: bool,
}

clone_in_place!(Relocalizer {
    setup,
    tracked,
    watch,
    test,
    is_to_confirm,
    rests_until_s,
    recovered,
    keeps_journal
});

impl Relocalizer {
    /// A filter of these radio heads, that was given its place or found it at a time; `road` is
    /// where it is to be searched for.
    pub fn new(
        ekf: Ekf,
        road: Option<Road>,
        heads: &[RadioHead],
        integrity: Option<IntegrityConfig>,
        found_s: Option<f64>,
    ) -> Self {
        let risk = integrity.unwrap_or_default().risk;
        let is_to_confirm = found_s.is_none() && road.is_none();
        Self {
            setup: Arc::new(Setup {
                road,
                heads: heads.to_vec(),
                integrity,
                quantile: RadialQuantile::new(risk),
            }),
            tracked: Tracked::new(ekf, heads, integrity, found_s),
            watch: ConsistencyMonitor::new(heads),
            test: None,
            is_to_confirm,
            rests_until_s: f64::NEG_INFINITY,
            recovered: None,
            keeps_journal: false,
        }
    }

    /// The search that is told of.
    fn told(&self) -> Option<&RelocalizationTest> {
        self.test.as_ref().filter(|it| !it.is_silent())
    }

    /// Begins to search, ends it, or goes on.
    fn judge(&mut self, now_s: f64) {
        let may_be_misled = self.tracked.ekf().config().may_be_misled();
        let Some(test) = &mut self.test else {
            if self.watch.is_lost() && now_s >= self.rests_until_s {
                self.test = self.begin(now_s, false, may_be_misled);
            }
            return;
        };
        let is_ahead = test.is_ahead();
        let odometry_s = self.tracked.ekf().time_s();
        let is_refuted = self.watch.is_lost() && !may_be_misled;
        if test.is_silent() && (is_ahead && test.has_moved() || is_refuted) {
            test.tell(odometry_s);
        }
        if test.told_s == Some(odometry_s) {
            return; // before anything moves the covariance covers both
        }
        test.speaks_alone = is_ahead && test.has_moved();
        // Led astray it may have come to agree with the angles where it now is; it is sure of itself
        // only where every other place foretells them worse.
        let is_sure = test.is_behind() && self.watch.is_sure();
        if is_ahead && !test.has_moved() {
            return;
        }
        let is_long = test.is_patient() || (may_be_misled && test.has_moved_far());
        let is_over = is_sure || (test.is_silent() && is_long);
        if is_ahead && let Some(found) = test.search.found() {
            self.take(found, now_s);
        } else if is_over || (!is_ahead && test.search.found().is_some()) {
            // What is found elsewhere, if anything, is no better.
            if !test.is_silent() || may_be_misled {
                self.rests_until_s = now_s + REST_S;
                self.watch.reset();
            }
            self.test = None;
        } else if !test.is_wide && test.is_patient() {
            self.test = self.begin(now_s, true, false);
        }
    }

    /// A search nearby, or wherever radio heads are: at once where that is no more to look at. Of a
    /// silent one nobody is told.
    fn begin(&self, now_s: f64, is_wide: bool, is_silent: bool) -> Option<RelocalizationTest> {
        let setup = &self.setup;
        let (ekf, heads) = (self.tracked.ekf(), setup.heads.as_slice());
        let mut config = *ekf.config();
        if config.heard_noise_ratio.is_some() {
            config.set_noise_ratio(Some(self.tracked.noise_ratio()));
        }
        let mut search = match &setup.road {
            Some(road) => GaussianSum::new(config, road.clone(), true, heads),
            None if heads.len() < LEAST_HEADS => return None,
            None if is_wide || GaussianSum::is_small(Area::of_heads(heads)) => {
                GaussianSum::in_plane(config, Area::of_heads(heads), heads)
            }
            None => {
                let here = self.tracked.pose(now_s);
                let three_m = 3.0 * here.principal_variances()[0].sqrt();
                let nearby_m = NEARBY_M + three_m.min(MOST_NEARBY_M);
                let area = Area::around(here.pose.point(), nearby_m);
                GaussianSum::in_plane(config, area, heads)
            }
        };
        search.resume(ekf);
        Some(RelocalizationTest::new(search, ekf, is_wide, is_silent))
    }

    fn take(&mut self, found: Ekf, now_s: f64) {
        let (from, to) = (self.tracked.pose(now_s).pose, found.pose(now_s).pose);
        self.recovered = Some(Recovered {
            time_s: now_s,
            moved_m: from.point().distance_m(to.point()),
            turned_rad: wrap_angle(to.heading_rad - from.heading_rad),
        });
        let setup = &self.setup;
        self.tracked = Tracked::new(found, &setup.heads, setup.integrity, Some(now_s));
        if self.keeps_journal {
            self.tracked.keep_journal();
        }
        self.test = None;
        self.watch.reset();
    }
}

impl Localizer for Relocalizer {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, BoxError> {
        if let Some(test) = &mut self.test {
            test.search.odometry(sample);
        }
        Ok(self.tracked.odometry(sample))
    }

    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateVerdict, BoxError> {
        if std::mem::take(&mut self.is_to_confirm) {
            self.test = self.begin(measured.time_s, false, true);
        }
        // A search is of places as the filter that it is compared with foretells angles there.
        let estimates_bias = self.tracked.ekf().config().estimates_bias();
        if (self.test.as_ref()).is_some_and(|it| it.search.estimates_bias() != estimates_bias) {
            self.test = self.begin(measured.time_s, false, true);
        }
        if let Some(test) = &mut self.test {
            test.update(self.tracked.ekf(), head, measured);
        }
        let begun_s = self.tracked.begun_s();
        let verdict = self.tracked.update(head, measured);
        if self.tracked.begun_s() > begun_s && self.is_lost() {
            // The filter that was lost is no more.
            self.test = None;
            self.watch.reset();
        }
        self.watch.see(head, &verdict, self.tracked.noise_ratio());
        self.judge(measured.time_s);
        Ok(verdict)
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        let mut estimate = self.tracked.pose(time_s);
        if let Some(test) = self.told() {
            let searched = test.search.pose(time_s);
            // Along all of a road, or far about, its best place may be anywhere.
            let is_near = self.setup.road.is_none() && !test.is_wide;
            if is_near && test.speaks_alone {
                (estimate.pose, estimate.covariance) = (searched.pose, searched.covariance);
            } else {
                estimate.cover(&searched);
            }
            let level_m = self.setup.quantile.radius(estimate.principal_variances());
            if let Some(integrity) = &mut estimate.integrity {
                integrity.state = IntegrityState::Unavailable;
                integrity.raise(level_m);
            }
        }
        Ok(estimate)
    }

    fn copy_to(&self, slot: &mut Option<Box<dyn Localizer>>) -> bool {
        copy_into(self, slot)
    }

    fn is_lost(&self) -> bool {
        self.told().is_some()
    }

    fn recovered(&self) -> Option<Recovered> {
        self.recovered
    }

    fn ekf(&self) -> Option<&Ekf> {
        Some(self.tracked.ekf())
    }

    fn worst_case(&self) -> Option<&Ekf> {
        Some(self.tracked.worst_case())
    }

    fn keep_journal(&mut self) {
        self.keeps_journal = true;
        self.tracked.keep_journal();
    }
}
