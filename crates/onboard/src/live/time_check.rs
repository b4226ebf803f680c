//! Validation of the time stamps of a source, against its earlier stamps and the arrival of its messages.
//!
//! One implausible stamp is rejected and changes nothing. A new time base, as after a clock was set, is accepted
//! once [`RUN`] consecutive rejected messages are consistent with each other.

use crate::time_unit::{MAX_TIME_S, TimeUnit};

/// Maximum lead of a stamp over its expected time, in seconds. The messages of a backlog that is
/// delivered at once stay below it, because each of them is compared with the message before.
pub const MAX_LEAD_S: f64 = 1.0;

/// Maximum time by which an angle may be ahead of the newest odometry, in addition to the time
/// since that odometry arrived, in seconds.
pub const MAX_ANGLE_LEAD_S: f64 = 1.0;

/// Number of consecutive messages, consistent with each other, that establish a new time base.
pub const RUN: u32 = 5;

/// Minimum time between the arrivals of the first and the last message of a run, in seconds. The
/// messages of a backlog that is sent again arrive within a shorter time.
const RUN_S: f64 = 0.2;

/// Maximum difference between the duration of a run by its stamps and by its arrivals, in seconds.
/// It permits jitter of the transport.
const JITTER_S: f64 = 0.1;

/// Minimum duration and maximum jitter of a run of late messages after which their clock was set back, in seconds.
/// Angles of a slow estimator are late, too, but angles of other radio heads interrupt the run.
const LATE_RUN_S: f64 = 0.1;
const LATE_JITTER_S: f64 = 0.05;

/// Maximum time between two messages of a run without arrival times, in seconds.
const MAX_SPACING_S: f64 = 1.0;

/// Minimum time between the last accepted message and a new time base, in seconds.
const MIN_ELAPSED_S: f64 = 1e-3;

/// Maximum relative drift between the source's clock and the arrival clock while clocks are
/// adjusted gradually.
const DRIFT: f64 = 1e-3;

/// Minimum time since the last accepted message for a comparison of units, in seconds.
const UNIT_WAIT_S: f64 = 0.05;

/// Maximum relative deviation of the ratio between a stamp's advance and the elapsed time from the
/// ratio of a time unit.
const UNIT_TOLERANCE: f64 = 0.1;

/// Returns the time unit for a ratio between the advance of the stamps and the elapsed time.
fn unit_of_ratio(ratio: f64) -> Option<TimeUnit> {
    let is_near = |it: &TimeUnit| (ratio / it.per_second() - 1.0).abs() <= UNIT_TOLERANCE;
    TimeUnit::ALL.into_iter().find(is_near)
}

/// Cause of a rejected time stamp.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TimeDefect {
    /// Not a number, or infinite.
    #[error("time_s is {time_s}; it must be a finite number")]
    NotFinite {
        /// The stamp.
        time_s: f64,
    },
    /// Larger than [`MAX_TIME_S`].
    #[error("time_s is {time_s:e}; it must be in seconds and at most {MAX_TIME_S:e}{}", hint(*unit))]
    OutOfRange {
        /// The stamp.
        time_s: f64,
        /// Unit in which the stamp is a Unix time, if there is one.
        unit: Option<TimeUnit>,
    },
    /// The stamps advance in proportion to the elapsed time, but in another unit.
    #[error("time_s advances by {ratio:.3e} per second; it must be in seconds{}", hint(Some(*unit)))]
    WrongUnit {
        /// The unit.
        unit: TimeUnit,
        /// Advance of the stamps per second of elapsed time.
        ratio: f64,
    },
    /// Equal to the stamp of the previous message.
    #[error("time_s is {time_s:.3} as in the previous message{}; each message needs a later time", if *is_copy { ", of which it is a copy" } else { "" })]
    Repeated {
        /// The stamp.
        time_s: f64,
        /// Whether all values of both messages are equal.
        is_copy: bool,
    },
    /// Earlier than the stamp of the last accepted message.
    #[error(
        "time_s is {time_s:.3}, {by_s:.3} s before the last accepted message; check the order of the messages and the clock of their source"
    )]
    Backward {
        /// The stamp.
        time_s: f64,
        /// Time from the stamp to the last accepted message, in seconds.
        by_s: f64,
    },
    /// Later than its arrival allows.
    #[error(
        "time_s is {time_s:.3}, {by_s:.3} s after its expected time; at most {MAX_LEAD_S} s are allowed; check the clock of its source"
    )]
    Future {
        /// The stamp.
        time_s: f64,
        /// Time after the expected time, in seconds.
        by_s: f64,
    },
}

