//! Repeated events of one cause, collapsed to one counted event.

use crate::inbox::Level;

/// Minimum time between two reports of one cause, in seconds: a fault is reported within 2 s.
const FIRST_INTERVAL_S: f64 = 1.0;
/// Maximum time between two reports of a cause that continues, in seconds.
const MAX_INTERVAL_S: f64 = 60.0;
/// A cause that has not occurred for this long has ended, in seconds; the next occurrence is reported at once.
const END_S: f64 = 10.0;
/// Maximum number of causes that are remembered. The oldest is forgotten first.
const MAX_CAUSES: usize = 64;

/// A report of one or more occurrences of one cause.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// Severity.
    pub level: Level,
    /// Part of the node that reports.
    pub source: &'static str,
    /// Description of the last occurrence.
    pub text: String,
    /// Number of occurrences since the last report of this cause.
    pub count: u64,
}

struct Cause {
    level: Level,
    source: &'static str,
    key: String,
    text: String,
    /// Occurrences that have not been reported.
    pending: u64,
    reported_s: f64,
    occurred_s: f64,
    interval_s: f64,
}

/// Decides which events are reported, and when.
///
/// The first occurrence of a cause is reported at once. Further occurrences are counted and reported together,
/// first after 1 s, then after twice the last interval, up to 60 s. An `Info` event of a source (such as a
/// recovery) resets the intervals of that source to 1 s.
#[derive(Default)]
pub struct Collapse {
    causes: Vec<Cause>,
}

impl Collapse {
    /// Adds an occurrence at `now_s`; returns the report if one is due.
    pub fn add(
        &mut self,
        now_s: f64,
        level: Level,
        source: &'static str,
        text: String,
    ) -> Option<Report> {
        let key = key(&text);
        if level == Level::Info {
            let same_source = self.causes.iter_mut().filter(|it| it.source == source);
            same_source.for_each(|it| it.interval_s = FIRST_INTERVAL_S);
        }
        let is_same = |it: &Cause| it.source == source && it.level == level && it.key == key;
        let Some(cause) = self.causes.iter_mut().find(|it| is_same(it)) else {
            if self.causes.len() >= MAX_CAUSES {
                self.forget_oldest();
            }
            self.causes.push(Cause {
                level,
                source,
                key,
                text: text.clone(),
                pending: 0,
                reported_s: now_s,
                occurred_s: now_s,
                interval_s: FIRST_INTERVAL_S,
            });
            return Some(Report {
                level,
                source,
                text,
                count: 1,
            });
        };
        let has_ended = (now_s - cause.occurred_s).abs() >= END_S;
        (cause.text, cause.occurred_s) = (text, now_s);
        cause.pending += 1;
        if has_ended {
            cause.interval_s = FIRST_INTERVAL_S;
        }
        (has_ended || cause.is_due(now_s)).then(|| cause.report(now_s))
    }

    /// Returns the reports of repeated occurrences that are due at `now_s`; all of them if `all`.
    pub fn due(&mut self, now_s: f64, all: bool) -> Vec<Report> {
        self.causes
            .iter_mut()
            .filter(|it| it.pending > 0 && (all || it.is_due(now_s)))
            .map(|it| it.report(now_s))
            .collect()
    }

    fn forget_oldest(&mut self) {
        let oldest = self.causes.iter().enumerate();
        let oldest = oldest.min_by(|(_, a), (_, b)| a.occurred_s.total_cmp(&b.occurred_s));
        if let Some((index, _)) = oldest {
            self.causes.remove(index);
        }
    }
}

impl Cause {
    fn is_due(&self, now_s: f64) -> bool {
        (now_s - self.reported_s).abs() >= self.interval_s
    }

    fn report(&mut self, now_s: f64) -> Report {
        if self.pending > 1 || self.interval_s > FIRST_INTERVAL_S {
            self.interval_s = (2.0 * self.interval_s).min(MAX_INTERVAL_S);
        }
        self.reported_s = now_s;
        Report {
            level: self.level,
            source: self.source,
            text: self.text.clone(),
            count: std::mem::take(&mut self.pending),
        }
    }
}

