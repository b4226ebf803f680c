//! Recorded wheel odometry, whatever file it came from.

use std::fmt;
use std::fmt::Write as _;
use std::path::Path;

use crate::csv::Table;
use crate::error::RecordingError;
use crate::file as files;
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
    /// Whether a time is that of the drive, up to a second before it or after.
    pub fn covers(&self, time_s: f64) -> bool {
        let (first, last) = (self.samples.first(), self.samples.last());
        first.is_some_and(|it| time_s >= it.time_s - 1.0)
            && last.is_some_and(|it| time_s <= it.time_s + 1.0)
    }
}

/// What is remarkable about one item of an odometry file.
#[derive(Debug, Clone, PartialEq)]
pub struct OdometryRemark {
    /// Line of the CSV file or number of the MCAP message, from 1.
    pub item: usize,
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
    /// A value is NaN or infinite.
    NotFinite,
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
}

impl OdometryIssue {
    /// Whether the item was used all the same.
    pub const fn used(&self) -> bool {
        matches!(self, Self::Gap { .. })
    }
}

impl fmt::Display for OdometryRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "odometry item {}: ", self.item)?;
        match &self.issue {
            OdometryIssue::Malformed(message) => write!(f, "left out, {message}"),
            OdometryIssue::NotFinite => f.write_str("left out, a value is not finite"),
            OdometryIssue::Duplicate { time_s } => {
                write!(f, "left out, a second sample at {time_s} s")
            }
            OdometryIssue::TimeReversed { time_s, before_s } => {
                write!(f, "left out, {time_s} s comes after {before_s} s")
            }
            OdometryIssue::Gap { gap_s } => write!(f, "{gap_s:.3} s after the one before"),
        }
    }
}

/// Takes items one by one and keeps the usable ones.
#[derive(Debug, Default)]
pub struct OdometryCollector {
    log: OdometryLog,
    /// Item of each sample.
    items: Vec<usize>,
}

impl OdometryCollector {
    pub fn add(&mut self, item: usize, sample: Result<OdometrySample, String>) {
        let issue = match sample {
            Err(message) => OdometryIssue::Malformed(message),
            Ok(sample) if !is_finite(&sample) => OdometryIssue::NotFinite,
            Ok(sample) => match self.log.samples.last() {
                Some(last) if sample.time_s == last.time_s => OdometryIssue::Duplicate {
                    time_s: sample.time_s,
                },
                Some(last) if sample.time_s < last.time_s => OdometryIssue::TimeReversed {
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
            time_s,
            issue,
        };
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
                time_s: sample.time_s,
                issue: OdometryIssue::Gap { gap_s },
            })
            .collect();
        self.log.remarks.extend(gaps);
        self.log.remarks.sort_by_key(|remark| remark.item);
        self.log
    }
}

fn is_finite(sample: &OdometrySample) -> bool {
    let yaw_rate_radps = sample.yaw_rate_radps.unwrap_or(0.0);
    [
        sample.time_s,
        sample.distance_m,
        sample.speed_mps,
        yaw_rate_radps,
    ]
    .iter()
    .all(|value| value.is_finite())
}

/// Reads odometry from a CSV file with the columns `time_s`, `distance_m`, `speed_mps` and, where
/// the vehicle has a gyroscope, `yaw_rate_radps`.
///
/// # Errors
/// [`RecordingError`] when the file cannot be read or lacks a column. Single rows are only remarked
/// upon.
pub fn read_odometry_csv(file: &Path) -> Result<OdometryLog, RecordingError> {
    let required = ["time_s", "distance_m", "speed_mps"];
    let table = Table::read(file, &required, &["yaw_rate_radps"])?;
    let mut collector = OdometryCollector::default();
    for row in table.rows {
        let sample = row.values.map(|values| {
            let value = |index: usize| values.get(index).copied().flatten();
            OdometrySample {
                time_s: value(0).unwrap_or(f64::NAN),
                distance_m: value(1).unwrap_or(f64::NAN),
                speed_mps: value(2).unwrap_or(f64::NAN),
                yaw_rate_radps: value(3),
            }
        });
        collector.add(row.line, sample);
    }
    Ok(collector.finish())
}

/// Writes odometry as [`read_odometry_csv`] reads it.
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write_odometry_csv(file: &Path, samples: &[OdometrySample]) -> Result<(), RecordingError> {
    let with_yaw = samples.iter().any(|sample| sample.yaw_rate_radps.is_some());
    let mut text = String::from("time_s,distance_m,speed_mps");
    text += if with_yaw { ",yaw_rate_radps\n" } else { "\n" };
    for sample in samples {
        // Writing into a string does not fail.
        let _ = write!(
            text,
            "{},{},{}",
            sample.time_s, sample.distance_m, sample.speed_mps
        );
        if with_yaw {
            text.push(',');
            if let Some(rate) = sample.yaw_rate_radps {
                let _ = write!(text, "{rate}");
            }
        }
        text.push('\n');
    }
    files::write(file, text.as_bytes())
}
