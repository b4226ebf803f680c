//! Counters and histograms that several threads write and the web page and metrics display.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

/// Number of buckets per decade, starting at 1 µs: a quantile has an error of at most 12 %.
const PER_DECADE: usize = 20;
/// Number of decades of the histogram, up to 100 s.
const DECADES: usize = 8;
/// Lower end of the histogram, in seconds.
const MIN_S: f64 = 1e-6;
const BUCKETS: usize = PER_DECADE * DECADES;
/// Length of a part of the sliding window, in seconds.
const PART_S: u64 = 5;
/// Number of parts of the sliding window; quantiles are those of the last minute.
const PARTS: usize = 12;

/// Targets of the latency from an SSB to its pose, in seconds: a quarter of the shortest burst
/// period (20 ms) for 99 % of the SSBs, and half of it for 99.9 %.
pub const SSB_TO_POSE_TARGETS: Targets = Targets {
    p99_s: 5e-3,
    p999_s: 10e-3,
};
/// Targets of the latency from odometry to its pose, in seconds, for a controller at 50 Hz with
/// time to act.
pub const ODOMETRY_TO_POSE_TARGETS: Targets = Targets {
    p99_s: 5e-3,
    p999_s: 10e-3,
};

/// Targets of a latency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Targets {
    /// Target of the 99th percentile (s).
    pub p99_s: f64,
    /// Target of the 99.9th percentile (s).
    pub p999_s: f64,
}

/// Histogram of the logarithm of durations, since the start and of the last minute.
#[derive(Debug)]
pub struct Histogram {
    buckets: [AtomicU64; BUCKETS],
    sum_ns: AtomicU64,
    began: Instant,
    recent: Mutex<Recent>,
}

impl Default for Histogram {
    fn default() -> Self {
        Self {
            buckets: [const { AtomicU64::new(0) }; BUCKETS],
            sum_ns: AtomicU64::new(0),
            began: Instant::now(),
            recent: Mutex::default(),
        }
    }
}

/// The parts of the sliding window.
#[derive(Debug)]
struct Recent([Part; PARTS]);

impl Default for Recent {
    fn default() -> Self {
        Self([const { Part::new(0) }; PARTS])
    }
}

#[derive(Debug)]
struct Part {
    /// Number of the interval of [`PART_S`] since the start.
    number: u64,
    counts: [u32; BUCKETS],
    max_s: f64,
}

impl Part {
    const fn new(number: u64) -> Self {
        Self {
            number,
            counts: [0; BUCKETS],
            max_s: 0.0,
        }
    }
}

/// Quantiles of a histogram.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Quantiles {
    /// Number of durations.
    pub count: u64,
    /// Median (s).
    pub median_s: f64,
    /// 99th percentile (s).
    pub p99_s: f64,
    /// 99.9th percentile (s).
    pub p999_s: f64,
    /// Maximum (s).
    pub max_s: f64,
}

impl Histogram {
    /// Adds a duration; one that is negative or not a number counts as zero.
    pub fn add(&self, duration_s: f64) {
        self.add_at(duration_s, self.began.elapsed());
    }

