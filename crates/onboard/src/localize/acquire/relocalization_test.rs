//! Sequential probability ratio test (Wald 1945) between the position of a filter and the best
//! position of a parallel search.

use std::cmp::Ordering;

use super::gaussian_sum::GaussianSum;
use crate::clone_in_place::clone_in_place;
use crate::localize::bias::VALUE_M;
use crate::localize::ekf::Ekf;
use crate::localize::modes::{CERTAIN, EVENT_EPOCHS, EVENT_S};
use crate::localize::output::PoseEstimate;
use crate::observation::{AngleMeasurement, OdometrySample};
use crate::radio_head::RadioHead;

/// Minimum distance driven before a result of the search is accepted (m): at standstill, the same
/// errors repeat.
const MIN_DRIVEN_M: f64 = 0.5;

/// Distance to the last angle of a radio head below which an angle of a vehicle that stands at its
/// start repeats it (m): an assumption, above the noise of an odometer at standstill and below the
/// distance between SSBs of a slow vehicle.
const SAME_PLACE_M: f64 = 0.02;

/// Number of coordinates of a pose: position and heading.
const COORDINATES: f64 = 3.0;

/// Distance within which angles of one radio head are dependent (m): the multipath bias is then
/// retained with a probability of 5 %.
const INDEPENDENT_M: f64 = 3.0 * VALUE_M;

/// Maximum duration of a search with angles and without a result (s).
pub(super) const PATIENCE_S: f64 = EVENT_S;

/// Maximum interval between angles that counts as time with angles (s).
const SILENCE_S: f64 = 1.0;

clone_in_place! {
    /// Parallel search, with the log-likelihoods of search and filter.
    #[derive(Debug)]
    pub(super) struct RelocalizationTest {
        pub search: GaussianSum,
        /// Hypothesis at the given start. The filters of the solution would explain contradicting
        /// angles by biases and noise that they have learned. `None` if the vehicle was lost later:
        /// in strong multipath, a hypothesis without that knowledge is not distinguished from its
        /// neighbours.
        given: Option<Box<Ekf>>,
        /// Time of the newest odometry when the search was first reported (s).
        pub reported_s: f64,
        /// Whether the filter is refuted, so that its position is no longer part of the reported
        /// covariance.
        pub refutes: bool,
        /// Whether the selected hypothesis explains contradicting angles without a lost vehicle.
        may_explain_contradictions: bool,
        /// Prior log odds that the given start is wrong, and that the vehicle is anywhere in the area
        /// of the radio heads.
        prior_log_odds: f64,
        /// Log odds of other starts below which the given start is confirmed: the log odds of the
        /// integrity risk.
        confirmed_at: f64,
        /// Log odds of another start to the given start.
        log_odds: f64,
        /// Log-likelihood of the angles for the filter.
        of_filter: f64,
        /// Distance driven at the start of the search (m).
        since_m: f64,
        /// Distance driven since the start of the search (m).
        pub driven_m: f64,
        /// Time of the last angle (s).
        received_s: f64,
        /// Time with angles since the start of the search, or since it was reported (s).
        pub listened_s: f64,
        /// Number of angles.
        angles: u32,
        /// Number of independent angles.
        independent: u32,
        /// Distances driven at the last angles of each radio head.
        last: Vec<LastAngles>,
    }
}

/// Distances driven at the last angles of a radio head (m); infinite before the first one.
#[derive(Clone, Copy, Debug)]
struct LastAngles {
    used_m: f64,
    independent_m: f64,
}

impl Default for LastAngles {
    fn default() -> Self {
        Self {
            used_m: f64::NEG_INFINITY,
            independent_m: f64::NEG_INFINITY,
        }
    }
}

impl RelocalizationTest {
    /// Creates a test that starts now.
    pub fn new(search: GaussianSum, ekf: &Ekf, may_explain_contradictions: bool) -> Self {
        let heads = search.heads().len();
        Self {
            search,
            given: None,
            reported_s: ekf.time_s(),
            refutes: false,
            may_explain_contradictions,
            prior_log_odds: f64::NEG_INFINITY,
            confirmed_at: f64::NEG_INFINITY,
            log_odds: f64::NEG_INFINITY,
            of_filter: 0.0,
            since_m: ekf.driven_m(),
            driven_m: 0.0,
            received_s: f64::NEG_INFINITY,
            listened_s: 0.0,
            angles: 0,
            independent: 0,
            last: vec![LastAngles::default(); heads],
        }
    }

    /// Creates the test of a given start against a search everywhere else.
    pub fn of_start(search: GaussianSum, given: &Ekf, wrong_start: f64, risk: f64) -> Self {
        let [prior_log_odds, confirmed_at] =
            [wrong_start, risk].map(|probability| (probability / (1.0 - probability)).ln());
        Self {
            given: Some(Box::new(search.hypothesis_at(given))),
            prior_log_odds,
            confirmed_at,
            log_odds: prior_log_odds,
            ..Self::new(search, given, false)
        }
    }

    /// Whether the filter of the given start and the search have reached one position.
    pub fn is_merged(&self) -> bool {
        (self.given.as_ref()).is_some_and(|given| self.search.is_at(given))
    }

    /// Returns the other positions of the search, each with its probability per independent epoch: a wrong
    /// start is one error for several epochs, and counts once against the integrity risk.
    pub fn other_starts(&self, time_s: f64) -> impl Iterator<Item = (f64, PoseEstimate)> {
        let odds = self.log_odds.exp();
        let probability = odds / (1.0 + odds) / EVENT_EPOCHS;
        let given = self.given.iter();
        let components = given.flat_map(move |it| self.search.components_elsewhere(it, time_s));
        components.map(move |(weight, pose)| (probability * weight, pose))
    }

