//! Interruptions of the samples.

use std::time::{Duration, Instant};

use crate::clock::{CATCH_UP_S, CAUGHT_UP_S, INTERRUPTION_S};

/// Time within which all SSBs are found again after an interruption.
const RECENT: Duration = Duration::from_secs(2);

/// Newest samples and odometry at one time.
#[derive(Debug, Clone, Copy)]
struct Mark {
    came: Instant,
    samples_s: f64,
    odometry_s: Option<f64>,
}

/// Interruption without a decision yet.
#[derive(Debug, Clone, Copy)]
struct Undecided {
    /// Last samples before the interruption.
    before: Mark,
    /// Time of the last postponement of the decision.
    since: Instant,
    /// Missing time at the last postponement, in seconds.
    missing_s: f64,
}

/// Finding from an arrival of samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Arrival {
    /// Whether samples resumed after an interruption.
    pub resumed: bool,
    /// Time by which the odometry advanced more than the samples, in seconds: they are missing.
    pub missing_s: Option<f64>,
}

/// Detector of interruptions from arrival times, and of missing samples from the time of the
/// odometry. A simulator that pauses interrupts both.
#[derive(Debug, Default)]
pub struct Interruptions {
    last: Option<Mark>,
    /// Interruption whose samples may be late or missing.
    undecided: Option<Undecided>,
    /// Time at which samples resumed last.
    resumed: Option<Instant>,
}

impl Interruptions {
    /// Processes the arrival of samples up to `samples_s`, while `odometry_s` is the time of the
    /// newest odometry.
    pub fn samples(&mut self, came: Instant, samples_s: f64, odometry_s: Option<f64>) -> Arrival {
        let now = Mark {
            came,
            samples_s,
            odometry_s,
        };
        let Some(last) = self.last.replace(now) else {
            return Arrival::default();
        };
        let since = |instant| came.saturating_duration_since(instant);
        if since(last.came) >= Duration::from_secs_f64(INTERRUPTION_S) {
            let before = self.undecided.map_or(last, |it| it.before);
            self.undecided = Some(Undecided {
                before,
                since: came,
                missing_s: f64::INFINITY,
            });
            self.resumed = Some(came);
            return Arrival {
                resumed: true,
                missing_s: None,
            };
        }
        let mut missing_s = None;
        if let Some(undecided) = &mut self.undecided {
            let driven_s = |it: &Mark| Some(odometry_s? - it.odometry_s?);
            let received_s = samples_s - undecided.before.samples_s;
            let now_missing_s = driven_s(&undecided.before).map_or(0.0, |it| it - received_s);
            if undecided.missing_s - now_missing_s >= CAUGHT_UP_S {
                (undecided.since, undecided.missing_s) = (came, now_missing_s);
            } else if since(undecided.since) >= Duration::from_secs_f64(CATCH_UP_S) {
                missing_s = Some(now_missing_s).filter(|it| *it >= INTERRUPTION_S);
                self.undecided = None;
            }
        }
        Arrival {
            resumed: false,
            missing_s,
        }
    }

    /// Whether samples resumed so shortly before `now` that SSBs at unexpected times belong to this
    /// interruption.
    pub fn is_recent(&self, now: Instant) -> bool {
        let is_recent = |at| now.saturating_duration_since(at) < RECENT;
        self.resumed.is_some_and(is_recent)
    }

    /// Removes all arrivals, for a new start.
    pub const fn reset(&mut self) {
        (self.last, self.undecided, self.resumed) = (None, None, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of 10 ms for 2 s with an interruption at 0.5 s for `absent_s`; samples of `late_s`
    /// arrive later in one block.
    fn arrivals(absent_s: f64, late_s: f64, odometry_stops: bool) -> (usize, Vec<f64>) {
        let (start, mut interruptions) = (Instant::now(), Interruptions::default());
        let (mut resumed, mut missing) = (0, Vec::new());
        for number in 0..200 {
            let sent_s = 0.01 * f64::from(number);
            let pause_s = if sent_s < 0.5 { 0.0 } else { absent_s };
            let odometry_s = sent_s + if odometry_stops { 0.0 } else { pause_s };
            let caught_up_s = if sent_s < 0.5 { 0.0 } else { late_s };
            let came = start + Duration::from_secs_f64(sent_s + pause_s);
            let arrival = interruptions.samples(came, sent_s + caught_up_s, Some(odometry_s));
            resumed += usize::from(arrival.resumed);
            missing.extend(arrival.missing_s);
        }
        (resumed, missing)
    }

    #[test]
    fn missing_samples_late_samples_and_pauses_are_distinguished() {
        let (resumed, missing) = arrivals(6.0, 0.0, false);
        assert_eq!((resumed, missing.len()), (1, 1));
        assert!((missing[0] - 6.0).abs() < 1e-6, "{missing:?}");
        assert_eq!(arrivals(6.0, 6.0, false), (1, vec![]));
        assert_eq!(arrivals(6.0, 0.0, true), (1, vec![]));
        assert_eq!(arrivals(0.1, 0.0, false), (0, vec![]));
    }
}
