//! Clocks: time of samples without time stamps, and time of the drive.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Returns the time in seconds since 1970 (UTC).
pub fn unix_s() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0.0, |it| it.as_secs_f64())
}

/// Length of the window over which the minimum delay is determined, in seconds.
const WINDOW_S: f64 = 1.0;
/// Maximum relative frequency difference of two oscillators.
const DRIFT: f64 = 1e-4;
/// Minimum change of the minimum delay, in seconds, that is corrected immediately; a smaller change
/// is drift.
const STEP_S: f64 = 2e-3;
/// Minimum silence, in seconds, that counts as an interruption. Transport and a loaded computer delay blocks
/// by less.
pub const INTERRUPTION_S: f64 = 0.25;
/// Maximum time, in seconds, until samples of an interruption are regarded as missing. It begins
/// with the last samples that arrived faster than in real time, because these are late samples.
pub const CATCH_UP_S: f64 = 0.2;
/// Minimum decrease of the delay, in seconds, that shows that samples arrive faster than in real time.
pub const CAUGHT_UP_S: f64 = 0.01;
/// Minimum relative difference between the configured and the measured sample rate in each window
/// of [`RATE_WINDOW_S`].
const WRONG_RATE: f64 = 0.01;
/// Length of the windows that measure the sample rate, in seconds.
const RATE_WINDOW_S: f64 = 0.5;
/// Minimum number of consecutive windows with a rate that is wrong in the same direction.
const WINDOWS: u32 = 3;
/// Minimum total change of the minimum delay in these windows, in seconds: a loaded computer changes
/// it by less.
const WRONG_RATE_S: f64 = 0.03;

/// Finding from a window of arrivals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Finding {
    /// Duration of missing samples in seconds; the offset includes it.
    Missing(f64),
    /// Measured sample rate divided by the configured rate, minus one.
    WrongRate(f64),
}

/// Clock of a stream of samples: the sample time by counting, and its offset from the arrival of
/// blocks.
///
/// The sample time is exact between SSBs, so that windows remain at the SSBs. The offset includes
/// drift of the oscillators and missing samples. A block cannot arrive before its last sample was
/// received. Therefore, the minimum delay within a second is the delay of the transport.
#[derive(Debug, Clone)]
pub struct ArrivalClock {
    rate_hz: f64,
    /// Time of sample 0; `None` before the first block.
    zero_s: Option<f64>,
    counted: u64,
    offset_s: f64,
    window: Option<Window>,
    rate: RateMonitor,
    last_arrival_s: Option<f64>,
    interruption: Option<Interruption>,
}

/// An interruption that may still turn out to be a delay.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::struct_field_names, reason = "all fields are in seconds")]
struct Interruption {
    /// Time of the decision in seconds.
    decided_s: f64,
    /// Missing time so far, in seconds.
    lost_s: f64,
    /// Missing time at the last postponement of the decision, in seconds.
    before_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Window {
    began_s: f64,
    min_delay_s: f64,
}

impl ArrivalClock {
    /// Creates the clock of a stream before its first sample.
    pub const fn new(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            zero_s: None,
            counted: 0,
            offset_s: 0.0,
            window: None,
            rate: RateMonitor::NONE,
            last_arrival_s: None,
            interruption: None,
        }
    }

    /// Returns time minus sample time in seconds.
    pub const fn offset_s(&self) -> f64 {
        self.offset_s
    }

    /// Returns the sample time of the next sample; `None` before the first block.
    pub fn next_s(&self) -> Option<f64> {
        Some(self.zero_s? + self.counted as f64 / self.rate_hz)
    }

    /// Processes the arrival of `length` samples at `now_s` and returns the sample time of the
    /// first one.
    pub fn block(&mut self, length: usize, now_s: f64) -> (f64, Option<Finding>) {
        let duration_s = length as f64 / self.rate_hz;
        let zero_s = *self.zero_s.get_or_insert(now_s - duration_s);
        let start_s = zero_s + self.counted as f64 / self.rate_hz;
        self.counted += length as u64;
        let delay_s = now_s - (start_s + duration_s + self.offset_s);
        let last_s = self.last_arrival_s.replace(now_s).unwrap_or(now_s);
        let finding = if now_s - last_s >= INTERRUPTION_S && delay_s >= INTERRUPTION_S {
            let before_s = self.interruption.map_or(0.0, |it| it.lost_s);
            self.offset_s += delay_s;
            (self.window, self.rate) = (None, RateMonitor::NONE);
            self.interruption = Some(Interruption {
                decided_s: now_s + CATCH_UP_S,
                lost_s: before_s + delay_s,
                before_s: before_s + delay_s,
            });
            None
        } else if self.interruption.is_some() {
            self.catch_up(delay_s, now_s)
        } else {
            self.watch(delay_s, now_s)
        };
        (start_s, finding)
    }

