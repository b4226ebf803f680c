//! Recorded wheel odometry, whatever file it came from.

use std::fmt;

use onboard::observation::OdometrySample;

/// A step in time this many times the usual one is a gap.
const GAP_STEPS: f64 = 5.0;

/// Odometry in order of time, and what was wrong with single items of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OdometryLog {
    /// The usable samples, of strictly increasing time.
    pub samples: Vec<OdometrySample>,
    /// What to know of single items.
    pub remarks: Vec<OdometryRemark>,
}

impl OdometryLog {
    /// Times of the first and the last sample (s).
    pub fn interval_s(&self) -> Option<[f64; 2]> {
        let (first, last) = (self.samples.first()?, self.samples.last()?);
        Some([first.time_s, last.time_s])
    }

    /// Whether a time is that of the drive, up to a second before it or after.
    pub fn covers(&self, time_s: f64) -> bool {
        let covers = |[first_s, last_s]: [f64; 2]| (first_s - 1.0..=last_s + 1.0).contains(&time_s);
        self.interval_s().is_some_and(covers)
    }
}

/// What is remarkable about one item of an odometry file.
#[derive(Debug, Clone, PartialEq)]
pub struct OdometryRemark {
    /// Line of the CSV file or number of the MCAP message, from 1.
    pub item: usize,
    /// What it is the number of: "line" or "message".
    pub kind: &'static str,
    /// Time of the last usable sample before it, or its own if it is used, in seconds.
    pub time_s: f64,
    /// What it is.
    pub issue: OdometryIssue,
}

/// Why an odometry item was left out; a gap only is pointed at.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum OdometryIssue {
    /// It cannot be read.
    Malformed(String),
    /// A value is missing, NaN or infinite.
    NotFinite {
        /// Its column.
        column: &'static str,
    },
    /// The time of the sample before.
    Duplicate {
        /// That time in seconds.
        time_s: f64,
    },
    /// Earlier than the sample before.
    TimeReversed {
        /// Its time in seconds.
        time_s: f64,
        /// The time of the one before.
        before_s: f64,
    },
    /// Used, but long after the sample before.
    Gap {
        /// Time since the sample before, in seconds.
        gap_s: f64,
    },
    /// The file was not closed, so that its last items may be missing; the text names the file.
    Truncated(String),
    /// A column is made of something else.
    Derived {
        /// The column.
        column: &'static str,
        /// What it is taken from.
        from: String,
    },
    /// Something else that could have told, and cannot.
    Unused {
        /// What it is.
        source: String,
        /// Why not.
        why: String,
    },
}

impl OdometryRemark {
    /// A remark on the file itself, of items of a kind.
    pub(crate) fn of_file(kind: &'static str, issue: OdometryIssue) -> Self {
        Self {
            item: 1,
            kind,
            time_s: f64::NEG_INFINITY,
            issue,
        }
    }
}

impl OdometryIssue {
    /// Whether the item was used all the same.
    pub const fn used(&self) -> bool {
        matches!(
            self,
            Self::Gap { .. } | Self::Derived { .. } | Self::Unused { .. } | Self::Truncated(_)
        )
    }
}

impl fmt::Display for OdometryRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.issue {
            OdometryIssue::Derived { .. }
            | OdometryIssue::Unused { .. }
            | OdometryIssue::Truncated(_) => {
                f.write_str("odometry: ")?;
            }
            _ => write!(f, "odometry {} {}: ", self.kind, self.item)?,
        }
        match &self.issue {
            OdometryIssue::Truncated(text) => f.write_str(text),
            OdometryIssue::Malformed(message) => write!(f, "left out, {message}"),
            OdometryIssue::NotFinite { column } => {
                write!(f, "left out, {column} is missing or not finite")
            }
            OdometryIssue::Duplicate { time_s } => {
                write!(f, "left out, a second sample at {time_s} s")
            }
            OdometryIssue::TimeReversed { time_s, before_s } => {
                write!(f, "left out, {time_s} s comes after {before_s} s")
            }
            OdometryIssue::Gap { gap_s } => write!(f, "{gap_s:.3} s after the one before"),
            OdometryIssue::Derived { column, from } => {
                write!(f, "{column} is taken from {from}")
            }
            OdometryIssue::Unused { source, why } => {
                write!(f, "{source} is not used, it is {why}")
            }
        }
    }
}

