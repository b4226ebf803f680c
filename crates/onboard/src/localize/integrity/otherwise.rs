//! What may be otherwise than stated, radio heads apart, and who is right then.

use super::alternative::Alternative;
use super::slip::Slip;
use crate::clone_in_place::clone_in_place;
use crate::localize::measurement::{AngleMeasurement, UpdateReason, UpdateVerdict};
use crate::localize::tracker::{Look, Tracker};
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// How many times as probable as what is stated something else must be to lead: about as probable, one takes
/// turns with the other.
const LEAST_ODDS: f64 = 10.0;

/// And to be sure that the array is not exact.
const SURE_ODDS: f64 = 100.0;

/// Trackers that believe otherwise than the one beside which they run.
#[derive(Debug)]
pub(super) struct Otherwise {
    /// The odometer slips.
    slip: Slip,
    /// The array is not exact.
    inexact: Option<Alternative>,
    /// Errors of the angles stay over metres.
    multipath: Option<Alternative>,
}

clone_in_place!(Otherwise {
    slip,
    inexact,
    multipath
});

impl Otherwise {
    /// Beside a tracker that trusts what is stated, or the one itself that finds errors that stay; the odometer slips
    /// with this probability whenever the vehicle sets off.
    pub fn new(tracker: &Tracker, slips: f64) -> Self {
        let stated = tracker.as_stated();
        Self {
            slip: Slip::new(&stated, slips),
            inexact: Alternative::inexact(&stated),
            multipath: Alternative::multipath(tracker),
        }
    }

    /// The same beside another tracker.
    pub fn anew(&self, tracker: &Tracker) -> Self {
        Self::new(tracker, self.slip.alternative.prior)
    }

    /// The same, but who expects errors that stay goes on.
    pub fn beside(&self, tracker: &Tracker) -> Self {
        let mut multipath = self.multipath.clone();
        if let Some(multipath) = &mut multipath {
            multipath.forget();
        }
        Self {
            multipath,
            ..self.anew(tracker)
        }
    }

    /// How many times as probable each of it is as that all is as stated, and the tracker that is right then.
    pub fn odds(&self) -> impl Iterator<Item = (f64, &Tracker)> + Clone {
        let all = [&self.slip.alternative].into_iter();
        let all = all.chain(&self.inexact).chain(&self.multipath);
        all.map(|it| (it.odds(), &it.tracker))
    }

    /// The tracker that is right, if something is clearly more probable than that all is as stated. Where errors that
    /// stay are usual they explain the same, and nobody leads.
    pub fn leader(&self) -> Option<&Tracker> {
        let is_usual = self.slip.alternative.tracker.config().finds_errors();
        let likely = self
            .odds()
            .filter(|(odds, _)| *odds > LEAST_ODDS && !is_usual);
        let most = likely.max_by(|(one, _), (other, _)| one.total_cmp(other));
        most.map(|(_, tracker)| tracker)
    }

    fn leads(&self, tracker: &Tracker) -> bool {
        self.leader().is_some_and(|it| std::ptr::eq(it, tracker))
    }

    /// Whether errors stay, as far as is known.
    pub fn errors_stay(&self) -> bool {
        (self.multipath.as_ref()).is_some_and(|it| self.leads(&it.tracker))
    }

    /// Whether errors stay or the odometer slips, as far as is known.
    pub fn is_fault(&self) -> bool {
        self.errors_stay() || self.leads(&self.slip.alternative.tracker)
    }

    /// The odds of all that may be, that all is as stated among them.
    pub fn total_odds(&self) -> f64 {
        1.0 + self.odds().map(|(odds, _)| odds).sum::<f64>()
    }

    /// Probability that the odometer does not slip and errors do not stay.
    pub fn trusted(&self) -> f64 {
        let inexact = self.inexact.as_ref().map_or(0.0, Alternative::odds);
        (1.0 + inexact) / self.total_odds()
    }

    /// The tracker of an array that is not exact, once that is sure.
    pub fn inexact(&self) -> Option<&Tracker> {
        let inexact = self.inexact.as_ref()?;
        (inexact.odds() > SURE_ODDS && self.leads(&inexact.tracker)).then_some(&inexact.tracker)
    }

    /// Moves on by an odometry sample, by which the tracker `stated` has moved on.
    pub fn odometry(&mut self, stated: &Tracker, sample: &OdometrySample) {
        self.slip.odometry(stated, sample);
        for alternative in self.inexact.iter_mut().chain(&mut self.multipath) {
            alternative.odometry(sample);
        }
    }

