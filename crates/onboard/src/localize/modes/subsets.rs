//! Filters without one or two of the recently received radio heads. Each filter has a test of every
//! radio head that it does not use: whether the angles of that radio head agree with all other
//! measurements.
//!
//! The filters without a radio head start at its first angle, as copies of filters that have used
//! all others; before, they would be identical. They end if the radio head has not been received
//! recently and others have. The cost therefore depends on the number of radio heads in range, not
//! on the number in the site.

use crate::clone_in_place::clone_in_place;
use crate::gaussian::Innovation;
use crate::localize::ekf::Ekf;
use crate::radio_head::RadioHead;

/// Weights of the newest angle in the averages: the first detects a large fault fast, the last a
/// bias below the noise of single angles.
const WEIGHTS: [f64; 3] = [0.5, 0.125, 0.03125];

/// Maximum deviation of an angle from an average, in standard deviations: two successive outliers
/// are no fault.
const MAX_DEVIATION_SIGMAS: f64 = 3.0;

/// Statistic, in standard deviations, above which a radio head is faulty. Error probability of a
/// single Gaussian test: 4e-8.
pub(super) const DETECTED: f64 = 5.5;
/// Statistic, in standard deviations, below which a radio head is consistent. Error probability of
/// a single Gaussian test: 5e-4.
pub(super) const CLEARED: f64 = 3.5;

/// Time without a contradiction after which a source is fault-free again (s).
pub(in crate::localize) const RECOVERY_S: f64 = 5.0;

/// Exponentially weighted averages of a radio head's innovations relative to a filter that does not
/// use it, each with its variance in the fault-free case.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct HeadTest {
    averages: [Average; WEIGHTS.len()],
}

#[derive(Clone, Copy, Debug, PartialEq, Default)]
struct Average {
    mean: f64,
    /// Part of the variance that is due to the noise of the angles.
    noise: f64,
    /// Part of the variance that is due to the state, which all averaged angles share.
    belief: f64,
}

impl HeadTest {
    /// Adds one innovation.
    pub fn push(&mut self, innovation: &Innovation) {
        let belief = (innovation.variance - innovation.measurement_variance).max(0.0);
        let most = MAX_DEVIATION_SIGMAS * innovation.variance.sqrt();
        for (average, weight) in self.averages.iter_mut().zip(WEIGHTS) {
            // The first angle initialises an average.
            let weight = if average.noise == 0.0 { 1.0 } else { weight };
            let kept = 1.0 - weight;
            average.mean += weight * (innovation.residual - average.mean).clamp(-most, most);
            average.noise =
                kept * kept * average.noise + weight * weight * innovation.measurement_variance;
            average.belief = kept * average.belief + weight * belief;
        }
    }

    /// Returns the maximum of the averages, in units of their standard deviations.
    pub fn statistic(&self) -> f64 {
        self.averages
            .iter()
            .filter(|average| average.noise > 0.0)
            .map(|average| average.mean.abs() / (average.noise + average.belief).sqrt())
            .fold(0.0, f64::max)
    }
}

/// Number of angles of all radio heads after which a radio head no longer counts as recently
/// received.
const LATELY: u64 = 32;

/// Number of radio heads whose filters are kept regardless of the time since reception, because
/// their previous angles may still contribute to the position.
const MIN_MONITORED: usize = 4;

/// Minimum number of radio heads for filters without two of them: with two radio heads, the faulty one cannot be
/// identified.
const MIN_FOR_PAIRS: usize = 3;

clone_in_place! {
    /// Filter without one or two radio heads, and the test of each against it.
    #[derive(Debug)]
    pub(super) struct SubsetFilter {
        /// Indices of the excluded radio heads; equal for a single one.
        pub without: [usize; 2],
        pub tests: [HeadTest; 2],
        /// Tests of the ranges, in metres.
        pub range_tests: [HeadTest; 2],
        pub ekf: Ekf,
    }
}

impl SubsetFilter {
    pub fn lacks(&self, head: usize) -> bool {
        self.without.contains(&head)
    }

    pub const fn is_of_one(&self) -> bool {
        self.without[0] == self.without[1]
    }

    pub fn test(&self, head: usize) -> HeadTest {
        self.of(head, self.tests)
    }

    pub fn range_test(&self, head: usize) -> HeadTest {
        self.of(head, self.range_tests)
    }

    const fn of(&self, head: usize, [first, second]: [HeadTest; 2]) -> HeadTest {
        if self.without[0] == head {
            first
        } else {
            second
        }
    }
}

