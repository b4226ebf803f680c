//! Knows when it is lost, and comes back.
//!
//! As long as angles come from where the tracker expects them, this only watches. When most of them
//! do not, the position is declared unavailable, and a search runs beside the tracker: about where it
//! believes to be first, then wherever radio heads are, or along all of the road where there is one.
//! What the search finds takes over only if it foretells the same angles better than the tracker
//! did: a restart that would be worse than what it replaces never happens. Meanwhile the covariance
//! covers both; where the tracker is refuted, a search nearby speaks alone.

use std::sync::Arc;

use super::area::Area;
use super::initialise::Initialiser;
use super::integrity::IntegrityConfig;
use super::integrity_state::IntegrityState;
use super::localizer::{Localizer, Recovered, copy_into};
use super::measurement::{AngleMeasurement, UpdateVerdict};
use super::pose_estimate::PoseEstimate;
use super::quantile::RadialQuantile;
use super::tracked::Tracked;
use super::tracker::{OdometryVerdict, Tracker, TrackerConfig};
use super::watch::Watch;
use crate::BoxError;
use crate::clone_in_place::clone_in_place;
use crate::geometry::wrap_angle;
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::road::Road;

/// How far about the believed place is searched first (m), beyond three of its deviations.
const NEARBY_M: f64 = 2.0;

/// Most of three deviations that count as nearby (m).
const MOST_NEARBY_M: f64 = 10.0;

/// After this time with angles and without a find the search goes wide (s).
const PATIENCE_S: f64 = 20.0;

/// After a find that was no better than the tracker nothing is searched for, so long (s).
const REST_S: f64 = 10.0;

/// Way to be driven before a find is believed (m): who stands hears the same errors again and again.
const LEAST_WAY_M: f64 = 0.5;

/// Log-likelihood by which a place must foretell the angles better than another: a sequential test (Wald
/// 1945) that is wrong once in three million.
const BETTER: f64 = 15.0;

/// Radio heads without which a place in the plane cannot be told from others.
const LEAST_HEADS: usize = 3;

/// What does not change on the way.
#[derive(Debug)]
struct Setup {
    config: TrackerConfig,
    road: Option<Road>,
    heads: Vec<RadioHead>,
    integrity: Option<IntegrityConfig>,
    quantile: RadialQuantile,
}

/// A tracker, guarded or not, that knows when it is lost.
#[derive(Debug)]
pub struct Recovery {
    setup: Arc<Setup>,
    tracked: Tracked,
    watch: Watch,
    search: Option<Search>,
    rests_until_s: f64,
    recovered: Option<Recovered>,
    keeps_journal: bool,
}

clone_in_place!(Recovery {
    setup,
    tracked,
    watch,
    search,
    rests_until_s,
    recovered,
    keeps_journal
});

#[derive(Clone, Debug)]
struct Search {
    initialiser: Initialiser,
    /// Log-likelihood of the tracker by the same angles.
    own: f64,
    /// When it heard its first angle (s).
    since_s: Option<f64>,
    /// Distance driven when it began (m).
    since_m: f64,
    is_wide: bool,
}

impl Search {
    /// Log-likelihood by which its best place foretells the angles better than the tracker does.
    fn ahead(&self) -> f64 {
        self.initialiser.best() - self.own
    }

    /// Whether it has listened for long.
    fn is_patient(&self, now_s: f64) -> bool {
        self.since_s
            .is_some_and(|since_s| now_s - since_s > PATIENCE_S)
    }
}

impl Recovery {
    /// A tracker of these radio heads, that was given its place or found it at a time; `road` is
    /// where it is to be searched for.
    pub fn new(
        tracker: Tracker,
        road: Option<Road>,
        heads: &[RadioHead],
        integrity: Option<IntegrityConfig>,
        found_s: Option<f64>,
    ) -> Self {
        let risk = integrity.unwrap_or_default().risk;
        Self {
            setup: Arc::new(Setup {
                config: *tracker.config(),
                road,
                heads: heads.to_vec(),
                integrity,
                quantile: RadialQuantile::new(risk),
            }),
            tracked: Tracked::new(tracker, heads, integrity, found_s),
            watch: Watch::new(heads),
            search: None,
            rests_until_s: f64::NEG_INFINITY,
            recovered: None,
            keeps_journal: false,
        }
    }