fn hint(unit: Option<TimeUnit>) -> String {
    unit.map_or_else(String::new, |unit| {
        let per_second = unit.per_second();
        format!("; it appears to be in {unit}: divide it by {per_second:e}")
    })
}

impl TimeDefect {
    /// Returns a short name for counters and for grouping events.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => "time not finite",
            Self::OutOfRange { .. } => "time out of range",
            Self::WrongUnit { .. } => "time in a wrong unit",
            Self::Repeated { .. } => "time repeated",
            Self::Backward { .. } => "time backward",
            Self::Future { .. } => "time in the future",
        }
    }
}

/// Accepted time stamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeVerdict {
    /// It continues the time base.
    Continues,
    /// It establishes a new time base.
    NewBase {
        /// Time that has elapsed since the last accepted message, in seconds.
        elapsed_s: f64,
        /// New time minus the time that the earlier base would give, in seconds.
        step_s: f64,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Stamp {
    time_s: f64,
    arrival_s: Option<f64>,
}

impl Stamp {
    /// Returns the time stamp minus the arrival time, in seconds.
    fn lead_s(&self) -> Option<f64> {
        Some(self.time_s - self.arrival_s?)
    }

    /// Returns the time between the arrivals of `since` and of this message, in seconds.
    fn waited_s(&self, since: &Self) -> Option<f64> {
        Some((self.arrival_s? - since.arrival_s?).max(0.0))
    }
}

/// Consecutive rejected messages that are consistent with each other.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    first: Stamp,
    last: Stamp,
    count: u32,
    /// Maximum of time stamp minus arrival time over the run, in seconds.
    lead_s: Option<f64>,
}

impl Run {
    fn from(first: Stamp) -> Self {
        Self {
            first,
            last: first,
            count: 1,
            lead_s: first.lead_s(),
        }
    }

    fn and(self, next: Stamp) -> Self {
        let step_s = next.time_s - self.last.time_s;
        let is_consistent = match next.waited_s(&self.last) {
            Some(waited_s) => (step_s - waited_s).abs() <= MAX_LEAD_S,
            None => step_s <= MAX_SPACING_S,
        };
        if step_s <= 0.0 || !is_consistent {
            return Self::from(next);
        }
        Self {
            last: next,
            count: self.count + 1,
            lead_s: self
                .lead_s
                .zip(next.lead_s())
                .map(|(a_s, b_s)| a_s.max(b_s)),
            ..self
        }
    }

    fn is_time_base(&self) -> bool {
        self.count >= RUN && self.is_regular(RUN_S, JITTER_S).unwrap_or(true)
    }

    /// Whether the messages arrived over a minimum duration, in the intervals of their stamps, both in seconds; `None`
    /// without arrival times.
    fn is_regular(&self, min_s: f64, jitter_s: f64) -> Option<bool> {
        let lasted_s = self.last.time_s - self.first.time_s;
        let waited_s = self.last.waited_s(&self.first)?;
        Some(waited_s >= min_s && (lasted_s - waited_s).abs() <= jitter_s)
    }

    /// Returns the mean time between two messages, in seconds.
    fn spacing_s(&self) -> f64 {
        let steps = self.count.saturating_sub(1).max(1);
        (self.last.time_s - self.first.time_s) / f64::from(steps)
    }
}

