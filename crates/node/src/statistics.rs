//! Counters and histograms that several threads write and the page and the metrics show.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;

/// Buckets per decade, from 1 µs on: a quantile is told within 12 %.
const PER_DECADE: usize = 20;
/// Decades: up to 100 s.
const DECADES: usize = 8;
const LEAST_S: f64 = 1e-6;

/// Durations, by their logarithm.
#[derive(Debug)]
pub struct Histogram {
    buckets: [AtomicU64; PER_DECADE * DECADES],
    most_ns: AtomicU64,
    sum_ns: AtomicU64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self {
            buckets: [const { AtomicU64::new(0) }; PER_DECADE * DECADES],
            most_ns: AtomicU64::new(0),
            sum_ns: AtomicU64::new(0),
        }
    }
}

/// A few figures of a histogram.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Quantiles {
    /// Number of durations.
    pub count: u64,
    /// Half of them are shorter (s).
    pub median_s: f64,
    /// 99 % of them are shorter (s).
    pub p99_s: f64,
    /// 99.9 % of them are shorter (s).
    pub p999_s: f64,
    /// The longest (s).
    pub most_s: f64,
}

impl Histogram {
    /// Counts a duration; what is not a number, or negative, as none.
    pub fn add(&self, duration_s: f64) {
        let duration_s = if duration_s > 0.0 { duration_s } else { 0.0 };
        let place = ((duration_s / LEAST_S).log10() * PER_DECADE as f64).max(0.0) as usize;
        let bucket = self.buckets.get(place).or(self.buckets.last());
        if let Some(bucket) = bucket {
            bucket.fetch_add(1, Ordering::Relaxed);
        }
        let ns = (duration_s * 1e9) as u64;
        self.most_ns.fetch_max(ns, Ordering::Relaxed);
        self.sum_ns.fetch_add(ns, Ordering::Relaxed);
    }

    fn counts(&self) -> impl Iterator<Item = (f64, u64)> {
        let upper_s = |place: usize| LEAST_S * 10f64.powf((place + 1) as f64 / PER_DECADE as f64);
        let buckets = self.buckets.iter().enumerate();
        buckets.map(move |(place, bucket)| (upper_s(place), bucket.load(Ordering::Relaxed)))
    }

    /// Its quantiles, as upper ends of their buckets.
    pub fn quantiles(&self) -> Quantiles {
        let count = self.counts().map(|(_, count)| count).sum();
        let most_s = self.most_ns.load(Ordering::Relaxed) as f64 * 1e-9;
        let quantile = |share: f64| {
            let wanted = share * count as f64;
            let mut below = 0;
            let found = self.counts().find(|(_, count)| {
                below += count;
                below as f64 >= wanted
            });
            found.map_or(0.0, |(upper_s, _)| upper_s.min(most_s))
        };
        if count == 0 {
            return Quantiles::default();
        }
        Quantiles {
            count,
            median_s: quantile(0.5),
            p99_s: quantile(0.99),
            p999_s: quantile(0.999),
            most_s,
        }
    }

    /// Sum of all durations in seconds.
    pub fn sum_s(&self) -> f64 {
        self.sum_ns.load(Ordering::Relaxed) as f64 * 1e-9
    }

    /// Number of durations up to each whole decade, as Prometheus has it: `(upper end in s, count)`.
    pub fn cumulative(&self) -> Vec<(f64, u64)> {
        let mut sum = 0;
        let all: Vec<_> = self
            .counts()
            .map(|(upper_s, count)| {
                sum += count;
                (upper_s, sum)
            })
            .collect();
        all.into_iter().skip(4).step_by(5).collect()
    }
}

/// A source, as seen from outside.
#[derive(Debug)]
pub struct SourceHealth {
    /// Its name.
    pub name: &'static str,
    began: Instant,
    /// Nanoseconds since `began` when something came last, plus 1; 0 before.
    last_ns: AtomicU64,
    items: AtomicU64,
    defects: AtomicU64,
}

impl SourceHealth {
    /// A source from which nothing has come yet.
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            began: Instant::now(),
            last_ns: AtomicU64::new(0),
            items: AtomicU64::new(0),
            defects: AtomicU64::new(0),
        }
    }

    /// So many items came.
    pub fn came(&self, items: u64) {
        let ns = self.began.elapsed().as_nanos() as u64 + 1;
        self.last_ns.store(ns, Ordering::Relaxed);
        self.items.fetch_add(items, Ordering::Relaxed);
    }

    /// It is switched off for so long, and silent on purpose; so many items would have come.
    pub fn rests(&self, items: u64, duration: Duration) {
        let until = self.began.elapsed() + duration;
        self.last_ns
            .store(until.as_nanos() as u64 + 1, Ordering::Relaxed);
        self.items.fetch_add(items, Ordering::Relaxed);
    }

    /// Something came that cannot be used.
    pub fn defect(&self) {
        self.defects.fetch_add(1, Ordering::Relaxed);
    }

    /// Time since something came, or since the start.
    pub fn silent_for(&self) -> Duration {
        let last = Duration::from_nanos(self.last_ns.load(Ordering::Relaxed));
        self.began.elapsed().saturating_sub(last)
    }

    /// Items that came, or would have while it was switched off: samples per channel, or messages.
    pub fn items(&self) -> u64 {
        self.items.load(Ordering::Relaxed)
    }

    /// Items that could not be used.
    pub fn defects(&self) -> u64 {
        self.defects.load(Ordering::Relaxed)
    }
}

/// How punctual the node is.
#[derive(Debug, Default)]
pub struct Punctuality {
    /// From the arrival of an SSB's last sample to the pose with its angle.
    pub ssb_to_pose: Histogram,
    /// From the arrival of odometry to the pose by it.
    pub odometry_to_pose: Histogram,
    /// By how much the time between two poses differs from that between the odometry of theirs.
    pub jitter: Histogram,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_told_within_a_bucket() {
        let histogram = Histogram::default();
        for number in 1..=10_000 {
            histogram.add(f64::from(number) * 1e-6);
        }
        let found = histogram.quantiles();
        assert_eq!(found.count, 10_000);
        for (found_s, expected_s) in [
            (found.median_s, 5e-3),
            (found.p99_s, 9.9e-3),
            (found.p999_s, 9.99e-3),
        ] {
            assert!(
                (found_s / expected_s - 1.0).abs() < 0.13,
                "{found_s} {expected_s}"
            );
        }
        assert!((found.most_s - 1e-2).abs() < 1e-8);
        let (_, all) = *histogram.cumulative().last().unwrap();
        assert_eq!(all, 10_000);
        for awkward in [f64::NAN, -1.0, 0.0, f64::INFINITY, 1e9] {
            histogram.add(awkward);
        }
        assert_eq!(histogram.quantiles().count, 10_005);
    }
}