    /// Decides after an interruption whether its samples are missing or late.
    fn catch_up(&mut self, delay_s: f64, now_s: f64) -> Option<Finding> {
        let interruption = self.interruption.as_mut()?;
        let early_s = delay_s.min(0.0);
        self.offset_s += early_s;
        interruption.lost_s += early_s;
        if interruption.before_s - interruption.lost_s >= CAUGHT_UP_S {
            interruption.before_s = interruption.lost_s;
            interruption.decided_s = now_s + CATCH_UP_S;
        }
        let Interruption {
            decided_s, lost_s, ..
        } = *interruption;
        if now_s < decided_s {
            return None;
        }
        self.interruption = None;
        (lost_s >= INTERRUPTION_S).then_some(Finding::Missing(lost_s))
    }

    /// Updates the minimum delay of a window, and corrects the offset at its end.
    fn watch(&mut self, delay_s: f64, now_s: f64) -> Option<Finding> {
        let wrong_rate = self.rate.see(delay_s + self.offset_s, now_s);
        let window = self.window.get_or_insert(Window::new(delay_s, now_s));
        let missing = (window.see(delay_s, now_s, WINDOW_S)).and_then(|(min_s, lasted_s)| {
            self.window = None;
            self.correct(min_s, lasted_s)
        });
        wrong_rate.map(Finding::WrongRate).or(missing)
    }

    fn correct(&mut self, min_s: f64, lasted_s: f64) -> Option<Finding> {
        if min_s.abs() <= STEP_S {
            let max_s = DRIFT * lasted_s;
            self.offset_s += min_s.clamp(-max_s, max_s);
            return None;
        }
        self.offset_s += min_s;
        (min_s >= INTERRUPTION_S).then_some(Finding::Missing(min_s))
    }
}

impl Window {
    const fn new(delay_s: f64, now_s: f64) -> Self {
        Self {
            began_s: now_s,
            min_delay_s: delay_s,
        }
    }

    /// Adds a delay. Returns the minimum delay and the duration at the end of the window.
    fn see(&mut self, delay_s: f64, now_s: f64, length_s: f64) -> Option<(f64, f64)> {
        self.min_delay_s = self.min_delay_s.min(delay_s);
        let lasted_s = now_s - self.began_s;
        (lasted_s >= length_s).then_some((self.min_delay_s, lasted_s))
    }
}

/// Monitor of the sample rate: the minimum delay grows if samples are missing regularly or the rate
/// is lower than configured, and decreases if the rate is higher.
#[derive(Debug, Clone, Copy)]
struct RateMonitor {
    window: Option<Window>,
    /// Minimum delay of the previous window, relative to counted samples, in seconds.
    before_s: Option<f64>,
    /// Number of consecutive windows with a wrong rate.
    count: u32,
    /// Duration of the consecutive windows with a wrong rate, in seconds.
    lasted_s: f64,
    /// Change of the delay over the consecutive windows with a wrong rate, in seconds.
    growth_s: f64,
}

impl RateMonitor {
    const NONE: Self = Self {
        window: None,
        before_s: None,
        count: 0,
        lasted_s: 0.0,
        growth_s: 0.0,
    };

    /// Adds a delay relative to counted samples. Returns the measured rate divided by the
    /// configured one, minus one, if it is wrong.
    fn see(&mut self, delay_s: f64, now_s: f64) -> Option<f64> {
        let window = self.window.get_or_insert(Window::new(delay_s, now_s));
        let (min_s, lasted_s) = window.see(delay_s, now_s, RATE_WINDOW_S)?;
        self.window = None;
        let growth_s = min_s - self.before_s.replace(min_s)?;
        if growth_s.abs() <= WRONG_RATE * lasted_s || growth_s * self.growth_s < 0.0 {
            (self.count, self.lasted_s, self.growth_s) = (0, 0.0, 0.0);
        }
        if growth_s.abs() > WRONG_RATE * lasted_s {
            self.count += 1;
            self.lasted_s += lasted_s;
            self.growth_s += growth_s;
        }
        if self.count < WINDOWS || self.growth_s.abs() < WRONG_RATE_S {
            return None;
        }
        let excess = -self.growth_s / self.lasted_s;
        *self = Self::NONE;
        Some(excess)
    }
}