/// Validates the time stamps of one source.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TimeCheck {
    last: Option<Stamp>,
    /// Maximum of time stamp minus arrival time over recent messages, in seconds. The messages with
    /// the smallest delay determine it.
    lead_s: Option<f64>,
    run: Option<Run>,
    /// Messages rejected since the last accepted one.
    rejected: u32,
}

impl TimeCheck {
    /// Returns the time of the last accepted message, in seconds.
    pub fn last_s(&self) -> Option<f64> {
        self.last.map(|it| it.time_s)
    }

    /// Returns the time since the last accepted message according to the arrival times, in seconds;
    /// `None` without arrival times.
    pub fn waited_s(&self, arrival_s: Option<f64>) -> Option<f64> {
        let now = Stamp {
            time_s: 0.0,
            arrival_s,
        };
        now.waited_s(&self.last?)
    }

    /// Checks a stamp by itself: finite and within [`MAX_TIME_S`].
    ///
    /// # Errors
    /// [`TimeDefect::NotFinite`] or [`TimeDefect::OutOfRange`].
    pub fn range(time_s: f64) -> Result<(), TimeDefect> {
        if !time_s.is_finite() {
            return Err(TimeDefect::NotFinite { time_s });
        }
        if time_s.abs() > MAX_TIME_S {
            let is_time = |unit: &TimeUnit| time_s.abs() / unit.per_second() <= MAX_TIME_S;
            let unit = TimeUnit::of_epoch(time_s).filter(is_time);
            return Err(TimeDefect::OutOfRange { time_s, unit });
        }
        Ok(())
    }

    /// Validates the stamp of the next message; `arrival_s` is the time of its arrival by a monotonic clock, in
    /// seconds, and `is_copy` whether it equals the previous message in all values. Without arrival times a step
    /// ahead counts as a gap. `max_lead_s` is the maximum lead over the expected time in seconds.
    ///
    /// # Errors
    /// The cause of a rejection. The reference then remains the last accepted message.
    pub fn next(
        &mut self,
        time_s: f64,
        arrival_s: Option<f64>,
        is_copy: bool,
        max_lead_s: f64,
    ) -> Result<TimeVerdict, TimeDefect> {
        Self::range(time_s)?;
        let stamp = Stamp { time_s, arrival_s };
        let Some(last) = self.last else {
            self.accept(stamp);
            return Ok(TimeVerdict::Continues);
        };
        let ahead_s = time_s - last.time_s;
        let waited_s = stamp.waited_s(&last);
        let defect = if ahead_s == 0.0 {
            return Err(TimeDefect::Repeated { time_s, is_copy });
        } else if ahead_s < 0.0 {
            let by_s = -ahead_s;
            TimeDefect::Backward { time_s, by_s }
        } else {
            match self.lead_over_expected_s(&stamp, &last) {
                Some(by_s) if by_s > max_lead_s => TimeDefect::Future { time_s, by_s },
                _ => {
                    self.accept(stamp);
                    return Ok(TimeVerdict::Continues);
                }
            }
        };
        self.rejected += 1;
        let run = self.run.map_or(Run::from(stamp), |run| run.and(stamp));
        self.run = Some(run);
        if run.is_time_base() {
            return Ok(self.accept_base(&run, &last));
        }
        // One stamp may have any ratio. A unit is reported after three consecutive rejected stamps
        // that are inconsistent with each other.
        let unit = waited_s
            .filter(|waited_s| self.rejected >= 3 && run.count == 1 && *waited_s >= UNIT_WAIT_S)
            .map(|waited_s| ahead_s / waited_s)
            .and_then(|ratio| Some((unit_of_ratio(ratio)?, ratio)));
        Err(unit.map_or(defect, |(unit, ratio)| TimeDefect::WrongUnit {
            unit,
            ratio,
        }))
    }