/// All filters without one or two radio heads.
#[derive(Debug)]
pub(super) struct Subsets {
    /// Filters: first those without one radio head, in order of the radio heads; then those without
    /// two; then unused ones for reuse.
    filters: Vec<SubsetFilter>,
    used: usize,
    /// Index of the last angle of each radio head.
    last: Vec<u64>,
    /// Number of angles of all radio heads.
    angles: u64,
}

impl Clone for Subsets {
    fn clone(&self) -> Self {
        Self {
            filters: self.iter().cloned().collect(),
            last: self.last.clone(),
            ..*self
        }
    }

    /// Copies all subsets; keeps unused filters for reuse.
    fn clone_from(&mut self, source: &Self) {
        (self.used, self.angles) = (source.used, source.angles);
        self.last.clone_from(&source.last);
        let mut theirs = source.iter();
        for (mine, theirs) in self.filters.iter_mut().zip(theirs.by_ref()) {
            mine.clone_from(theirs);
        }
        let there = self.filters.len();
        self.filters.extend(source.iter().skip(there).cloned());
    }
}

impl Subsets {
    /// Creates an empty set for a number of radio heads.
    pub fn new(heads: usize) -> Self {
        Self {
            filters: Vec::new(),
            used: 0,
            last: vec![0; heads],
            angles: 0,
        }
    }

    /// Ends all filters; keeps them for reuse.
    pub const fn clear(&mut self) {
        self.used = 0;
    }

