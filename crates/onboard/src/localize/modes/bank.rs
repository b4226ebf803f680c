//! Trackers that do without some of the radio heads.
//!
//! Beside the filter of every sound radio head run one without each of them and one without each
//! two. If one radio head is at fault — seen round a corner, moved, spoofed — the filters without
//! it are not. Those without two tell which one it is: leave out the right one, and the others
//! agree with each other; leave out a wrong one, and the fault is still among them. And when a
//! radio head is excluded, filters that have never heard it are ready to take over, together with
//! those that have heard neither it nor one of the others.
//!
//! And what else may be otherwise than stated has filters of its own ([`FaultModes`]).

use super::config::IntegrityConfig;
use super::head_test::HeadTest;
use super::hypotheses::FaultModes;
use super::noise_ratio::NoiseRatio;
use crate::clone_in_place::clone_in_place;
use crate::localize::ekf::Ekf;
use crate::localize::measurement::{AngleMeasurement, OdometryVerdict, UpdateVerdict};
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// A filter without one or two radio heads, and the test of each against it.
#[derive(Debug)]
struct SubsetFilter {
    /// Numbers of the radio heads left out; the same twice where it is one.
    without: [usize; 2],
    tests: [HeadTest; 2],
    ekf: Ekf,
}

clone_in_place!(SubsetFilter {
    without,
    tests,
    ekf
});

impl SubsetFilter {
    fn lacks(&self, head: usize) -> bool {
        self.without.contains(&head)
    }

    fn test(&self, head: usize) -> HeadTest {
        let [first, second] = self.tests;
        if self.without[0] == head {
            first
        } else {
            second
        }
    }
}

/// The filters.
#[derive(Debug)]
pub(in crate::localize) struct Bank {
    heads: Vec<RadioHead>,
    faulty: Vec<bool>,
    /// When each of them last disagreed with the filter without it (s).
    disagreed_s: Vec<f64>,
    /// When it was lost last (s).
    lost_s: f64,
    main: Ekf,
    /// What may be otherwise than it believes.
    modes: FaultModes,
    noise: NoiseRatio,
    /// First those without one radio head, in order; then those without two.
    subsets: Vec<SubsetFilter>,
}

clone_in_place!(Bank {
    heads,
    faulty,
    disagreed_s,
    lost_s,
    main,
    modes,
    noise,
    subsets
});

impl Bank {
    /// The filters beside this one, and what may be otherwise than it believes; nothing is known of them at
    /// `now_s`.
    pub fn new(ekf: &Ekf, heads: &[RadioHead], modes: FaultModes, now_s: f64) -> Self {
        let ekf = ekf.nominal();
        let count = heads.len();
        let one = (0..count).map(|head| [head; 2]);
        // Which of two disagrees nobody can tell.
        let pairs = if count < 3 { 0 } else { count };
        let two =
            (0..pairs).flat_map(|first| (first + 1..pairs).map(move |second| [first, second]));
        let subset = |without: [usize; 2]| {
            let mut ekf = ekf.clone();
            for head in without {
                exclude(&mut ekf, heads.get(head), true);
            }
            SubsetFilter {
                without,
                tests: [HeadTest::default(); 2],
                ekf,
            }
        };
        Self {
            subsets: one.chain(two).map(subset).collect(),
            faulty: vec![false; count],
            disagreed_s: vec![f64::NEG_INFINITY; count],
            lost_s: now_s,
            heads: heads.to_vec(),
            modes,
            main: ekf,
            noise: NoiseRatio::new(count),
        }
    }

    /// The filter of every sound radio head.
    pub const fn main(&self) -> &Ekf {
        &self.main
    }

    /// The same begun anew from a vague pose, of which nothing is known at `now_s`.
    pub fn restarted(&self, position_std_m: f64, now_s: f64) -> Self {
        let start = self.leader().restarted(position_std_m);
        Self {
            noise: self.noise.resumed(),
            ..Self::new(&start, &self.heads, self.modes.beside(&start), now_s)
        }
    }

    /// The same of an array that is not exact, once that is sure and nothing else may be; nothing is known of
    /// it at `now_s`.
    pub fn of_inexact(&self, now_s: f64, config: &IntegrityConfig) -> Option<Self> {
        let uncalibrated = self.modes.uncalibrated()?;
        let is_quiet = self.faulty() == 0
            && self.worst_case(config.recovery_threshold) == 0
            && self.quiet_s(now_s) > config.recovery_s;
        is_quiet.then(|| Self {
            noise: self.noise.resumed(),
            ..Self::new(uncalibrated, &self.heads, self.modes.beside_inexact(), now_s)
        })
    }