    fn add_at(&self, duration_s: f64, now: Duration) {
        let duration_s = if duration_s > 0.0 { duration_s } else { 0.0 };
        let place = ((duration_s / MIN_S).log10() * PER_DECADE as f64).max(0.0) as usize;
        let place = place.min(BUCKETS - 1);
        if let Some(bucket) = self.buckets.get(place) {
            bucket.fetch_add(1, Ordering::Relaxed);
        }
        let ns = (duration_s * 1e9) as u64;
        self.sum_ns.fetch_add(ns, Ordering::Relaxed);
        let number = now.as_secs() / PART_S;
        let mut recent = self.lock();
        if let Some(part) = recent.0.get_mut(number as usize % PARTS) {
            if part.number != number {
                *part = Part::new(number);
            }
            if let Some(count) = part.counts.get_mut(place) {
                *count = count.saturating_add(1);
            }
            part.max_s = part.max_s.max(duration_s);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Recent> {
        self.recent.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the quantiles of the last minute, as upper ends of their buckets.
    pub fn quantiles(&self) -> Quantiles {
        self.quantiles_at(self.began.elapsed())
    }

    fn quantiles_at(&self, now: Duration) -> Quantiles {
        let number = now.as_secs() / PART_S;
        let (mut counts, mut max_s) = ([0u64; BUCKETS], 0f64);
        for part in &self.lock().0 {
            if part.number <= number && part.number + (PARTS as u64) > number {
                let both = counts.iter_mut().zip(&part.counts);
                both.for_each(|(sum, count)| *sum += u64::from(*count));
                max_s = max_s.max(part.max_s);
            }
        }
        let count = counts.iter().sum();
        if count == 0 {
            return Quantiles::default();
        }
        let quantile = |share: f64| {
            let wanted = share * count as f64;
            let mut below = 0;
            let found = counts.iter().position(|count| {
                below += count;
                below as f64 >= wanted
            });
            found.map_or(0.0, |place| upper_s(place).min(max_s))
        };
        Quantiles {
            count,
            median_s: quantile(0.5),
            p99_s: quantile(0.99),
            p999_s: quantile(0.999),
            max_s,
        }
    }

    /// Returns the sum of all durations since the start in seconds.
    pub fn sum_s(&self) -> f64 {
        self.sum_ns.load(Ordering::Relaxed) as f64 * 1e-9
    }

    /// Returns the number of durations since the start up to each quarter of a decade, as Prometheus defines
    /// histograms: `(upper end in s, count)`.
    pub fn cumulative(&self) -> Vec<(f64, u64)> {
        let mut sum = 0;
        let counts = self.buckets.iter().enumerate();
        let all: Vec<_> = counts
            .map(|(place, count)| {
                sum += count.load(Ordering::Relaxed);
                (upper_s(place), sum)
            })
            .collect();
        all.into_iter().skip(4).step_by(5).collect()
    }
}

/// Returns the upper end of a bucket (s).
fn upper_s(place: usize) -> f64 {
    MIN_S * 10f64.powf((place + 1) as f64 / PER_DECADE as f64)
}

/// Activity of a source.
#[derive(Debug)]
pub struct SourceHealth {
    /// Name of the source.
    pub name: &'static str,
    began: Instant,
    /// Time of the last item in nanoseconds since `began`, plus 1; 0 before the first item.
    last_ns: AtomicU64,
    items: AtomicU64,
    defects: AtomicU64,
}

impl SourceHealth {
    /// Creates a source without activity.
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            began: Instant::now(),
            last_ns: AtomicU64::new(0),
            items: AtomicU64::new(0),
            defects: AtomicU64::new(0),
        }
    }

    /// Counts received items.
    pub fn came(&self, items: u64) {
        let ns = self.began.elapsed().as_nanos() as u64 + 1;
        self.last_ns.store(ns, Ordering::Relaxed);
        self.items.fetch_add(items, Ordering::Relaxed);
    }

    /// Marks a planned pause of the source for `duration`, and counts the items that were omitted.
    pub fn rests(&self, items: u64, duration: Duration) {
        let until = self.began.elapsed() + duration;
        self.last_ns
            .store(until.as_nanos() as u64 + 1, Ordering::Relaxed);
        self.items.fetch_add(items, Ordering::Relaxed);
    }

    /// Counts an item that cannot be used.
    pub fn defect(&self) {
        self.defects.fetch_add(1, Ordering::Relaxed);
    }

    /// Returns the time since the last item, or since the start.
    pub fn silent_for(&self) -> Duration {
        let last = Duration::from_nanos(self.last_ns.load(Ordering::Relaxed));
        self.began.elapsed().saturating_sub(last)
    }

    /// Returns the number of received items, including those omitted in planned pauses: samples per
    /// channel, or messages.
    pub fn items(&self) -> u64 {
        self.items.load(Ordering::Relaxed)
    }

    /// Returns the number of items that could not be used.
    pub fn defects(&self) -> u64 {
        self.defects.load(Ordering::Relaxed)
    }
}

/// Latencies of the node.
#[derive(Debug, Default)]
pub struct LatencyStats {
    /// Latency from the arrival of an SSB's last sample to the pose with its angle.
    pub ssb_to_pose: Histogram,
    /// Latency from the arrival of odometry to its pose.
    pub odometry_to_pose: Histogram,
    /// Jitter: difference between the interval of two poses and the interval of their odometry
    /// samples.
    pub jitter: Histogram,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_have_the_resolution_of_a_bucket() {
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
        assert!((found.max_s - 1e-2).abs() < 1e-8);
        let (_, all) = *histogram.cumulative().last().unwrap();
        assert_eq!(all, 10_000);
        for awkward in [f64::NAN, -1.0, 0.0, f64::INFINITY, 1e9] {
            histogram.add(awkward);
        }
        assert_eq!(histogram.quantiles().count, 10_005);
    }

    #[test]
    fn quantiles_are_those_of_the_last_minute() {
        let histogram = Histogram::default();
        // A slow first minute, then fast ones.
        for second in 0..240u64 {
            let duration_s = if second < 60 { 0.5 } else { 1e-3 };
            histogram.add_at(duration_s, Duration::from_secs(second));
        }
        let recent = histogram.quantiles_at(Duration::from_secs(239));
        assert_eq!((recent.count, recent.max_s), (60, 1e-3));
        let slow = Histogram::default();
        slow.add_at(0.5, Duration::from_secs(3));
        assert_eq!(slow.quantiles_at(Duration::from_secs(54)).count, 1);
        assert_eq!(slow.quantiles_at(Duration::from_secs(60)).count, 0);
        assert_eq!(slow.cumulative().last().unwrap().1, 1);
    }
}