    /// Begins to search, ends it, or goes on.
    fn judge(&mut self, now_s: f64) {
        let Some(search) = &self.search else {
            if self.watch.is_lost() && now_s >= self.rests_until_s {
                self.search = self.begin(now_s, false);
            }
            return;
        };
        let is_ahead = search.ahead() > BETTER;
        // Led astray it may have come to agree with the angles where it now is; it is sure of itself
        // only where every other place foretells them worse.
        let is_sure = search.ahead() < -BETTER && self.watch.is_sure();
        let way_m = self.tracked.tracker().driven_m() - search.since_m;
        if is_ahead && way_m < LEAST_WAY_M {
            return;
        }
        if is_ahead && let Some(found) = search.initialiser.found() {
            self.take(found, now_s);
        } else if is_sure || (!is_ahead && search.initialiser.found().is_some()) {
            // What is found elsewhere, if anything, is no better.
            self.search = None;
            self.rests_until_s = now_s + REST_S;
            self.watch.reset();
        } else if !search.is_wide && search.is_patient(now_s) {
            self.search = self.begin(now_s, true);
        }
    }

    /// A search nearby, or wherever radio heads are: at once where that is no more to look at.
    fn begin(&self, now_s: f64, is_wide: bool) -> Option<Search> {
        let setup = &self.setup;
        let (config, heads) = (setup.config, setup.heads.as_slice());
        let mut initialiser = match &setup.road {
            Some(road) => Initialiser::new(config, road.clone(), true, heads),
            None if heads.len() < LEAST_HEADS => return None,
            None if is_wide || Initialiser::is_small(Area::of_heads(heads)) => {
                Initialiser::in_plane(config, Area::of_heads(heads), heads)
            }
            None => {
                let here = self.tracked.pose(now_s);
                let three_m = 3.0 * here.principal_variances()[0].sqrt();
                let nearby_m = NEARBY_M + three_m.min(MOST_NEARBY_M);
                let area = Area::around(here.pose.point(), nearby_m);
                Initialiser::in_plane(config, area, heads)
            }
        };
        initialiser.resume(self.tracked.tracker());
        Some(Search {
            initialiser,
            own: 0.0,
            since_s: None,
            since_m: self.tracked.tracker().driven_m(),
            is_wide,
        })
    }

    fn take(&mut self, found: Tracker, now_s: f64) {
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
        self.search = None;
        self.watch.reset();
    }
}

impl Localizer for Recovery {
    fn odometry(&mut self, sample: &OdometrySample) -> Result<OdometryVerdict, BoxError> {
        if let Some(search) = &mut self.search {
            search.initialiser.odometry(sample);
        }
        Ok(self.tracked.odometry(sample))
    }

    fn update(
        &mut self,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Result<UpdateVerdict, BoxError> {
        if let Some(search) = &mut self.search {
            search.since_s.get_or_insert(measured.time_s);
            search.initialiser.update(head, measured);
            let tracker = self.tracked.tracker();
            search.own += tracker.log_likelihood(&tracker.look(head, measured));
        }
        let verdict = self.tracked.update(head, measured);
        self.watch.see(head, &verdict, self.tracked.noise_ratio());
        self.judge(measured.time_s);
        Ok(verdict)
    }

    fn pose(&self, time_s: f64) -> Result<PoseEstimate, BoxError> {
        let mut estimate = self.tracked.pose(time_s);
        if let Some(search) = &self.search {
            let searched = search.initialiser.pose(time_s);
            // Along all of a road, or far about, its best place may be anywhere.
            let is_near = self.setup.road.is_none() && !search.is_wide;
            if is_near && search.ahead() > BETTER {
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
        self.search.is_some()
    }

    fn recovered(&self) -> Option<Recovered> {
        self.recovered
    }

    fn tracker(&self) -> Option<&Tracker> {
        Some(self.tracked.tracker())
    }

    fn doubtful(&self) -> Option<&Tracker> {
        Some(self.tracked.doubtful())
    }

    fn keep_journal(&mut self) {
        self.keeps_journal = true;
        self.tracked.keep_journal();
    }
}