    /// Processes a stamp that is earlier than that of the last accepted message and is accepted as late. If all messages
    /// are late for 0.1 s, their clock has been set back.
    ///
    /// # Errors
    /// The cause of a rejection by [`range`](Self::range).
    pub fn late(&mut self, time_s: f64, arrival_s: Option<f64>) -> Result<TimeVerdict, TimeDefect> {
        Self::range(time_s)?;
        let stamp = Stamp { time_s, arrival_s };
        let run = self.run.map_or(Run::from(stamp), |run| run.and(stamp));
        self.run = Some(run);
        let is_regular = run.is_regular(LATE_RUN_S, LATE_JITTER_S).unwrap_or(false);
        Ok(match self.last {
            Some(last) if run.count >= RUN && is_regular => self.accept_base(&run, &last),
            _ => TimeVerdict::Continues,
        })
    }

    /// Accepts the time base of a run.
    fn accept_base(&mut self, run: &Run, last: &Stamp) -> TimeVerdict {
        let ahead_s = run.last.time_s - last.time_s;
        // Jitter cannot make the time go back.
        let elapsed_s = (ahead_s - self.step_s(run, last)).max(MIN_ELAPSED_S);
        self.lead_s = run.lead_s;
        self.accept(run.last);
        TimeVerdict::NewBase {
            elapsed_s,
            step_s: ahead_s - elapsed_s,
        }
    }

    /// Returns the lead of a stamp, in seconds, over its expected time: the later of the last stamp
    /// plus the time since its arrival, and the arrival time plus the lead of the messages with the
    /// smallest delay.
    fn lead_over_expected_s(&self, stamp: &Stamp, last: &Stamp) -> Option<f64> {
        let by_last_s = stamp.time_s - last.time_s - stamp.waited_s(last)?;
        let by_lead_s = stamp.lead_s()? - self.lead_s?;
        Some(by_last_s.min(by_lead_s))
    }

    /// Returns the step of the clock in seconds: the change of the lead of the messages with the
    /// smallest delay. Without arrival times, the step is calculated as if no message had been
    /// lost.
    fn step_s(&self, run: &Run, last: &Stamp) -> f64 {
        match (run.lead_s, self.lead_s) {
            (Some(after_s), Some(before_s)) => after_s - before_s,
            _ => run.first.time_s - last.time_s - run.spacing_s(),
        }
    }