    /// Whether the search of a given start has found the reported position.
    pub fn agrees_with(&self, reported: &Ekf) -> bool {
        self.is_of_start() && self.search.is_at(reported)
    }

    /// Whether the test is that of a given start.
    pub const fn is_of_start(&self) -> bool {
        self.given.is_some()
    }

    /// Predicts all hypotheses.
    pub fn odometry(&mut self, sample: &OdometrySample) {
        if let Some(given) = &mut self.given {
            given.odometry(sample);
        }
        self.search.odometry(sample);
    }

    /// Processes an angle, before the filter does.
    pub fn update(&mut self, ekf: &Ekf, head: &RadioHead, measured: &AngleMeasurement) {
        self.driven_m = ekf.driven_m() - self.since_m;
        let silence_s = measured.time_s - self.received_s;
        if silence_s < SILENCE_S {
            self.listened_s += silence_s.max(0.0);
        }
        self.received_s = measured.time_s;
        // Search and filter are compared with the same angles.
        if !self.search.is_due(head, measured.time_s) {
            return;
        }
        let number = head.number_in(self.search.heads());
        if let Some(last) = number.and_then(|number| self.last.get_mut(number)) {
            // The angles of a standing vehicle have one error. Its weight would not decrease while
            // the vehicle drives.
            let stands = self.driven_m < MIN_DRIVEN_M;
            if stands && self.given.is_some() && self.driven_m - last.used_m < SAME_PLACE_M {
                return;
            }
            last.used_m = self.driven_m;
            self.angles = self.angles.saturating_add(1);
            if self.driven_m - last.independent_m >= INDEPENDENT_M {
                last.independent_m = self.driven_m;
                self.independent = self.independent.saturating_add(1);
            }
        }
        let log_likelihood = self.search.log_likelihood();
        if let Some(given) = &mut self.given {
            let predicted = given.predict_measurement(head, measured);
            self.of_filter += log_likelihood(given, &predicted);
            given.update_predicted(predicted, measured);
        } else {
            self.of_filter += log_likelihood(ekf, &ekf.predict_measurement(head, measured));
        }
        self.search.update(head, measured);
        if let Some(given) = &mut self.given {
            self.search.copy_noise_model_to(given);
        }
        if let Some(given) = &self.given {
            self.log_odds = self.log_odds_against(given);
        }
    }

    /// Returns `Greater` if the angles are with certainty more probable at the best position of the
    /// search, `Less` if they are at that of the filter. Independent angles are compared if the
    /// filter is only to be confirmed, or its hypothesis may mislead. For a given start, the result is
    /// `Greater` once given start and search together have a small covariance at the search's
    /// position, and `Less` once the probability of another start is below the integrity risk.
    pub fn compare(&self, is_confirming: bool) -> Ordering {
        let (ratio, less, greater) = if let Some(given) = &self.given {
            let greater = self.search.odds_to_neglect(given).ln();
            (self.log_odds, self.confirmed_at, greater)
        } else {
            let ratio = self.search.best() - self.of_filter;
            let share = if is_confirming || self.may_explain_contradictions {
                self.information_fraction()
            } else {
                1.0
            };
            (ratio * share, -CERTAIN, CERTAIN)
        };
        if ratio > greater {
            Ordering::Greater
        } else if ratio < less {
            Ordering::Less
        } else {
            Ordering::Equal
        }
    }

    /// Returns the log odds of another start to the given start, with the specified prior. A
    /// log-likelihood ratio in favour of other positions is reduced to the number of independent
    /// angles, and divided by the misfit of the best position, so that angles without any consistent
    /// position are no evidence.
    fn log_odds_against(&self, given: &Ekf) -> f64 {
        let ratio = self.search.evidence_elsewhere(given) - self.of_filter;
        let share = if ratio > 0.0 {
            self.information_fraction() / self.misfit()
        } else {
            1.0
        };
        self.prior_log_odds + share * ratio
    }

    /// Returns the mean squared normalised residual at the best position of the search, at least 1. At standstill, it is
    /// the reduced χ², because a pose explains as many angles as it has coordinates, whatever their errors.
    fn misfit(&self) -> f64 {
        let mut degrees_of_freedom = f64::from(self.angles.max(1));
        if self.driven_m < MIN_DRIVEN_M {
            degrees_of_freedom *= 1.0 - COORDINATES / f64::from(self.independent.max(1));
        }
        if degrees_of_freedom > 0.0 {
            (-2.0 * self.search.best() / degrees_of_freedom).max(1.0)
        } else {
            f64::INFINITY
        }
    }

    fn information_fraction(&self) -> f64 {
        f64::from(self.independent) / f64::from(self.angles.max(1))
    }

    /// Whether another start is more probable than the given one.
    pub fn other_start_is_likelier(&self) -> bool {
        self.is_of_start() && self.log_odds > 0.0
    }

    /// Returns the minimum distance driven before a result is accepted (m).
    pub const fn min_driven_m(&self) -> f64 {
        if self.may_explain_contradictions {
            INDEPENDENT_M
        } else {
            MIN_DRIVEN_M
        }
    }

    /// Starts reporting the search at the newest odometry, and restarts its maximum duration.
    pub const fn report(&mut self, odometry_s: f64) {
        (self.reported_s, self.listened_s) = (odometry_s, 0.0);
    }
}