/// Maximum time by which samples or angles may be ahead of the odometry's clock and still advance
/// the time of the drive, in seconds.
const MAX_AHEAD_S: f64 = 1.0;

/// Time of the drive: that of the newest input plus the time since its arrival. The odometry's
/// clock has priority.
#[derive(Debug, Clone, Copy, Default)]
pub struct DriveClock {
    newest: Option<(f64, Instant)>,
    is_of_odometry: bool,
}

impl DriveClock {
    /// Processes the arrival of samples or angles.
    pub fn see(&mut self, time_s: f64) {
        let is_ahead = |now_s: f64| time_s > now_s + MAX_AHEAD_S;
        if !(self.is_of_odometry && self.now_s().is_some_and(is_ahead)) {
            self.move_to(time_s);
        }
    }

    /// Processes the arrival of odometry.
    pub fn see_odometry(&mut self, time_s: f64) {
        if !self.is_of_odometry {
            *self = Self {
                newest: None,
                is_of_odometry: true,
            };
        }
        self.move_to(time_s);
    }

    /// Advances to a time from any source.
    pub fn move_to(&mut self, time_s: f64) {
        if self.newest.is_none_or(|(newest_s, _)| time_s > newest_s) {
            self.newest = Some((time_s, Instant::now()));
        }
    }

    /// Returns the present time in seconds; `None` before any input.
    pub fn now_s(&self) -> Option<f64> {
        self.newest
            .map(|(time_s, at)| time_s + at.elapsed().as_secs_f64())
    }

    /// Resets the time, as after a step of the odometry's clock.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 3.84e6;
    const BLOCK: usize = 3840;

    /// Blocks of 1 ms with random delays of up to 20 ms, and one block in ten without; `lost_s` is
    /// missing before block `at`.
    fn run(drift: f64, lost: Option<(usize, f64)>, blocks: usize) -> (Vec<f64>, Vec<Finding>) {
        let (mut clock, mut found, mut errors_s) =
            (ArrivalClock::new(RATE_HZ), Vec::new(), Vec::new());
        let mut sample_times_s = Vec::new();
        let mut lost_s = 0.0;
        for number in 0..blocks {
            if let Some((at, by_s)) = lost
                && at == number
            {
                lost_s = by_s;
            }
            let true_s = 1.7e9 + number as f64 * 1e-3 * (1.0 + drift) + lost_s;
            let delay_s = if number % 10 == 0 {
                1e-4
            } else {
                1e-3 * (number * 7 % 20) as f64
            };
            let (time_s, finding) = clock.block(BLOCK, true_s + 1e-3 + delay_s);
            errors_s.push(time_s + clock.offset_s() - true_s);
            sample_times_s.push(time_s);
            found.extend(finding);
        }
        // Windows depend on the sample time, which is contiguous for any delays.
        for (number, time_s) in sample_times_s.iter().enumerate() {
            let counted_s = sample_times_s[0] + number as f64 * 1e-3;
            assert!((time_s - counted_s).abs() < 1e-6, "{number}");
        }
        (errors_s, found)
    }

    #[test]
    fn jitter_and_drift_cause_an_error_below_a_tenth_of_a_millisecond() {
        for drift in [0.0, 2e-5, -5e-5] {
            let (errors_s, found) = run(drift, None, 60_000);
            assert!(found.is_empty(), "{found:?}");
            for error_s in &errors_s[2000..] {
                assert!(error_s.abs() < 2.5e-4, "{drift}: {error_s}");
            }
        }
    }

    /// A change of the delay by milliseconds is usually caused by a loaded computer. Missing
    /// samples are detected by the SSBs. The time is correct within two windows, and nothing is
    /// reported.
    #[test]
    fn a_short_gap_is_corrected_within_two_windows() {
        let (errors_s, found) = run(0.0, Some((5_500, 7e-3)), 9_000);
        assert!(found.is_empty(), "{found:?}");
        assert!(errors_s[7_600..].iter().all(|it| it.abs() < 3e-4));
    }