    /// The filter that is most probably right: the one of every sound radio head, unless something is otherwise.
    pub fn leader(&self) -> &Ekf {
        self.modes.leader().unwrap_or(&self.main)
    }

    /// What may be otherwise than stated.
    pub const fn modes(&self) -> &FaultModes {
        &self.modes
    }

    /// What may be, how probable it is and the filter that is right then: all is as stated, or something is
    /// otherwise; or, as far as the odometer does not slip and errors do not stay, one
    /// or two of the sound radio heads are at fault, of which each has the probability `head`.
    pub fn suspects(&self, head: f64) -> impl Iterator<Item = (f64, &Ekf)> + Clone {
        let trusted = self.modes.trusted();
        let heads = (self.subsets.iter())
            .filter(|subset| !subset.without.iter().any(|&it| self.is_faulty(it)))
            .map(move |subset| {
                let [one, other] = subset.without;
                let both = if one == other { 1.0 } else { head };
                (trusted * head * both, &subset.ekf)
            });
        self.beliefs().chain(heads)
    }

    /// How probable it is that all is as stated, and that something is otherwise; and the filter that is right
    /// then.
    pub fn beliefs(&self) -> impl Iterator<Item = (f64, &Ekf)> + Clone {
        let total = self.modes.total_odds();
        let odds = std::iter::once((1.0, &self.main)).chain(self.modes.odds());
        odds.map(move |(odds, ekf)| (odds / total, ekf))
    }

    /// The filters without a radio head in doubt, one of which may take over soon.
    pub fn candidates(&self, config: &IntegrityConfig) -> impl Iterator<Item = &Ekf> {
        let worst_case = |head: &usize| self.statistic(*head) > config.recovery_threshold;
        let worst_case = self.sound().filter(worst_case);
        worst_case.filter_map(|head| Some(&self.subsets.get(head)?.ekf))
    }

    fn sound(&self) -> impl Iterator<Item = usize> + Clone {
        let faulty = self.faulty.iter().enumerate();
        faulty.filter_map(|(head, faulty)| (!faulty).then_some(head))
    }

    /// Number of radio heads found faulty.
    pub fn faulty(&self) -> usize {
        self.faulty.iter().filter(|faulty| **faulty).count()
    }

    fn is_faulty(&self, head: usize) -> bool {
        self.faulty.get(head).is_some_and(|faulty| *faulty)
    }

    /// By how much more variance the angles have than stated.
    pub const fn noise_ratio(&self) -> f64 {
        self.noise.ratio()
    }

    /// How far the angles of a radio head are off from the filter without it, in standard
    /// deviations.
    fn statistic(&self, head: usize) -> f64 {
        let test = self.subsets.get(head).map(|subset| subset.test(head));
        test.map_or(0.0, |test| self.deviations(head, &test))
    }

    /// The statistic of a test of a radio head, with the noise that there is.
    fn deviations(&self, head: usize, test: &HeadTest) -> f64 {
        test.statistic() / self.noise.ratio_of(head).sqrt()
    }

    /// Number of sound radio heads whose statistic is above a threshold.
    fn worst_case(&self, threshold: f64) -> usize {
        self.sound()
            .filter(|&head| self.statistic(head) > threshold)
            .count()
    }

    /// Moves every filter.
    pub fn odometry(&mut self, sample: &OdometrySample) -> OdometryVerdict {
        for subset in &mut self.subsets {
            subset.ekf.odometry(sample);
        }
        let verdict = self.main.odometry(sample);
        self.modes.odometry(&self.main, sample);
        verdict
    }

