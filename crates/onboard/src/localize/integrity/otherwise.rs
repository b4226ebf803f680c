//! What may be otherwise than stated, radio heads apart, and who is right then.

use super::alternative::Alternative;
use super::evidence::Evidence;
use super::slip::Slip;
use crate::clone_in_place::clone_in_place;
use crate::localize::measurement::{AngleMeasurement, UpdateReason, UpdateVerdict};
use crate::localize::tracker::{Look, Tracker};
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;
use crate::settings::FaultProbability;

/// How many times as probable as what is stated something else must be to lead: about as probable, one takes
/// turns with the other.
const LEAST_ODDS: f64 = 10.0;

/// And to be sure that the array is not exact.
const SURE_ODDS: f64 = 100.0;

/// Trackers that believe otherwise than the one beside which they run.
#[derive(Debug)]
pub(super) struct Otherwise {
    probability: FaultProbability,
    /// The odometer slips.
    slip: Slip,
    /// The array is not exact.
    array: Option<Alternative>,
    /// The odometer is noisier.
    noise: Option<Alternative>,
    /// The site plan is off as a whole.
    datum: Option<Alternative>,
    /// The angles are noisier.
    loud: Option<Alternative>,
    /// Errors of the angles stay over metres.
    multipath: Option<Alternative>,
}

clone_in_place!(Otherwise {
    probability,
    slip,
    array,
    noise,
    datum,
    loud,
    multipath
});

impl Otherwise {
    /// Beside a tracker that trusts what is stated, or the one itself that finds errors that stay.
    pub fn new(tracker: &Tracker, probability: FaultProbability) -> Self {
        let stated = tracker.as_stated();
        Self {
            probability,
            slip: Slip::new(&stated, probability.odometer),
            array: Alternative::inexact(&stated),
            noise: Alternative::noisier(&stated, probability.odometer),
            datum: Alternative::displaced(&stated, probability.all_radio_heads),
            loud: Alternative::loud(&stated),
            multipath: Alternative::multipath(tracker),
        }
    }

    /// The same beside another tracker; who expects errors that stay goes on, without what spoke against this one.
    pub fn beside(&self, tracker: &Tracker) -> Self {
        let mut multipath = self.multipath.clone();
        if let Some(multipath) = &mut multipath {
            multipath.forget();
        }
        Self {
            multipath,
            ..Self::new(tracker, self.probability)
        }
    }

    /// The same beside the tracker of an array that is not exact: as probable as it was beside that one before, a noisier
    /// odometer and noisier angles begun anew, and slip unless it was likely.
    pub fn beside_inexact(&self) -> Self {
        let mut beside = self.clone();
        if let Some(array) = beside.array.take() {
            for it in beside.all_mut() {
                it.evidence = it.evidence.beside(array.evidence);
            }
            beside.loud = Alternative::loud(&array.tracker);
            beside.noise = Alternative::noisier(&array.tracker, self.probability.odometer);
            if beside.slip.alternative.evidence.is_against() {
                beside.slip = Slip::new(&array.tracker, self.probability.odometer);
            }
        }
        beside
    }

    fn all(&self) -> impl Iterator<Item = &Alternative> + Clone {
        let slip = std::iter::once(&self.slip.alternative);
        (slip.chain(&self.array).chain(&self.noise))
            .chain((self.datum.iter().chain(&self.loud)).chain(&self.multipath))
    }

    fn all_mut(&mut self) -> impl Iterator<Item = &mut Alternative> {
        let slip = std::iter::once(&mut self.slip.alternative);
        (slip.chain(&mut self.array).chain(&mut self.noise))
            .chain((self.datum.iter_mut().chain(&mut self.loud)).chain(&mut self.multipath))
    }

    /// How many times as probable each of it is as that all is as stated, and the tracker that is right then.
    pub fn odds(&self) -> impl Iterator<Item = (f64, &Tracker)> + Clone {
        self.all().map(|it| (it.odds(), &it.tracker))
    }

