//! What time it is: of samples that carry none, and of the drive.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Seconds since 1970.
pub fn unix_s() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0.0, |it| it.as_secs_f64())
}

/// Length of a window in which the least delayed block is looked for, in seconds.
const WINDOW_S: f64 = 1.0;
/// Two oscillators differ by less, relative.
const DRIFT: f64 = 1e-4;
/// Samples that are late by more than this against the window before are missing ones, in seconds: transport
/// is steadier where one block of a second comes without waiting.
const STEP_S: f64 = 2e-3;
/// A stated rate that differs by more from what arrives, relative, is a wrong one.
const WRONG_RATE: f64 = 0.01;
/// Windows in a row of which each must say so.
const WINDOWS: u32 = 3;

/// What a window of arrivals showed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Finding {
    /// So many seconds of samples are missing; the time is put right.
    Missing(f64),
    /// So many more samples a second come than the rate says, relative.
    WrongRate(f64),
}

/// Times of a stream's samples by counting them, kept to the arrival of blocks.
///
/// A block cannot arrive before its last sample was received. So the least delay of a second is that of the
/// transport, and constant but for drift of the oscillators and for samples that are missing.
#[derive(Debug, Clone)]
pub struct ArrivalClock {
    rate_hz: f64,
    /// Time of sample 0, once a block has come.
    zero_s: Option<f64>,
    counted: u64,
    window: Option<Window>,
    wrong: u32,
}

#[derive(Debug, Clone, Copy)]
struct Window {
    began_s: f64,
    least_delay_s: f64,
}

impl ArrivalClock {
    /// Before the first sample of a stream of this rate.
    pub const fn new(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            zero_s: None,
            counted: 0,
            window: None,
            wrong: 0,
        }
    }

    /// Time of the next sample, as far as is known; `None` before the first.
    pub fn next_s(&self) -> Option<f64> {
        Some(self.zero_s? + self.counted as f64 / self.rate_hz)
    }

    /// Time of the first of `length` samples that have arrived at `now_s`.
    pub fn block(&mut self, length: usize, now_s: f64) -> (f64, Option<Finding>) {
        let duration_s = length as f64 / self.rate_hz;
        let zero_s = *self.zero_s.get_or_insert(now_s - duration_s);
        let mut start_s = zero_s + self.counted as f64 / self.rate_hz;
        let delay_s = now_s - (start_s + duration_s);
        let window = self.window.get_or_insert(Window {
            began_s: now_s,
            least_delay_s: delay_s,
        });
        window.least_delay_s = window.least_delay_s.min(delay_s);
        let mut finding = None;
        let (lasted_s, least_s) = (now_s - window.began_s, window.least_delay_s);
        if lasted_s >= WINDOW_S {
            self.window = None;
            finding = self.put_right(least_s, lasted_s);
            start_s = self.zero_s.unwrap_or(zero_s) + self.counted as f64 / self.rate_hz;
        }
        self.counted += length as u64;
        (start_s, finding)
    }

    fn put_right(&mut self, least_s: f64, lasted_s: f64) -> Option<Finding> {
        let zero_s = self.zero_s.as_mut()?;
        if least_s.abs() <= STEP_S {
            let most_s = DRIFT * lasted_s;
            *zero_s += least_s.clamp(-most_s, most_s);
            self.wrong = 0;
            return None;
        }
        *zero_s += least_s;
        let excess = -least_s / lasted_s;
        self.wrong = if excess.abs() > WRONG_RATE {
            self.wrong + 1
        } else {
            0
        };
        if self.wrong >= WINDOWS {
            self.wrong = 0;
            return Some(Finding::WrongRate(excess));
        }
        (least_s > 0.0).then_some(Finding::Missing(least_s))
    }
}

/// The drive's time: that of the newest that came in, and what has passed since.
#[derive(Debug, Clone, Copy, Default)]
pub struct DriveClock(Option<(f64, Instant)>);

impl DriveClock {
    /// Something of this time came in.
    pub fn see(&mut self, time_s: f64) {
        if self.0.is_none_or(|(newest_s, _)| time_s > newest_s) {
            self.0 = Some((time_s, Instant::now()));
        }
    }

    /// What time it is; `None` before anything came in.
    pub fn now_s(&self) -> Option<f64> {
        self.0
            .map(|(time_s, at)| time_s + at.elapsed().as_secs_f64())
    }

    /// Begins anew.
    pub const fn reset(&mut self) {
        self.0 = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 3.84e6;
    const BLOCK: usize = 3840;

    /// Blocks of 1 ms, each delayed by up to 20 ms but one in ten; `lost_s` before block `at`.
    fn run(drift: f64, lost: Option<(usize, f64)>, blocks: usize) -> (Vec<f64>, Vec<Finding>) {
        let (mut clock, mut found, mut errors_s) =
            (ArrivalClock::new(RATE_HZ), Vec::new(), Vec::new());
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
            errors_s.push(time_s - true_s);
            found.extend(finding);
        }
        (errors_s, found)
    }

    #[test]
    fn jitter_and_drift_leave_the_time_within_a_tenth_of_a_millisecond() {
        for drift in [0.0, 2e-5, -5e-5] {
            let (errors_s, found) = run(drift, None, 60_000);
            assert!(found.is_empty(), "{found:?}");
            for error_s in &errors_s[2000..] {
                assert!(error_s.abs() < 2.5e-4, "{drift}: {error_s}");
            }
        }
    }

    #[test]
    fn samples_that_are_missing_are_noticed_within_two_windows() {
        let (errors_s, found) = run(0.0, Some((5_500, 7e-3)), 9_000);
        let [Finding::Missing(lost_s)] = found[..] else {
            panic!("{found:?}");
        };
        assert!((lost_s - 7e-3).abs() < 3e-4, "{lost_s}");
        assert!(errors_s[7_600..].iter().all(|it| it.abs() < 3e-4));
    }

    #[test]
    fn a_wrong_rate_is_named() {
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
}