    /// Takes in an angle: a test of its radio head, and information for whoever uses that.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) -> UpdateVerdict {
        let is_it = |mine: &RadioHead| mine.sends(head.pci, head.ssb_index);
        let number = self.heads.iter().position(is_it);
        if let Some(number) = number {
            for subset in &mut self.subsets {
                if !subset.lacks(number) {
                    subset.ekf.update(head, measured);
                    continue;
                }
                let Some(seen) = subset.ekf.innovation_of_excluded(head, measured) else {
                    continue;
                };
                if subset.without == [number; 2] {
                    self.noise.see(number, &seen);
                }
                // While the vehicle stands, scatter is one look however often it is seen.
                if seen.innovation.measurement_variance < 1.0 {
                    for (mine, test) in subset.without.iter().zip(&mut subset.tests) {
                        if *mine == number {
                            test.push(&seen.innovation);
                        }
                    }
                }
            }
        }
        let noise_ratio = number.map_or(1.0, |number| self.noise.core_ratio_of(number));
        let predicted = self.main.predict_measurement(head, measured);
        let if_staying = (self.modes).update(&self.main, &predicted, noise_ratio, head, measured);
        let verdict = self.main.take(predicted, measured);
        if_staying.unwrap_or(verdict)
    }

    /// Whether a source is at fault and nobody knows which, or too many are.
    pub fn is_lost(&self, config: &IntegrityConfig) -> bool {
        self.worst_case(config.detection_threshold) > 0 || self.is_outvoted(config)
    }

    /// Whether half of several radio heads or more are at fault or in doubt.
    pub fn is_outvoted(&self, config: &IntegrityConfig) -> bool {
        let against = self.worst_case(config.detection_threshold) + self.faulty();
        against > 1 && 2 * against >= self.heads.len()
    }

    /// For how long it has not been lost (s).
    pub fn quiet_s(&self, now_s: f64) -> f64 {
        now_s - self.lost_s
    }

    /// Excludes the radio head that is at fault, where two others remain to agree without it, and
    /// readmits those that have come to agree again.
    pub fn judge(&mut self, now_s: f64, config: &IntegrityConfig) {
        for head in 0..self.heads.len() {
            let disagrees = self.statistic(head) > config.recovery_threshold;
            let Some(disagreed_s) = self.disagreed_s.get_mut(head) else {
                return;
            };
            if disagrees {
                *disagreed_s = now_s;
            } else if now_s - *disagreed_s > config.recovery_s && self.is_faulty(head) {
                self.readmit(head);
            }
        }
        // A wrong choice is itself a fault, and must be as rare as the risk under one.
        let odds = -2.0 * config.risk_under_fault().ln();
        if let Some(faulty_head) = self.faulty_head(config.detection_threshold, odds) {
            self.exclude(faulty_head);
        }
        if self.is_lost(config) {
            self.lost_s = now_s;
        }
    }

    /// The radio head that is at fault, if one is that much likelier to be it than any other:
    /// without it the largest statistic among the others falls below what it is without another by
    /// `odds`, in twice the logarithm of a likelihood ratio.
    fn faulty_head(&self, threshold: f64, odds: f64) -> Option<usize> {
        if self.sound().count() < 3 || self.worst_case(threshold) == 0 {
            return None;
        }
        let (mut best, mut second) = ((usize::MAX, f64::INFINITY), f64::INFINITY);
        for head in self.sound() {
            let disagreement = self.disagreement_without(head);
            if disagreement < best.1 {
                second = best.1;
                best = (head, disagreement);
            } else {
                second = second.min(disagreement);
            }
        }
        let (head, least) = best;
        let sure = second * second - least * least > odds;
        (sure && least < threshold && self.statistic(head) > threshold).then_some(head)
    }

    /// The largest statistic of a sound radio head when `left_out` is left out.
    fn disagreement_without(&self, left_out: usize) -> f64 {
        (self.subsets.iter())
            .filter(|subset| subset.without[0] != subset.without[1] && subset.lacks(left_out))
            .flat_map(|subset| subset.without.iter().zip(&subset.tests))
            .filter(|(head, _)| **head != left_out && !self.is_faulty(**head))
            .map(|(head, test)| self.deviations(*head, test))
            .fold(0.0, f64::max)
    }

    fn number_without(&self, first: usize, second: usize) -> Option<usize> {
        let (first, second) = (first.min(second), first.max(second));
        (self.subsets.iter()).position(|subset| subset.without == [first, second])
    }

    /// Leaves a radio head out everywhere, and with it what it has done.
    fn exclude(&mut self, faulty_head: usize) {
        let Some(faulty) = self.faulty.get_mut(faulty_head) else {
            return;
        };
        *faulty = true;
        if let Some(without) = self.subsets.get(faulty_head) {
            self.main = without.ekf.clone();
        }
        if let Some(known) = self.heads.get(faulty_head) {
            self.modes.exclude(&self.main, known);
        }
        for number in 0..self.subsets.len() {
            let Some([first, second]) = self.subsets.get(number).map(|subset| subset.without)
            else {
                return;
            };
            if first == faulty_head || second == faulty_head {
                continue;
            }
            // Without (first, culprit) it has not heard the culprit; of the second it is told now.
            let clean = [first, second].map(|head| {
                self.number_without(head, faulty_head)
                    .and_then(|i| self.subsets.get(i))
            });
            let [Some(of_first), Some(of_second)] = clean else {
                continue;
            };
            let tests = [of_first.test(first), of_second.test(second)];
            let mut ekf = of_first.ekf.clone();
            exclude(&mut ekf, self.heads.get(second), true);
            if let Some(subset) = self.subsets.get_mut(number) {
                subset.tests = tests;
                subset.ekf = ekf;
            }
        }
    }

    /// Uses a radio head again.
    fn readmit(&mut self, head: usize) {
        if let Some(faulty) = self.faulty.get_mut(head) {
            *faulty = false;
        }
        let known = self.heads.get(head);
        exclude(&mut self.main, known, false);
        if let Some(known) = known {
            self.modes.readmit(known);
        }
        for subset in self.subsets.iter_mut().filter(|subset| !subset.lacks(head)) {
            exclude(&mut subset.ekf, known, false);
        }
    }
}