/// Takes items one by one and keeps the usable ones.
#[derive(Debug)]
pub struct OdometryCollector {
    log: OdometryLog,
    kind: &'static str,
    /// Item of each sample.
    items: Vec<usize>,
}

impl OdometryCollector {
    /// Of items of a kind: "line" or "message".
    pub fn of(kind: &'static str) -> Self {
        Self {
            log: OdometryLog::default(),
            kind,
            items: Vec::new(),
        }
    }

    pub fn add(&mut self, item: usize, sample: Result<OdometrySample, String>) {
        let issue = match sample {
            Err(message) => OdometryIssue::Malformed(message),
            Ok(sample) => match (not_finite(&sample), self.log.samples.last()) {
                (Some(column), _) => OdometryIssue::NotFinite { column },
                (None, Some(last)) if sample.time_s == last.time_s => OdometryIssue::Duplicate {
                    time_s: sample.time_s,
                },
                (None, Some(last)) if sample.time_s < last.time_s => OdometryIssue::TimeReversed {
                    time_s: sample.time_s,
                    before_s: last.time_s,
                },
                _ => {
                    self.log.samples.push(sample);
                    self.items.push(item);
                    return;
                }
            },
        };
        let time_s = self.last().map_or(f64::NEG_INFINITY, |last| last.time_s);
        let remark = OdometryRemark {
            item,
            kind: self.kind,
            time_s,
            issue,
        };
        self.log.remarks.push(remark);
    }

    /// Remarks on the file itself.
    pub fn remark(&mut self, issue: OdometryIssue) {
        let remark = OdometryRemark::of_file(self.kind, issue);
        self.log.remarks.push(remark);
    }

    /// Last distance, for sources that tell places instead.
    pub fn last(&self) -> Option<&OdometrySample> {
        self.log.samples.last()
    }

    pub fn finish(mut self) -> OdometryLog {
        let steps = |log: &OdometryLog| -> Vec<f64> {
            let pairs = log.samples.windows(2);
            pairs
                .filter_map(|pair| match pair {
                    [a, b] => Some(b.time_s - a.time_s),
                    _ => None,
                })
                .collect()
        };
        let steps_s = steps(&self.log);
        let mut sorted = steps_s.clone();
        sorted.sort_by(f64::total_cmp);
        let usual_s = sorted
            .get(sorted.len() / 2)
            .copied()
            .unwrap_or(f64::INFINITY);
        let ends = self.log.samples.iter().zip(&self.items).skip(1);
        let gaps: Vec<_> = steps_s
            .iter()
            .zip(ends)
            .filter(|(gap_s, _)| **gap_s > GAP_STEPS * usual_s)
            .map(|(&gap_s, (sample, &item))| OdometryRemark {
                item,
                kind: self.kind,
                time_s: sample.time_s,
                issue: OdometryIssue::Gap { gap_s },
            })
            .collect();
        self.log.remarks.extend(gaps);
        self.log.remarks.sort_by_key(|remark| remark.item);
        self.log
    }
}

/// A column whose value is none.
fn not_finite(sample: &OdometrySample) -> Option<&'static str> {
    let values = [
        ("time_s", sample.time_s),
        ("distance_m", sample.distance_m),
        ("speed_mps", sample.speed_mps),
        ("yaw_rate_radps", sample.yaw_rate_radps.unwrap_or(0.0)),
    ];
    let mut wrong = values.iter().filter(|(_, value)| !value.is_finite());
    wrong.next().map(|(column, _)| *column)
}
