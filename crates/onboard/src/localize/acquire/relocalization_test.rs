//! A search beside a filter: which of the two foretells the same angles better.

use super::gaussian_sum::GaussianSum;
use crate::clone_in_place::clone_in_place;
use crate::localize::ekf::Ekf;
use crate::localize::measurement::AngleMeasurement;
use crate::radio_head::RadioHead;

/// Log-likelihood by which a place must foretell the angles better than another: a sequential test (Wald
/// 1945) that is wrong once in three million.
const BETTER: f64 = 15.0;

/// Way to be driven before a find is believed (m): who stands hears the same errors again and again.
const LEAST_WAY_M: f64 = 0.5;

/// After this time with angles and without a find it has listened for long (s).
const PATIENCE_S: f64 = 20.0;

/// After this way a silent search beside a filter that hears now and then has listened for long (m).
const LONG_WAY_M: f64 = 100.0;

/// Looks at one radio head within this way share their errors: clusters keep an angle wrong for so long (m).
const LOOK_M: f64 = 10.0;

/// Who has not heard anything for so long does not listen (s).
const SILENCE_S: f64 = 1.0;

/// A search, and how the filter does meanwhile.
#[derive(Debug)]
pub struct RelocalizationTest {
    pub search: GaussianSum,
    pub is_wide: bool,
    /// Time of the newest odometry (s) when it was told of; nobody is as long as nothing speaks against
    /// the filter.
    pub told_s: Option<f64>,
    /// Whether the filter is refuted, so that its place is no longer told beside the search's.
    pub speaks_alone: bool,
    /// Whether angles may be off as if the filter were lost.
    is_misled: bool,
    /// Log-likelihood of the filter by the same angles.
    own: f64,
    /// Distance driven when it began, and driven since (m).
    since_m: f64,
    way_m: f64,
    /// When the last angle was heard (s), and for how long it has listened without silence (s).
    heard_s: f64,
    listened_s: f64,
    /// Angles, how many of them are looks of their own, and after which way each radio head had its last such look (m).
    angles: u32,
    looks: u32,
    looked_m: Vec<f64>,
}

clone_in_place!(RelocalizationTest {
    search,
    is_wide,
    told_s,
    speaks_alone,
    is_misled,
    own,
    since_m,
    way_m,
    heard_s,
    listened_s,
    angles,
    looks,
    looked_m
});

impl RelocalizationTest {
    /// A search that begins now; of a silent one nobody is told.
    pub fn new(
        search: GaussianSum,
        ekf: &Ekf,
        is_wide: bool,
        is_silent: bool,
    ) -> Self {
        let heads = search.heads().len();
        Self {
            search,
            is_wide,
            told_s: (!is_silent).then(|| ekf.time_s()),
            speaks_alone: false,
            is_misled: ekf.config().may_be_misled(),
            own: 0.0,
            since_m: ekf.driven_m(),
            way_m: 0.0,
            heard_s: f64::NEG_INFINITY,
            listened_s: 0.0,
            angles: 0,
            looks: 0,
            looked_m: vec![f64::NEG_INFINITY; heads],
        }
    }

    /// Lets both foretell an angle, before the filter takes it in.
    pub fn update(&mut self, ekf: &Ekf, head: &RadioHead, measured: &AngleMeasurement) {
        self.way_m = ekf.driven_m() - self.since_m;
        let silence_s = measured.time_s - self.heard_s;
        if silence_s < SILENCE_S {
            self.listened_s += silence_s.max(0.0);
        }
        self.heard_s = measured.time_s;
        let is_it = |mine: &RadioHead| mine.sends(head.pci, head.ssb_index);
        let number = self.search.heads().iter().position(is_it);
        if let Some(looked_m) = number.and_then(|number| self.looked_m.get_mut(number)) {
            self.angles = self.angles.saturating_add(1);
            if self.way_m - *looked_m >= LOOK_M {
                *looked_m = self.way_m;
                self.looks = self.looks.saturating_add(1);
            }
        }
        self.own += ekf.log_likelihood(&ekf.predict_measurement(head, measured));
        self.search.update(head, measured);
    }

    /// Log-likelihood by which the search's best place foretells the angles better than the filter does.
    /// Against a filter that nothing else speaks against, or that may be misled, only looks of their own count.
    fn lead(&self) -> f64 {
        let lead = self.search.best() - self.own;
        if self.is_silent() || self.is_misled {
            lead * f64::from(self.looks) / f64::from(self.angles.max(1))
        } else {
            lead
        }
    }

    /// Whether nobody is told of it.
    pub const fn is_silent(&self) -> bool {
        self.told_s.is_none()
    }

    /// Whether the search's best place is better than the filter's.
    pub fn is_ahead(&self) -> bool {
        self.lead() > BETTER
    }

    /// Whether it is worse.
    pub fn is_behind(&self) -> bool {
        self.lead() < -BETTER
    }

    /// Whether enough way was driven to believe it.
    pub fn has_moved(&self) -> bool {
        let least_m = if self.is_misled { LOOK_M } else { LEAST_WAY_M };
        self.way_m >= least_m
    }

    /// Whether it was a long way.
    pub fn has_moved_far(&self) -> bool {
        self.way_m > LONG_WAY_M
    }

    /// Tells of it from the newest odometry on, and begins to be patient anew.
    pub const fn tell(&mut self, odometry_s: f64) {
        (self.told_s, self.listened_s) = (Some(odometry_s), 0.0);
    }

    /// Whether it has listened for long.
    pub fn is_patient(&self) -> bool {
        self.listened_s > PATIENCE_S
    }
}
