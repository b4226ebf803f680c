//! A sequential probability ratio test (Wald 1945) between the place of a filter and the best place of a search beside
//! it.

use std::cmp::Ordering;

use super::gaussian_sum::GaussianSum;
use crate::clone_in_place::clone_in_place;
use crate::localize::ekf::Ekf;
use crate::localize::modes::{CERTAIN, log_likelihood};
use crate::observation::AngleMeasurement;
use crate::radio_head::RadioHead;

/// Way to be driven before a find is believed (m): a vehicle that stands hears the same errors again and again.
const LEAST_WAY_M: f64 = 0.5;

/// Angles of one radio head within this way share their errors: clusters keep an angle wrong for so long (m).
const INDEPENDENT_M: f64 = 10.0;

/// Longer silences do not count as time with angles (s).
const SILENCE_S: f64 = 1.0;

clone_in_place! {
    /// A search beside a filter, and the likelihoods of both.
    #[derive(Debug)]
    pub(super) struct RelocalizationTest {
        pub search: GaussianSum,
        /// Time of the newest odometry when it began to be reported (s).
        pub reported_s: f64,
        /// Whether the filter is refuted, so that its place is not reported any more beside the search's.
        pub refutes: bool,
        /// Whether angles may be off as if the vehicle were lost.
        may_mislead: bool,
        /// Log-likelihood of the angles by the filter.
        of_filter: f64,
        /// Distance driven when it began, and driven since (m).
        since_m: f64,
        pub way_m: f64,
        /// When the last angle was heard, and for how long with angles (s).
        heard_s: f64,
        pub listened_s: f64,
        /// Angles, how many of them are independent, and after which way each radio head had its last such one (m).
        angles: u32,
        independent: u32,
        independent_m: Vec<f64>,
    }
}

impl RelocalizationTest {
    /// One that begins now.
    pub fn new(search: GaussianSum, ekf: &Ekf, may_mislead: bool) -> Self {
        let heads = search.heads().len();
        Self {
            search,
            reported_s: ekf.time_s(),
            refutes: false,
            may_mislead,
            of_filter: 0.0,
            since_m: ekf.driven_m(),
            way_m: 0.0,
            heard_s: f64::NEG_INFINITY,
            listened_s: 0.0,
            angles: 0,
            independent: 0,
            independent_m: vec![f64::NEG_INFINITY; heads],
        }
    }

    /// Takes in an angle, before the filter does.
    pub fn update(&mut self, ekf: &Ekf, head: &RadioHead, measured: &AngleMeasurement) {
        self.way_m = ekf.driven_m() - self.since_m;
        let silence_s = measured.time_s - self.heard_s;
        if silence_s < SILENCE_S {
            self.listened_s += silence_s.max(0.0);
        }
        self.heard_s = measured.time_s;
        let is_it = |mine: &RadioHead| mine.sends(head.pci, head.ssb_index);
        let number = self.search.heads().iter().position(is_it);
        if let Some(last_m) = number.and_then(|number| self.independent_m.get_mut(number)) {
            self.angles = self.angles.saturating_add(1);
            if self.way_m - *last_m >= INDEPENDENT_M {
                *last_m = self.way_m;
                self.independent = self.independent.saturating_add(1);
            }
        }
        self.of_filter += log_likelihood(ekf, &ekf.predict_measurement(head, measured));
        self.search.update(head, measured);
    }

    /// Greater where the angles are certainly likelier at the search's best place, less where they are at the
    /// filter's. A filter that is only to be confirmed, or whose angles may mislead, is compared by independent
    /// angles.
    pub fn compare(&self, is_confirming: bool) -> Ordering {
        let mut ratio = self.search.best() - self.of_filter;
        if is_confirming || self.may_mislead {
            ratio = ratio * f64::from(self.independent) / f64::from(self.angles.max(1));
        }
        if ratio > CERTAIN {
            Ordering::Greater
        } else if ratio < -CERTAIN {
            Ordering::Less
        } else {
            Ordering::Equal
        }
    }

    /// The least way to be driven before a find is believed (m).
    pub const fn least_way_m(&self) -> f64 {
        if self.may_mislead {
            INDEPENDENT_M
        } else {
            LEAST_WAY_M
        }
    }

    /// It is reported from the newest odometry on, and begins to be patient anew.
    pub const fn report(&mut self, odometry_s: f64) {
        (self.reported_s, self.listened_s) = (odometry_s, 0.0);
    }
}