    #[test]
    fn an_interruption_is_corrected_immediately_and_reported_once() {
        let (errors_s, found) = run(0.0, Some((5_500, 6.0)), 9_000);
        let [Finding::Missing(lost_s)] = found[..] else {
            panic!("{found:?}");
        };
        assert!((lost_s - 6.0).abs() < 3e-4, "{lost_s}");
        // The delay of the first block is known after the block with the minimum delay among the
        // next ten.
        assert!(errors_s[5_500..].iter().all(|it| it.abs() < 2.1e-2));
        assert!(errors_s[5_511..].iter().all(|it| it.abs() < 3e-4));
    }

    #[test]
    fn samples_delayed_by_half_a_second_are_not_reported_as_missing() {
        let mut clock = ArrivalClock::new(RATE_HZ);
        let mut found = Vec::new();
        for number in 0..8_000 {
            // Samples stop at 3 s for half a second and then arrive a third faster than in real
            // time.
            let due_s = f64::from(number) * 1e-3;
            let arrival_s = due_s.max(if due_s < 3.0 {
                0.0
            } else {
                3.5 + 0.75 * (due_s - 3.0)
            });
            let (time_s, finding) = clock.block(BLOCK, 100.0 + arrival_s);
            found.extend(finding);
            if due_s > 5.1 {
                let error_s = time_s + clock.offset_s() - (100.0 + due_s - 1e-3);
                assert!(error_s.abs() < 1e-3, "{due_s}: {error_s}");
            }
        }
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn a_wrong_rate_is_reported() {
        let mut clock = ArrivalClock::new(RATE_HZ);
        let found: Vec<Finding> = (0..10_000)
            .filter_map(|number| clock.block(2 * BLOCK, 10.0 + f64::from(number) * 1e-3).1)
            .collect();
        let named = found.iter().find_map(|it| match it {
            Finding::WrongRate(excess) => Some(*excess),
            Finding::Missing(_) => None,
        });
        assert!((named.unwrap() - 1.0).abs() < 0.05, "{found:?}");
    }

    /// Blocks of 1 ms with delays of up to 20 ms. From 3 s on, `lost_s` of the samples are missing
    /// at every multiple of `period_s`. Returns the time of the first report of a wrong rate (s).
    fn reported_s(lost_s: f64, period_s: f64, phase_s: f64) -> Option<(f64, f64)> {
        let mut clock = ArrivalClock::new(RATE_HZ);
        (0..10_000).find_map(|number| {
            let sent_s = f64::from(number) * 1e-3;
            let since_s = sent_s - 3.0 - phase_s;
            if since_s >= 0.0 && since_s % period_s < lost_s {
                return None;
            }
            let delay_s = 1e-3 * f64::from(number * 7 % 20);
            let finding = clock.block(BLOCK, 50.0 + sent_s + delay_s).1?;
            match finding {
                Finding::WrongRate(excess) => Some((since_s, excess)),
                Finding::Missing(_) => None,
            }
        })
    }

    #[test]
    fn samples_that_are_lost_regularly_are_reported_within_two_seconds() {
        for phase in 0..10 {
            let phase_s = 0.05 * f64::from(phase);
            let (since_s, excess) = reported_s(0.03, 0.5, phase_s).unwrap();
            assert!(since_s > 0.0 && since_s <= 2.1, "{phase_s}: {since_s}");
            assert!((excess + 0.06).abs() < 0.01, "{excess}");
        }
        assert_eq!(reported_s(0.002, 0.5, 0.1), None);
    }

    #[test]
    fn varying_delays_are_not_reported_as_a_wrong_rate() {
        // The delay varies by 0.2 s with a period of 1.7 s.
        let mut clock = ArrivalClock::new(RATE_HZ);
        let found: Vec<Finding> = (0..20_000)
            .filter_map(|number| {
                let sent_s = f64::from(number) * 1e-3;
                let turns = std::f64::consts::TAU * sent_s / 1.7;
                let delay_s = 0.1 * (1.0 - turns.cos());
                clock.block(BLOCK, 50.0 + sent_s + delay_s).1
            })
            .collect();
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn the_odometry_determines_the_time_of_the_drive() {
        let mut clock = DriveClock::default();
        let near = |clock: &DriveClock, time_s: f64| (clock.now_s().unwrap() - time_s).abs() < 0.5;
        clock.see(100.0);
        clock.see_odometry(40.0);
        assert!(near(&clock, 40.0));
        clock.see(100.0);
        assert!(near(&clock, 40.0));
        clock.see(40.8);
        assert!(near(&clock, 40.8));
        clock.reset();
        clock.see_odometry(3.0);
        assert!(near(&clock, 3.0));
    }
}