    fn accept(&mut self, stamp: Stamp) {
        if let Some(lead_s) = stamp.lead_s() {
            let waited_s = self.last.and_then(|last| stamp.waited_s(&last));
            let aged = |lead_s: f64| lead_s - DRIFT * waited_s.unwrap_or(0.0);
            self.lead_s = Some(self.lead_s.map_or(lead_s, |it| aged(it).max(lead_s)));
        }
        self.last = Some(stamp);
        self.run = None;
        self.rejected = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.02;

    /// Returns the state after messages at 50 Hz, of which number 49 was accepted last, at 0.98 s
    /// plus `epoch_s`.
    fn warm(epoch_s: f64) -> TimeCheck {
        let mut check = TimeCheck::default();
        for number in 0..50 {
            let arrival_s = f64::from(number) * PERIOD_S;
            let verdict = check.next(epoch_s + arrival_s, Some(arrival_s), false, MAX_LEAD_S);
            assert_eq!(verdict, Ok(TimeVerdict::Continues));
        }
        check
    }

    #[test]
    fn one_implausible_stamp_is_rejected_and_the_next_good_one_accepted() {
        for (time_s, name) in [
            (3.0, "time in the future"),
            (1e300, "time out of range"),
            (f64::NAN, "time not finite"),
            (0.98, "time repeated"),
            (0.97, "time backward"),
            (0.0, "time backward"),
            (-1e300, "time out of range"),
        ] {
            let mut check = warm(0.0);
            let error = check
                .next(time_s, Some(1.0), false, MAX_LEAD_S)
                .unwrap_err();
            assert_eq!(error.name(), name, "{time_s}: {error}");
            let good = check.next(1.02, Some(1.02), false, MAX_LEAD_S);
            assert_eq!(good, Ok(TimeVerdict::Continues));
        }
    }

    #[test]
    fn a_repeated_message_never_becomes_the_time_base() {
        let mut check = warm(0.0);
        for number in 50..5000 {
            let error = check.next(0.98, Some(f64::from(number) * PERIOD_S), true, MAX_LEAD_S);
            assert!(matches!(
                error,
                Err(TimeDefect::Repeated { is_copy: true, .. })
            ));
        }
    }

    #[test]
    fn a_step_of_the_clock_is_recognized_within_half_a_second() {
        for (step_s, period_s) in [(-5.0, 0.02), (60.0, 0.02), (1.7e9, 0.1), (-0.5, 0.02)] {
            let mut check = warm(0.0);
            let mut rejected = 0;
            loop {
                rejected += 1;
                let arrival_s = 0.98 + f64::from(rejected) * period_s;
                match check.next(arrival_s + step_s, Some(arrival_s), false, MAX_LEAD_S) {
                    Err(error) => assert!(matches!(
                        error,
                        TimeDefect::Backward { .. } | TimeDefect::Future { .. }
                    )),
                    Ok(TimeVerdict::NewBase {
                        elapsed_s,
                        step_s: found_s,
                    }) => {
                        assert!((elapsed_s - f64::from(rejected) * period_s).abs() < 1e-9);
                        assert!((found_s - step_s).abs() < 1e-6);
                        break;
                    }
                    Ok(TimeVerdict::Continues) => panic!("{step_s} continues"),
                }
                assert!(f64::from(rejected) * period_s < 0.5, "{step_s}: {rejected}");
            }
            assert!(rejected >= RUN);
        }
    }

    #[test]
    fn delayed_and_then_delivered_messages_are_all_accepted() {
        let mut check = warm(0.0);
        // 3 s of messages arrive at once, every tenth is lost; then they are in time again.
        for number in 50..400 {
            let time_s = f64::from(number) * PERIOD_S;
            if number % 10 != 0 {
                let verdict = check.next(time_s, Some(time_s.max(4.0)), false, MAX_LEAD_S);
                assert_eq!(verdict, Ok(TimeVerdict::Continues), "{number}");
            }
        }
        // After a backlog with most messages lost, one step is longer than a second.
        let mut check = warm(0.0);
        assert!(check.next(1.0, Some(6.0), false, MAX_LEAD_S).is_ok());
        assert!(check.next(5.0, Some(6.0), false, MAX_LEAD_S).is_ok());
    }

    #[test]
    fn a_backlog_that_is_sent_again_is_rejected_until_it_is_over() {
        let mut check = warm(0.0);
        for number in 20..50 {
            let verdict = check.next(f64::from(number) * PERIOD_S, Some(1.0), false, MAX_LEAD_S);
            assert!(verdict.is_err(), "{number}");
        }
        assert_eq!(
            check.next(1.0, Some(1.0), false, MAX_LEAD_S),
            Ok(TimeVerdict::Continues)
        );
    }

    #[test]
    fn a_gap_of_messages_is_not_reported_as_a_clock_step() {
        let mut check = warm(0.0);
        let verdict = check.next(8.98, Some(9.01), false, MAX_LEAD_S);
        assert_eq!(verdict, Ok(TimeVerdict::Continues));
        // Without arrival times, a step ahead cannot be distinguished from a gap, and is accepted.
        let mut check = TimeCheck::default();
        for time_s in [0.0, 0.02, 500.0] {
            assert!(check.next(time_s, None, false, MAX_LEAD_S).is_ok());
        }
    }

    #[test]
    fn without_arrival_times_a_backward_step_requires_several_messages() {
        let mut check = TimeCheck::default();
        for number in 0..100 {
            assert!(
                check
                    .next(f64::from(number) * PERIOD_S, None, false, MAX_LEAD_S)
                    .is_ok()
            );
        }
        for number in 0..RUN - 1 {
            let verdict = check.next(f64::from(number) * PERIOD_S, None, false, MAX_LEAD_S);
            assert!(verdict.is_err(), "{number}");
        }
        let time_s = f64::from(RUN - 1) * PERIOD_S;
        let verdict = check.next(time_s, None, false, MAX_LEAD_S);
        let Ok(TimeVerdict::NewBase { elapsed_s, .. }) = verdict else {
            panic!("{verdict:?}");
        };
        assert!((elapsed_s - f64::from(RUN) * PERIOD_S).abs() < 1e-9);
    }

    #[test]
    fn wrong_units_are_reported_and_never_become_the_time_base() {
        for unit in TimeUnit::ALL {
            // Times since start-up of the computer, and since 1970.
            for epoch_s in [3.0, 1.7e9] {
                let mut check = TimeCheck::default();
                let mut named = false;
                for number in 0..500 {
                    let arrival_s = f64::from(number) * PERIOD_S;
                    let time_s = (epoch_s + arrival_s) * unit.per_second();
                    match check.next(time_s, Some(arrival_s), false, MAX_LEAD_S) {
                        Ok(verdict) => assert_eq!((number, verdict), (0, TimeVerdict::Continues)),
                        Err(error) => named |= error.to_string().contains(&unit.to_string()),
                    }
                }
                assert!(named, "{unit} {epoch_s}");
            }
        }
    }

    #[test]
    fn leading_zeros_are_rejected_until_the_clock_is_set() {
        let mut check = TimeCheck::default();
        for number in 0..20 {
            let verdict = check.next(0.0, Some(f64::from(number) * PERIOD_S), true, MAX_LEAD_S);
            assert_eq!(verdict.is_ok(), number == 0);
        }
        let accepted = (20..40).find(|number| {
            let arrival_s = f64::from(*number) * PERIOD_S;
            check
                .next(1.7e9 + arrival_s, Some(arrival_s), false, MAX_LEAD_S)
                .is_ok()
        });
        assert!(accepted.is_some());
    }

    /// Angles of six radio heads at 25 Hz, each 6 ms after its measurement, whose clock is back by 0.2 s from 2 s to 4 s.
    #[test]
    fn a_clock_that_is_set_back_by_less_than_a_second_is_compensated_until_it_is_corrected() {
        use super::super::clocks::Clocks;
        let mut clocks = Clocks::default();
        let (mut accepted, mut wrong_s) = (0, Vec::new());
        for number in 0..900 {
            let true_s = 0.04 * f64::from(number / 6) + 3e-4 * f64::from(number % 6);
            clocks.arrival_s = Some(true_s + 0.006);
            let is_back = (2.0..4.0).contains(&true_s);
            let by_s = if is_back { -0.2 } else { 0.0 };
            if let Ok(time_s) = clocks.accept_burst("angle", true_s + by_s, None) {
                accepted += 1;
                if (time_s - true_s).abs() > 0.01 {
                    wrong_s.push(true_s);
                }
            }
        }
        // The angles of the first 0.12 s are used with a wrong time, and those of 0.2 s are rejected at the correction.
        let is_before = |true_s: &f64| (2.0..2.13).contains(true_s);
        assert!(wrong_s.iter().all(is_before), "{wrong_s:?}");
        assert!(accepted >= 900 - 6 * 6, "{accepted}");
    }

    /// The angles of one radio head are always 0.15 s late.
    #[test]
    fn late_angles_between_angles_in_time_are_no_clock_step() {
        let mut check = TimeCheck::default();
        for number in 0..200 {
            let arrival_s = 0.02 * f64::from(number);
            let is_late = number % 2 == 1;
            let time_s = if is_late { arrival_s - 0.15 } else { arrival_s };
            let verdict = if is_late {
                check.late(time_s, Some(arrival_s))
            } else {
                check.next(time_s, Some(arrival_s), false, MAX_LEAD_S)
            };
            assert_eq!(verdict, Ok(TimeVerdict::Continues), "{number}");
        }
    }
}