    /// What is clearly more probable than that all is as stated. Where errors that stay are usual they explain the
    /// same, and nobody leads.
    fn leading(&self) -> Option<&Alternative> {
        let is_usual = self.slip.alternative.tracker.config().finds_errors();
        let most = (self.all()).max_by(|one, other| one.odds().total_cmp(&other.odds()));
        most.filter(|it| it.odds() > LEAST_ODDS && !is_usual)
    }

    /// The tracker that is right then.
    pub fn leader(&self) -> Option<&Tracker> {
        self.leading().map(|it| &it.tracker)
    }

    fn leads(&self, alternative: &Alternative) -> bool {
        self.leading()
            .is_some_and(|it| std::ptr::eq(it, alternative))
    }

    /// Whether errors that stay explain the angles clearly better than what is stated does, whatever explains them
    /// best.
    pub fn errors_stay(&self) -> bool {
        (self.multipath.as_ref()).is_some_and(|it| it.odds() > LEAST_ODDS)
    }

    /// Whether something is at fault, as far as is known.
    pub fn is_fault(&self) -> bool {
        self.leading().is_some_and(|it| it.is_fault)
    }

    /// The odds of all that may be, that all is as stated among them.
    pub fn total_odds(&self) -> f64 {
        1.0 + self.odds().map(|(odds, _)| odds).sum::<f64>()
    }

    /// Probability that nothing of it is at fault.
    pub fn trusted(&self) -> f64 {
        let faults: f64 = (self.all().filter(|it| it.is_fault))
            .map(Alternative::odds)
            .sum();
        1.0 - faults / self.total_odds()
    }

    /// The tracker of an array that is not exact, once that is sure.
    pub fn inexact(&self) -> Option<&Tracker> {
        let array = self.array.as_ref()?;
        (array.odds() > SURE_ODDS && self.leads(array)).then_some(&array.tracker)
    }

    /// Moves on by an odometry sample, by which the tracker `stated` has moved on.
    pub fn odometry(&mut self, stated: &Tracker, sample: &OdometrySample) {
        for alternative in self.all_mut() {
            alternative.tracker.odometry(sample);
        }
        self.slip.watch(stated, sample);
    }

