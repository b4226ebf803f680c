//! A sequential probability ratio test (Wald 1945) between the place of a filter and the best place of a search beside
//! it.

use std::cmp::Ordering;

use super::gaussian_sum::GaussianSum;
use crate::clone_in_place::clone_in_place;
use crate::localize::ekf::Ekf;
use crate::localize::modes::{CERTAIN, log_likelihood, log_likelihood_as_stated};
use crate::observation::{AngleMeasurement, OdometrySample};
use crate::radio_head::RadioHead;

/// Way to be driven before a find is believed (m): a vehicle that stands hears the same errors again and again.
const LEAST_WAY_M: f64 = 0.5;

/// Angles of one radio head within this way share their errors: clusters keep an angle wrong for so long (m).
const INDEPENDENT_M: f64 = 10.0;

/// Probability that a start which is given is another one, anywhere about the radio heads: as that of a fault of a radio
/// head.
const WRONG_START: f64 = 0.01;

/// Longer silences do not count as time with angles (s).
const SILENCE_S: f64 = 1.0;

clone_in_place! {
    /// A search beside a filter, and the likelihoods of both.
    #[derive(Debug)]
    pub(super) struct RelocalizationTest {
        pub search: GaussianSum,
        /// The filter of a start that is given, as it is stated: what the bank's filters learn from angles that contradict
        /// them explains those away. None where the vehicle is lost later.
        given: Option<Box<Ekf>>,
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
            given: None,
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

    /// Of a start that is given, with a search wherever else it may be.
    pub fn of_start(search: GaussianSum, given: &Ekf) -> Self {
        Self {
            given: Some(Box::new(given.as_stated())),
            ..Self::new(search, given, false)
        }
    }

    /// Whether the search has found that the start is where it is said to be.
    pub fn confirms_start(&self) -> bool {
        (self.given.as_ref()).is_some_and(|given| self.search.is_at(given))
    }

    /// Whether the search of a given start has found the position of the filter that is reported.
    pub fn agrees_with(&self, reported: &Ekf) -> bool {
        self.is_of_start() && self.search.is_at(reported)
    }

    /// Whether it is of a start that is given.
    pub const fn is_of_start(&self) -> bool {
        self.given.is_some()
    }

    /// Moves all places.
    pub fn odometry(&mut self, sample: &OdometrySample) {
        if let Some(given) = &mut self.given {
            given.odometry(sample);
        }
        self.search.odometry(sample);
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
        if let Some(given) = &mut self.given {
            let predicted = given.predict_measurement(head, measured);
            self.of_filter += log_likelihood_as_stated(given, &predicted);
            given.update_predicted(predicted, measured);
        } else {
            self.of_filter += log_likelihood(ekf, &ekf.predict_measurement(head, measured));
        }
        self.search.update(head, measured);
        if let Some(given) = &mut self.given {
            self.search.teach(given);
        }
    }

    /// Greater where the angles are certainly likelier at the search's best place, less where they are at the
    /// filter's. A filter that is only to be confirmed, or whose angles may mislead, is compared by independent
    /// angles. A start that is given stands until it is refuted: less as soon as it is the more probable.
    pub fn compare(&self, is_confirming: bool) -> Ordering {
        let (ratio, less) = if self.is_of_start() {
            (self.log_odds(), 0.0)
        } else {
            let ratio = self.search.best() - self.of_filter;
            let share = if is_confirming || self.may_mislead {
                self.independent_share()
            } else {
                1.0
            };
            (ratio * share, -CERTAIN)
        };
        if ratio > CERTAIN {
            Ordering::Greater
        } else if ratio < less {
            Ordering::Less
        } else {
            Ordering::Equal
        }
    }

    /// Logarithm of the odds that the vehicle began elsewhere than given.
    fn log_odds(&self) -> f64 {
        (WRONG_START / (1.0 - WRONG_START)).ln() + self.against_start()
    }

    /// Log-likelihood ratio of all other places to the given start. A ratio for other places is tempered: it counts by
    /// independent angles, and by the misfit of the best place, so that angles that fit nowhere are no evidence.
    fn against_start(&self) -> f64 {
        let ratio = self.search.evidence() - self.of_filter;
        if ratio > 0.0 {
            ratio * self.independent_share() / self.misfit()
        } else {
            ratio
        }
    }

    /// Mean squared normalised residual of the angles at the best place of the search, at least 1.
    fn misfit(&self) -> f64 {
        (-2.0 * self.search.best() / f64::from(self.angles.max(1))).max(1.0)
    }

    fn independent_share(&self) -> f64 {
        f64::from(self.independent) / f64::from(self.angles.max(1))
    }

    /// Whether another start is more probable than the given one.
    pub fn doubts_start(&self) -> bool {
        self.is_of_start() && self.log_odds() > 0.0
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