/// Returns the text without measured values: numbers with a decimal point are replaced, because they differ
/// between occurrences of one cause. Whole numbers remain, because they identify cells and channels.
pub fn key(text: &str) -> String {
    let mut key = String::with_capacity(text.len());
    let mut number = String::new();
    let end = |number: &mut String, key: &mut String| {
        let value = number.trim_end_matches('.');
        let is_decimal = value.contains('.') && value.parse::<f64>().is_ok();
        key.push_str(if is_decimal { "#" } else { value });
        key.push_str(&number[value.len()..]);
        number.clear();
    };
    for letter in text.chars() {
        let is_number = letter.is_ascii_digit()
            || (letter == '.' && !number.is_empty())
            || (letter == '-' && number.is_empty());
        if is_number {
            number.push(letter);
        } else {
            end(&mut number, &mut key);
            key.push(letter);
        }
    }
    end(&mut number, &mut key);
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_distinguish_causes_and_measured_values_do_not() {
        for (text, expected) in [
            (
                "no data has arrived for 0.5 s",
                "no data has arrived for # s",
            ),
            (
                "odometry goes back to -1.250 s.",
                "odometry goes back to # s.",
            ),
            ("PCI 12 is faulty", "PCI 12 is faulty"),
            ("tcp://127.0.0.1:5000 ended", "tcp://127.0.0.1:5000 ended"),
            ("2. then 3.5", "2. then #"),
        ] {
            assert_eq!(key(text), expected);
        }
    }

    /// Occurrences and reports of a cause at 50 Hz for a time, with those due in between.
    fn run(collapse: &mut Collapse, from_s: f64, duration_s: f64) -> Vec<(f64, u64)> {
        let mut reports = Vec::new();
        for number in 0..(50.0 * duration_s) as u32 {
            let now_s = from_s + 0.02 * f64::from(number);
            let text = format!("left out: {now_s:.3} s is too old");
            let now = collapse.add(now_s, Level::Warn, "odometry", text);
            reports.extend(now.into_iter().map(|it| (now_s, it.count)));
        }
        reports
    }

    #[test]
    fn a_cause_that_continues_is_reported_at_once_and_then_counted() {
        let mut collapse = Collapse::default();
        let reports = run(&mut collapse, 0.0, 100.0);
        let times_s: Vec<f64> = reports.iter().map(|it| it.0.round()).collect();
        assert_eq!(times_s, [0.0, 1.0, 3.0, 7.0, 15.0, 31.0, 63.0]);
        let rest = collapse.due(100.0, true);
        assert_eq!(rest.len(), 1);
        let counted: u64 = reports.iter().map(|it| it.1).sum();
        assert_eq!(counted + rest[0].count, 5000);
        // Another cause, and the same cause after its end, are reported at once.
        assert!(
            collapse
                .add(100.0, Level::Warn, "odometry", "other".to_owned())
                .is_some()
        );
        assert_eq!(run(&mut collapse, 120.0, 0.1), [(120.0, 1)]);
    }

    #[test]
    fn a_failure_after_a_recovery_is_reported_within_a_second() {
        let mut collapse = Collapse::default();
        let mut delays_s = Vec::new();
        for number in 0..10 {
            let failed_s = 5.0 * f64::from(number);
            let text = || "failed".to_owned();
            let at_once = collapse.add(failed_s, Level::Warn, "mcap", text());
            delays_s.push(if at_once.is_some() {
                0.0
            } else {
                f64::INFINITY
            });
            collapse.add(
                failed_s + 2.0,
                Level::Info,
                "mcap",
                "works again".to_owned(),
            );
        }
        assert_eq!(delays_s, [0.0; 10]);
        // A repetition within the first second is reported at its end.
        assert!(
            collapse
                .add(45.5, Level::Warn, "mcap", "failed".to_owned())
                .is_none()
        );
        assert!(collapse.due(45.9, false).is_empty());
        assert_eq!(collapse.due(46.0, false)[0].count, 1);
    }

    #[test]
    fn the_number_of_causes_is_bounded() {
        let mut collapse = Collapse::default();
        for number in 0..10_000 {
            let text = format!("cell {number}");
            assert!(
                collapse
                    .add(f64::from(number), Level::Warn, "samples", text)
                    .is_some()
            );
        }
        assert_eq!(collapse.causes.len(), MAX_CAUSES);
    }
}