    /// Takes in an angle, which the tracker `stated` foretells so; what became of it, where errors stay.
    pub fn update(
        &mut self,
        stated: &Tracker,
        looked: &Result<Look, UpdateReason>,
        noise_ratio: f64,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Option<UpdateVerdict> {
        for alternative in [&mut self.slip.alternative]
            .into_iter()
            .chain(&mut self.inexact)
        {
            alternative.update(stated, looked, noise_ratio, head, measured);
        }
        let multipath = self.multipath.as_mut()?;
        let verdict = multipath.update(stated, looked, noise_ratio, head, measured);
        self.errors_stay().then_some(verdict)
    }

    /// Leaves a radio head out, as `stated` does, that has never heard it. Errors that stay are no reason to.
    pub fn exclude(&mut self, stated: &Tracker, head: &RadioHead) {
        self.slip.alternative.tracker.set_excluded(head, true);
        self.inexact = Alternative::inexact(stated);
        if let Some(multipath) = &mut self.multipath {
            multipath.forget(); // it spoke against another tracker
        }
    }

    /// Uses a radio head again.
    pub fn readmit(&mut self, head: &RadioHead) {
        for alternative in [&mut self.slip.alternative]
            .into_iter()
            .chain(&mut self.inexact)
        {
            alternative.tracker.set_excluded(head, false);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::localize::integrity::trip::{SIGMA_RAD, angle, trip};

    /// A minute past four radio heads, whose bearings are off by `turned_rad` and the angles by `off_rad` after so
    /// many metres: what is believed otherwise then, and how far off the tracker is that leads.
    fn drive(turned_rad: f64, off_rad: impl Fn(usize, f64) -> f64) -> (Otherwise, f64) {
        let (heads, road, mut stated) = trip();
        let mut otherwise = Otherwise::new(&stated, 1e-3);
        let mut noise = ChaCha8Rng::seed_from_u64(1);
        let mut truth = road.pose(0.0);
        for step in 1..600 {
            let time_s = f64::from(step) * 0.1;
            let way_m = 4.0 * time_s;
            let odometry = OdometrySample {
                time_s,
                distance_m: way_m,
                speed_mps: 4.0,
                yaw_rate_radps: None,
            };
            stated.odometry(&odometry);
            otherwise.odometry(&stated, &odometry);
            truth = road.pose(way_m);
            for (number, head) in heads.iter().enumerate() {
                let bearing_rad = truth.point().bearing_rad(head.position) - truth.heading_rad;
                let own_rad = SIGMA_RAD * noise.sample::<f64, _>(StandardNormal);
                let phase_rad = PI * (bearing_rad - turned_rad).cos();
                let measured = angle(time_s, phase_rad + off_rad(number, way_m) + own_rad);
                let looked = stated.look(head, &measured);
                otherwise.update(&stated, &looked, 1.0, head, &measured);
                stated.take(looked, &measured);
            }
        }
        let leader = otherwise.leader().unwrap_or(&stated);
        let off_m = leader.pose(59.9).pose.point().distance_m(truth.point());
        (otherwise, off_m)
    }

    #[test]
    fn nothing_is_otherwise_where_all_is_as_stated() {
        let (otherwise, off_m) = drive(0.0, |_, _| 0.0);
        assert!(otherwise.leader().is_none() && off_m < 0.3, "{off_m}");
        assert!(otherwise.odds().all(|(odds, _)| odds < 0.1));
    }

    #[test]
    fn a_turned_array_is_found_and_no_fault() {
        let (otherwise, off_m) = drive(0.02, |_, _| 0.0);
        assert!(otherwise.inexact().is_some() && !otherwise.is_fault());
        assert!(off_m < 0.3, "{off_m}");
    }

    #[test]
    fn errors_that_stay_lead_and_are_a_fault() {
        // Of each radio head another one every three metres, as reflections make it.
        let error_rad = |head: usize, way_m: f64| {
            let number = (way_m / 3.0).floor() as u64 * 4 + head as u64;
            0.3 * ChaCha8Rng::seed_from_u64(number).sample::<f64, _>(StandardNormal)
        };
        let (otherwise, off_m) = drive(0.0, error_rad);
        assert!(otherwise.errors_stay() && otherwise.is_fault());
        assert!(off_m < 1.0, "{off_m}");
    }
}