fn exclude(ekf: &mut Ekf, head: Option<&RadioHead>, excluded: bool) {
    if let Some(head) = head {
        ekf.set_excluded(head, excluded);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::geometry::Pose;
    use crate::localize::ekf::EkfConfig;
    use crate::localize::pose_estimate::InitialPose;
    use crate::settings::{FaultProbability, Shipped, Site, TomlFile, Vehicle};

    /// A minute of driving past four radio heads, of which number 2 is off by `bias_rad`; what was
    /// measured goes to `sinks`.
    fn drive(
        bias_rad: f64,
        mut sink: impl FnMut(Option<&OdometrySample>, usize, &AngleMeasurement),
    ) {
        let (site, _) = trip();
        let road = site.build_road().unwrap().unwrap();
        for step in 1..600 {
            let time_s = f64::from(step) * 0.1;
            let odometry = OdometrySample {
                time_s,
                distance_m: 4.0 * time_s,
                speed_mps: 4.0,
                yaw_rate_radps: None,
            };
            let pose = road.pose(4.0 * time_s);
            for (number, head) in site.radio_heads.iter().enumerate() {
                let bearing_rad = pose.point().bearing_rad(RadioHead::from(head).position);
                let bias_rad = if number == 2 { bias_rad } else { 0.0 };
                let phase_rad = std::f64::consts::PI * (bearing_rad - pose.heading_rad).cos();
                let measured = AngleMeasurement {
                    time_s,
                    phase_rad: phase_rad + bias_rad,
                    phase_sigma_rad: 0.05,
                    angle_rad: f64::NAN,
                    snr_db: 20.0,
                    resolved: true,
                };
                sink((number == 0).then_some(&odometry), number, &measured);
            }
        }
    }

    fn trip() -> (Site, Vehicle) {
        let site = Site::from_library("trip-4", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("carrier", &Shipped).unwrap();
        (site, vehicle)
    }

    fn ekf() -> (Ekf, Vec<RadioHead>) {
        let (site, vehicle) = trip();
        let config = EkfConfig::new(&site, &vehicle);
        let heads = RadioHead::heard(&site, &vehicle);
        let start = InitialPose {
            pose: Pose::default(),
            position_std_m: 0.1,
            heading_std_rad: 0.01,
        };
        let map = Arc::new(site.build_road().unwrap().unwrap());
        (Ekf::new(config, Some(map), &heads, &start), heads)
    }

    /// The bank after the drive, and the same filter having done without some radio heads.
    fn after(bias_rad: f64, without: &[usize]) -> (Bank, Ekf) {
        let (mut alone, heads) = ekf();
        for &head in without {
            alone.set_excluded(&heads[head], true);
        }
        let mut bank = Bank::new(
            &ekf().0,
            &heads,
            FaultModes::new(&ekf().0, FaultProbability::default()),
            0.0,
        );
        drive(bias_rad, |odometry, head, measured| {
            if let Some(sample) = odometry {
                bank.odometry(sample);
                alone.odometry(sample);
            }
            bank.update(&heads[head], measured);
            alone.update(&heads[head], measured);
        });
        (bank, alone)
    }

    #[test]
    fn the_culprit_is_named_and_nobody_else() {
        let (config, odds) = (IntegrityConfig::default(), 9.2);
        let (sound, _) = after(0.0, &[]);
        assert_eq!(sound.faulty_head(config.detection_threshold, odds), None);
        let (biased, _) = after(0.3, &[]);
        assert!(biased.is_lost(&config));
        assert_eq!(biased.faulty_head(config.detection_threshold, odds), Some(2));
    }

    #[test]
    fn what_takes_over_has_never_heard_the_excluded() {
        let (mut bank, without) = after(0.3, &[2]);
        bank.exclude(2);
        assert_eq!(bank.main().belief(), without.belief());
        assert_eq!(bank.faulty(), 1);
        let (_, without_both) = after(0.3, &[1, 2]);
        let witness = bank.subsets[1].ekf.belief();
        assert_eq!(witness, without_both.belief());
        // The test of the excluded goes on, for the day it agrees again.
        assert!(bank.statistic(2) > 5.5 && !bank.is_lost(&IntegrityConfig::default()));
        bank.readmit(2);
        assert_eq!(bank.faulty(), 0);
        assert!(bank.main().belief() == without.belief());
    }
}