    pub fn iter(&self) -> impl Iterator<Item = &SubsetFilter> + Clone {
        self.filters.iter().take(self.used)
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut SubsetFilter> {
        self.filters.iter_mut().take(self.used)
    }

    /// Returns the filter without these radio heads.
    pub fn get(&self, one: usize, other: usize) -> Option<&SubsetFilter> {
        let without = [one.min(other), one.max(other)];
        self.iter().find(|it| it.without == without)
    }

    /// Prepares the filters for an angle of a radio head; `keeps` returns, from its statistic,
    /// whether the filters of a radio head must not end.
    pub fn prepare(
        &mut self,
        head: usize,
        heads: &[RadioHead],
        nominal: &Ekf,
        keeps: impl Fn(usize, f64) -> bool,
    ) {
        self.angles += 1;
        if let Some(last) = self.last.get_mut(head) {
            *last = self.angles;
        }
        if self.get(head, head).is_some() {
            return;
        }
        while let Some(past) = self.longest_without_reception(&keeps) {
            self.end(past);
        }
        let ones = self.iter().filter(|it| it.is_of_one()).count();
        self.begin([head; 2], (head, heads.get(head)), nominal);
        let pairs = if heads.len() < MIN_FOR_PAIRS { 0 } else { ones };
        // The first filters are those without one radio head, in order, without the new one.
        for number in 0..pairs {
            if let Some([other, _]) = self.filters.get(number).map(|it| it.without) {
                let without = [head.min(other), head.max(other)];
                self.begin(without, (head, heads.get(head)), nominal);
            }
        }
        let order = |it: &SubsetFilter| (!it.is_of_one(), it.without);
        if let Some(used) = self.filters.get_mut(..self.used) {
            used.sort_unstable_by_key(order);
        }
    }

    /// Replaces every filter that has used a faulty radio head by one that has not.
    pub fn exclude(&mut self, faulty: usize, heads: &[RadioHead]) {
        for number in 0..self.used {
            let Some([first, second]) = self.filters.get(number).map(|it| it.without) else {
                return;
            };
            if first == faulty || second == faulty {
                continue;
            }
            let clean = [first, second].map(|head| self.get(head, faulty));
            let [Some(of_first), Some(of_second)] = clean else {
                continue;
            };
            let tests = [of_first.test(first), of_second.test(second)];
            let range_tests = [of_first.range_test(first), of_second.range_test(second)];
            let mut ekf = of_first.ekf.clone();
            exclude(&mut ekf, heads.get(second), true);
            if let Some(filter) = self.filters.get_mut(number) {
                (filter.tests, filter.range_tests, filter.ekf) = (tests, range_tests, ekf);
            }
        }
    }

    /// Returns the radio head with the longest time since reception, if that is not recent and
    /// enough others are monitored.
    fn longest_without_reception(&self, keeps: impl Fn(usize, f64) -> bool) -> Option<usize> {
        let last = |head: &usize| self.last.get(*head).copied().unwrap_or_default();
        let ones = (self.iter().filter(|it| it.is_of_one())).map(|it| it.without[0]);
        if ones.clone().count() < MIN_MONITORED {
            return None;
        }
        let statistic = |head| {
            self.get(head, head).map_or(0.0, |it| {
                let ranges = it.range_test(head).statistic();
                it.test(head).statistic().max(ranges)
            })
        };
        let ends =
            |head: &usize| self.angles - last(head) > LATELY && !keeps(*head, statistic(*head));
        let unreceived = ones.filter(ends);
        unreceived.min_by_key(last)
    }

    /// Ends the filters without a radio head.
    fn end(&mut self, head: usize) {
        let mut kept = 0;
        for number in 0..self.used {
            if self.filters.get(number).is_some_and(|it| !it.lacks(head)) {
                self.filters.swap(kept, number);
                kept += 1;
            }
        }
        self.used = kept;
    }

    /// Starts a filter without these radio heads, as a copy of the one without all of them except
    /// the new one.
    fn begin(&mut self, without: [usize; 2], new: (usize, Option<&RadioHead>), nominal: &Ekf) {
        let spare = self.filters.len() > self.used;
        let spare = if spare { self.filters.pop() } else { None };
        let other = without.into_iter().find(|head| *head != new.0);
        let from = other.and_then(|other| self.get(other, other));
        let from = from.map_or(nominal, |it| &it.ekf);
        let tests = [HeadTest::default(); 2];
        let mut filter = match spare {
            Some(mut spare) => {
                spare.ekf.clone_from(from);
                (spare.without, spare.tests, spare.range_tests) = (without, tests, tests);
                spare
            }
            None => SubsetFilter {
                without,
                tests,
                range_tests: tests,
                ekf: from.clone(),
            },
        };
        exclude(&mut filter.ekf, new.1, true);
        self.filters.push(filter);
        let end = self.filters.len() - 1;
        self.filters.swap(self.used, end);
        self.used += 1;
    }
}

/// Excludes a radio head, or includes it again.
pub(super) fn exclude(ekf: &mut Ekf, head: Option<&RadioHead>, excluded: bool) {
    if let Some(head) = head {
        ekf.set_excluded(head, excluded);
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::trip::trip;
    use super::*;

    #[test]
    fn subset_filters_exist_for_recently_received_radio_heads() {
        let (known, _, ekf) = trip();
        let heads: Vec<RadioHead> = (0..8).map(|pci| RadioHead { pci, ..known[0] }).collect();
        for keeps_first in [false, true] {
            let mut subsets = Subsets::new(heads.len());
            let mut prepare = |head: usize| {
                subsets.prepare(head, &heads, &ekf, |it, _| keeps_first && it == 0);
                subsets.clone()
            };
            for head in 0..4 {
                prepare(head);
            }
            // One and two of five.
            assert_eq!(prepare(4).iter().count(), 5 + 10);
            for _ in 0..10 {
                for head in 1..5 {
                    prepare(head);
                }
            }
            // The first one is not recent, and its filters end when another one is received.
            let now = prepare(5);
            assert_eq!(now.get(0, 0).is_some(), keeps_first);
            assert_eq!(now.get(3, 0).is_some(), keeps_first);
            assert!(now.get(1, 5).is_some());
            let watched = if keeps_first { 6 } else { 5 };
            assert_eq!(now.iter().count(), watched * (watched + 1) / 2);
            let order: Vec<_> = now.iter().map(|it| (!it.is_of_one(), it.without)).collect();
            assert!(order.is_sorted());
        }
    }

    fn innovation(residual: f64) -> Innovation {
        Innovation {
            residual,
            variance: 0.011,
            measurement_variance: 0.01,
        }
    }

    #[test]
    fn a_large_bias_is_detected_immediately_and_a_small_one_later() {
        let mut large_bias = HeadTest::default();
        for _ in 0..100 {
            large_bias.push(&innovation(0.0));
        }
        let mut small_bias = large_bias;
        for _ in 0..3 {
            large_bias.push(&innovation(1.0));
        }
        assert!(large_bias.statistic() > 5.5);
        let found = (0..200).position(|_| {
            small_bias.push(&innovation(0.2));
            small_bias.statistic() > 3.0
        });
        assert!(
            found.is_some_and(|count| (5..60).contains(&count)),
            "{found:?}"
        );
    }

    #[test]
    fn two_successive_outliers_are_not_a_fault() {
        let mut test = HeadTest::default();
        for _ in 0..100 {
            test.push(&innovation(0.05));
        }
        for _ in 0..2 {
            test.push(&innovation(-1.5));
            assert!(test.statistic() < 5.5);
        }
    }
}
