//! Interruptions of the samples.

use std::time::{Duration, Instant};

use crate::clock::{CATCH_UP_S, CAUGHT_UP_S, INTERRUPTION_S};

/// Time within which all SSBs are found again after an interruption.
const RECENT: Duration = Duration::from_secs(2);

/// Newest samples and odometry at an instant.
#[derive(Debug, Clone, Copy)]
struct Mark {
    came: Instant,
    samples_s: f64,
    odometry_s: Option<f64>,
}

/// An interruption that is not decided.
#[derive(Debug, Clone, Copy)]
struct Undecided {
    /// The last samples before it.
    before: Mark,
    /// When the decision was put off last, and the missing time then, in seconds.
    since: Instant,
    missing_s: f64,
}

/// What an arrival of samples shows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Arrival {
    /// Whether samples resumed after an interruption.
    pub resumed: bool,
    /// Time by which the odometry advanced more than the samples, in seconds: they are missing.
    pub missing_s: Option<f64>,
}

/// Detects interruptions by arrival times, and missing samples by the time of the odometry: a simulator that
/// pauses interrupts both.
#[derive(Debug, Default)]
pub struct Interruptions {
    last: Option<Mark>,
    /// An interruption of which the samples may be late or missing.
    undecided: Option<Undecided>,
    /// When samples resumed last.
    resumed: Option<Instant>,
}

impl Interruptions {
    /// Takes in that samples up to `samples_s` came, while the newest odometry was of `odometry_s`.
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

    /// Whether samples resumed so recently before `now` that SSBs off their period belong to that interruption.
    pub fn is_recent(&self, now: Instant) -> bool {
        let is_recent = |at| now.saturating_duration_since(at) < RECENT;
        self.resumed.is_some_and(is_recent)
    }

    /// Forgets all arrivals, for a new start.
    pub const fn reset(&mut self) {
        (self.last, self.undecided, self.resumed) = (None, None, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples in blocks of 10 ms for 2 s, absent from 0.5 s for `absent_s`, of which `late_s` come later at once.
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
    fn missing_samples_are_told_from_late_ones_and_from_a_pause() {
        let (resumed, missing) = arrivals(6.0, 0.0, false);
        assert_eq!((resumed, missing.len()), (1, 1));
        assert!((missing[0] - 6.0).abs() < 1e-6, "{missing:?}");
        assert_eq!(arrivals(6.0, 6.0, false), (1, vec![]));
        assert_eq!(arrivals(6.0, 0.0, true), (1, vec![]));
        assert_eq!(arrivals(0.1, 0.0, false), (0, vec![]));
    }
}