    /// Takes in an angle, which the tracker `stated` foretells so, where angles are heard to have so many times the
    /// variance that is stated; what became of it, where errors stay.
    pub fn update(
        &mut self,
        stated: &Tracker,
        looked: &Result<Look, UpdateReason>,
        noise_ratio: f64,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> Option<UpdateVerdict> {
        if let Some(loud) = &mut self.loud {
            loud.tracker.hear_noise(Some(noise_ratio));
        }
        let mut verdict = None;
        for alternative in self.all_mut() {
            verdict = Some(alternative.update(stated, looked, head, measured));
        }
        let most = (self.all()).fold(Evidence::NONE, |most, it| most.or_more(it.evidence));
        for alternative in self.all_mut() {
            alternative.evidence.beside_most(most);
        }
        // Who finds errors that stay comes last.
        verdict.filter(|_| self.errors_stay())
    }

    /// Leaves a radio head out, as `stated` does, that has never heard it: slip is what it was; a plan that is off is
    /// no reason to, and explains the same; nor are errors that stay, which spoke against another tracker.
    pub fn exclude(&mut self, stated: &Tracker, head: &RadioHead) {
        let mut slip = self.slip.clone();
        slip.alternative.tracker.set_excluded(head, true);
        *self = Self {
            slip,
            datum: self.datum.take(),
            ..self.beside(stated)
        };
    }

    /// Uses a radio head again.
    pub fn readmit(&mut self, head: &RadioHead) {
        for alternative in self.all_mut() {
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
    use crate::localize::tracker::state::{ALONG, DATUM};

    /// What is otherwise than stated.
    #[derive(Default)]
    struct World {
        /// The array is turned by so much (rad).
        turned_rad: f64,
        /// All radio heads stand so far off (m).
        moved_m: [f64; 2],
        /// The odometer reads so much more, as a share.
        scale: f64,
        /// The angles have so many times the variance that is stated besides their own ...
        noise: f64,
        /// ... and are heard to have so many times more than that.
        heard_noise: f64,
    }

    /// A minute past four radio heads in this world, whose angles are off by `off_rad` after so many metres: what is
    /// believed otherwise then, the tracker as stated, and how far off the one is that leads.
    fn drive(world: &World, off_rad: impl Fn(usize, f64) -> f64) -> (Otherwise, Tracker, f64) {
        let (heads, road, mut stated) = trip();
        let mut otherwise = Otherwise::new(&stated, FaultProbability::default());
        let mut noise = ChaCha8Rng::seed_from_u64(1);
        let mut truth = road.pose(0.0);
        for step in 1..600 {
            let time_s = f64::from(step) * 0.1;
            let way_m = 4.0 * time_s;
            let odometry = OdometrySample {
                time_s,
                distance_m: way_m * (1.0 + world.scale),
                speed_mps: 4.0,
                yaw_rate_radps: None,
            };
            stated.odometry(&odometry);
            otherwise.odometry(&stated, &odometry);
            truth = road.pose(way_m);
            for (number, head) in heads.iter().enumerate() {
                let place = head.position.moved(world.moved_m);
                let bearing_rad = truth.point().bearing_rad(place) - truth.heading_rad;
                let phase_rad = PI * (bearing_rad - world.turned_rad).cos();
                let exact = angle(time_s, phase_rad);
                let seen = stated
                    .look(head, &exact)
                    .map(|it| stated.first_variance(&it));
                let variance = SIGMA_RAD * SIGMA_RAD + world.noise * seen.unwrap_or(0.0);
                let own_rad = variance.sqrt() * noise.sample::<f64, _>(StandardNormal);
                let measured = angle(time_s, phase_rad + off_rad(number, way_m) + own_rad);
                let looked = stated.look(head, &measured);
                otherwise.update(&stated, &looked, 1.0 + world.heard_noise, head, &measured);
                stated.take(looked, &measured);
            }
        }
        let leader = otherwise.leader().unwrap_or(&stated);
        let off_m = leader.pose(59.9).pose.point().distance_m(truth.point());
        (otherwise, stated, off_m)
    }

    #[test]
    fn nothing_is_otherwise_where_all_is_as_stated() {
        let (otherwise, stated, off_m) = drive(&World::default(), |_, _| 0.0);
        assert!(otherwise.leader().is_none() && off_m < 0.3, "{off_m}");
        assert!(otherwise.odds().all(|(odds, _)| odds < 0.1));
        // Angles that are heard to be no noisier are as stated.
        let loud = otherwise.loud.as_ref().unwrap();
        assert_eq!(loud.tracker.belief(), stated.belief());
        assert!(!stated.odometer_departs());
    }

    #[test]
    fn a_turned_array_is_found_and_no_fault() {
        let world = World {
            turned_rad: 0.02,
            ..World::default()
        };
        let (otherwise, _, off_m) = drive(&world, |_, _| 0.0);
        assert!(otherwise.inexact().is_some() && !otherwise.is_fault());
        assert!(off_m < 0.3, "{off_m}");
        // Beside the tracker of such an array all is as stated.
        let beside = otherwise.beside_inexact();
        assert!(beside.leader().is_none() && beside.array.is_none());
    }

    #[test]
    fn a_site_plan_that_is_off_as_a_whole_is_found_and_a_fault() {
        let world = World {
            moved_m: [1.2, -1.6],
            ..World::default()
        };
        let (mut otherwise, stated, off_m) = drive(&world, |_, _| 0.0);
        let datum = otherwise.datum.as_ref().unwrap();
        assert!(otherwise.leads(datum) && otherwise.is_fault());
        let [[xx, ..], [_, yy, _], _] = datum.tracker.pose(59.9).covariance.unwrap();
        assert!(off_m < 3.0 * (xx + yy).sqrt(), "{off_m}");
        let found = datum.tracker.belief();
        for (state, moved_m) in DATUM.into_iter().zip(world.moved_m) {
            let by_m = found.mean[state] - moved_m;
            let std_m = found.covariance[state][state].sqrt();
            assert!(std_m < 0.3 && by_m.abs() < 4.0 * std_m, "{by_m} of {std_m}");
        }
        // Of a radio head that is left out the plan says nothing.
        let before = *datum.tracker.belief();
        let (heads, ..) = trip();
        otherwise.exclude(&stated, &heads[0]);
        let datum = otherwise.datum.as_ref().unwrap();
        assert!(otherwise.leads(datum) && *datum.tracker.belief() == before);
    }

    #[test]
    fn angles_that_are_noisier_are_found_and_no_fault() {
        let world = World {
            noise: 3.0,
            heard_noise: 2.2,
            ..World::default()
        };
        let (otherwise, stated, off_m) = drive(&world, |_, _| 0.0);
        let loud = otherwise.loud.as_ref().unwrap();
        let odds: Vec<f64> = otherwise.all().map(Alternative::odds).collect();
        assert!(otherwise.leads(loud) && !otherwise.is_fault(), "{odds:?}");
        let variance = |tracker: &Tracker| tracker.belief().covariance[ALONG][ALONG];
        assert!(variance(&loud.tracker) > 2.0 * variance(&stated));
        assert!(off_m < 4.0 * variance(&loud.tracker).sqrt(), "{off_m}");
    }

    #[test]
    fn an_odometer_that_is_noisier_leaves_nine_times_its_variance() {
        let (_, _, mut stated) = trip();
        let mut otherwise = Otherwise::new(&stated, FaultProbability::default());
        for step in 0..=100 {
            let odometry = OdometrySample {
                time_s: f64::from(step) * 0.1,
                distance_m: f64::from(step) * 0.4,
                speed_mps: 4.0,
                yaw_rate_radps: None,
            };
            stated.odometry(&odometry);
            otherwise.odometry(&stated, &odometry);
        }
        let own_variance = 40.0 * stated.config().noise.odometer_m_per_sqrt_m.powi(2);
        let variance = |tracker: &Tracker| tracker.belief().covariance[ALONG][ALONG];
        let noise = otherwise.noise.as_ref().unwrap();
        let more = variance(&noise.tracker) - variance(&stated);
        assert!((more / (8.0 * own_variance) - 1.0).abs() < 0.01, "{more}");
        assert!(!noise.is_fault);
    }

    #[test]
    fn an_odometer_far_beyond_its_scale_departs() {
        let (_, _, stated) = trip();
        for (deviations, departs) in [(1.0, false), (20.0, true)] {
            let scale = deviations * stated.config().odometer_scale_std;
            let world = World {
                scale,
                ..World::default()
            };
            let (_, stated, _) = drive(&world, |_, _| 0.0);
            assert_eq!(stated.odometer_departs(), departs, "{deviations}");
        }
    }

    #[test]
    fn errors_that_stay_lead_and_are_a_fault() {
        // Of each radio head another one every three metres, as reflections make it.
        let error_rad = |head: usize, way_m: f64| {
            let number = (way_m / 3.0).floor() as u64 * 4 + head as u64;
            0.3 * ChaCha8Rng::seed_from_u64(number).sample::<f64, _>(StandardNormal)
        };
        // What differs from stretch to stretch may be heard as noise.
        for heard_noise in [0.0, 10.0] {
            let world = World {
                heard_noise,
                ..World::default()
            };
            let (otherwise, _, off_m) = drive(&world, error_rad);
            assert!(otherwise.errors_stay() && otherwise.is_fault());
            assert!(off_m < 1.0, "{off_m}");
        }
    }
}
