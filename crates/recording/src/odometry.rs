//! Recorded wheel odometry from any file format.

use std::fmt;

use onboard::observation::OdometrySample;

use crate::clock_faults::TimeFault;
use crate::counter_jumps::Jump;
use crate::value_spikes::{Limits, Spike, replace_spikes};

/// Minimum time step of a gap, in median steps.
const GAP_STEPS: f64 = 5.0;
/// Minimum time from the first item of a file to the first usable one (s) that is reported, because
/// the start pose is applied to the first usable item.
const LATE_START_S: f64 = 0.5;
/// Minimum magnitude of a number that is written with an exponent.
const LARGE: f64 = 1e6;

/// Odometry in order of time, with remarks on single items of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OdometryLog {
    /// Usable samples with strictly increasing times.
    pub samples: Vec<OdometrySample>,
    /// Defects and properties of single items.
    pub remarks: Vec<OdometryRemark>,
    /// Names of the quantities in the file.
    pub fields: OdometryFields,
    /// Whether distance and speed are from different fields, instead of one derived from the other.
    pub has_both: bool,
}

/// Names of the odometry quantities in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OdometryFields {
    /// Time (s).
    pub time: &'static str,
    /// Distance or position (m).
    pub distance: &'static str,
    /// Speed (m/s).
    pub speed: &'static str,
    /// Yaw rate (rad/s).
    pub yaw_rate: &'static str,
}

impl OdometryFields {
    /// Columns of a CSV file.
    pub const CSV: Self = Self {
        time: "time_s",
        distance: "distance_m",
        speed: "speed_mps",
        yaw_rate: "yaw_rate_radps",
    };
    /// Fields of `nav_msgs/msg/Odometry`.
    pub const ROS: Self = Self {
        time: "header.stamp",
        distance: "pose.pose.position",
        speed: "twist.twist.linear.x",
        yaw_rate: "twist.twist.angular.z",
    };
}

impl OdometryFields {
    /// Replaces the names of CSV columns in a text by the names of the file's fields.
    pub fn named(&self, text: &str) -> String {
        text.replace(Self::CSV.distance, self.distance)
            .replace(Self::CSV.speed, self.speed)
            .replace(Self::CSV.yaw_rate, self.yaw_rate)
    }
}

impl Default for OdometryFields {
    fn default() -> Self {
        Self::CSV
    }
}

impl OdometryLog {
    /// Returns the times of the first and the last sample (s).
    pub fn interval_s(&self) -> Option<[f64; 2]> {
        let (first, last) = (self.samples.first()?, self.samples.last()?);
        Some([first.time_s, last.time_s])
    }

    /// Whether a time is within the drive, with a tolerance of one second.
    pub fn covers(&self, time_s: f64) -> bool {
        let covers = |[first_s, last_s]: [f64; 2]| (first_s - 1.0..=last_s + 1.0).contains(&time_s);
        self.interval_s().is_some_and(covers)
    }
}

/// Remark on one item of an odometry file.
#[derive(Debug, Clone, PartialEq)]
pub struct OdometryRemark {
    /// Line of the CSV file or number of the MCAP message, from 1.
    pub item: usize,
    /// Unit of `item`: "line" or "message".
    pub kind: &'static str,
    /// Time of the item if it is used, otherwise of the previous usable sample, in seconds.
    pub time_s: f64,
    /// Kind of remark.
    pub issue: OdometryIssue,
}

/// Kind of a remark on an odometry item.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum OdometryIssue {
    /// The item cannot be read.
    Malformed(String),
    /// A value is missing, NaN or infinite.
    NotFinite {
        /// Name of the column.
        column: &'static str,
    },
    /// The value of a field is out of range.
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// Value of the field.
        value: f64,
        /// Allowed values.
        allowed: &'static str,
    },
    /// The time is before the clock was set.
    TimeNotSet {
        /// Name of the time field.
        field: &'static str,
        /// Value of the time (s).
        time_s: f64,
    },
    /// The time is before the clock was set; the time of recording is used instead.
    TimeRestored {
        /// Name of the time field.
        field: &'static str,
        /// Value of the time (s).
        time_s: f64,
    },
    /// The time is far ahead of the previous and following times.
    TimeAhead {
        /// Name of the time field.
        field: &'static str,
        /// Value of the time (s).
        time_s: f64,
    },
    /// The item is used, but its distance makes an impossible step, which is replaced by the speed
    /// of its neighbours.
    DistanceJump {
        /// Name of the distance field.
        field: &'static str,
        /// Step of the distance (m).
        step_m: f64,
        /// Speed of the neighbouring steps (m/s).
        speed_mps: f64,
    },
    /// The item is used, but a value is far from its neighbours, whose median is used instead.
    ValueSpike {
        /// Name of the field.
        field: &'static str,
        /// Value in the file.
        value: f64,
        /// Median of the neighbouring values.
        used: f64,
    },
    /// Property of the file as a sentence; the item is used.
    Noted(String),
    /// Property of the file that may cause a position error, as a sentence; the item is used.
    Doubtful(String),
    /// The time equals that of the previous sample.
    Duplicate {
        /// Time in seconds.
        time_s: f64,
    },
    /// The time is earlier than that of the previous sample.
    TimeReversed {
        /// Time in seconds.
        time_s: f64,
        /// Time of the previous sample in seconds.
        before_s: f64,
    },
    /// The item is used, but follows a gap in time.
    Gap {
        /// Time since the previous sample in seconds.
        gap_s: f64,
    },
    /// The file was not closed, so that its last items may be missing; the text names the file.
    Truncated(String),
    /// A column is derived from other columns.
    Derived {
        /// Name of the column.
        column: &'static str,
        /// Source of the column.
        from: String,
    },
    /// A possible source of a quantity is not used.
    Unused {
        /// Name of the source.
        source: String,
        /// Reason.
        why: String,
    },
}

impl OdometryRemark {
    /// Whether an item was left out, or items may be missing.
    pub const fn is_defect(&self) -> bool {
        !self.issue.used() || matches!(self.issue, OdometryIssue::Truncated(_))
    }

    /// Creates a remark on the file itself.
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
    /// Whether the item was used nevertheless.
    pub const fn used(&self) -> bool {
        matches!(
            self,
            Self::Gap { .. }
                | Self::Derived { .. }
                | Self::Unused { .. }
                | Self::DistanceJump { .. }
                | Self::ValueSpike { .. }
                | Self::TimeRestored { .. }
                | Self::Noted(_)
                | Self::Doubtful(_)
                | Self::Truncated(_)
        )
    }
}

impl fmt::Display for OdometryRemark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.issue {
            OdometryIssue::Derived { .. }
            | OdometryIssue::Unused { .. }
            | OdometryIssue::Noted(_)
            | OdometryIssue::Doubtful(_)
            | OdometryIssue::Truncated(_) => {
                f.write_str("odometry: ")?;
            }
            _ => write!(f, "odometry {} {}: ", self.kind, self.item)?,
        }
        match &self.issue {
            OdometryIssue::Malformed(message) => write!(f, "left out, {message}"),
            OdometryIssue::NotFinite { column } => {
                write!(f, "left out, {column} is missing or not finite")
            }
            OdometryIssue::OutOfRange {
                field,
                value,
                allowed,
            } => write!(f, "left out, {field} is {value:e}; {allowed}"),
            OdometryIssue::TimeNotSet { field, time_s } => write!(
                f,
                "left out, {field} is {time_s} s, before the clock was set"
            ),
            OdometryIssue::TimeRestored { field, time_s } => write!(
                f,
                "{field} is {time_s} s, before the clock was set; the time at which it was recorded is used \
                 instead"
            ),
            OdometryIssue::TimeAhead { field, time_s } => write!(
                f,
                "left out, {field} is {time_s} s, far ahead of the times before and after it"
            ),
            OdometryIssue::DistanceJump {
                field,
                step_m,
                speed_mps,
            } => write!(
                f,
                "{field} jumps by {} m; the speed of the steps next to it, {speed_mps:.3} m/s, is used \
                 instead",
                number(*step_m)
            ),
            OdometryIssue::ValueSpike { field, value, used } => write!(
                f,
                "{field} is {}, far from the values next to it; their median, {used:.3}, is used instead",
                number(*value)
            ),
            OdometryIssue::Noted(text)
            | OdometryIssue::Doubtful(text)
            | OdometryIssue::Truncated(text) => f.write_str(text),
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

/// Formats a number with three decimals, or with an exponent if it is large.
pub fn number(value: f64) -> String {
    if value.abs() < LARGE {
        format!("{value:.3}")
    } else {
        format!("{value:e}")
    }
}

/// Collector that decides which items are usable, from their times and values.
#[derive(Debug)]
pub struct OdometryCollector {
    kind: &'static str,
    fields: OdometryFields,
    remarks: Vec<OdometryRemark>,
    /// Number and time (s) of each usable item.
    usable: Vec<(usize, f64)>,
    /// Time of the first item (s), usable or not.
    first_s: Option<f64>,
}

impl OdometryCollector {
    /// Creates a collector for items of a kind, "line" or "message", whose quantities have the
    /// names of `fields`.
    pub const fn new(kind: &'static str, fields: OdometryFields) -> Self {
        Self {
            kind,
            fields,
            remarks: Vec::new(),
            usable: Vec::new(),
            first_s: None,
        }
    }

    /// Whether an item is usable: its values are finite, and its time is later than that of the
    /// previous usable item. Adds a remark otherwise.
    pub fn accept(
        &mut self,
        item: usize,
        time_s: f64,
        fault: Option<TimeFault>,
        values: &[(&'static str, f64)],
    ) -> bool {
        let field = self.fields.time;
        if time_s.is_finite() && fault.is_none() {
            self.first_s.get_or_insert(time_s);
        }
        let named = std::iter::once((field, time_s));
        let mut named = named.chain(values.iter().copied());
        let not_finite = named.find(|(_, value)| !value.is_finite());
        let last_s = self.usable.last().map(|last| last.1);
        let issue = match (not_finite, fault, last_s) {
            (Some((column, _)), ..) => OdometryIssue::NotFinite { column },
            (_, Some(TimeFault::NotSet), _) => OdometryIssue::TimeNotSet { field, time_s },
            (_, Some(TimeFault::Ahead), _) => OdometryIssue::TimeAhead { field, time_s },
            (.., Some(before_s)) if time_s == before_s => OdometryIssue::Duplicate { time_s },
            (.., Some(before_s)) if time_s < before_s => {
                OdometryIssue::TimeReversed { time_s, before_s }
            }
            _ => {
                self.usable.push((item, time_s));
                return true;
            }
        };
        self.report(item, issue);
        false
    }

    /// Adds a remark on an item.
    pub fn report(&mut self, item: usize, issue: OdometryIssue) {
        let last_s = self.usable.last().map(|last| last.1);
        self.remarks.push(OdometryRemark {
            item,
            kind: self.kind,
            time_s: last_s.unwrap_or(f64::NEG_INFINITY),
            issue,
        });
    }

    /// Adds a remark on a replaced step of the distance at the usable item with this index.
    pub fn report_jump(&mut self, jump: &Jump, field: &'static str) {
        let Some(&(item, time_s)) = self.usable.get(jump.index) else {
            return;
        };
        self.remarks.push(OdometryRemark {
            item,
            kind: self.kind,
            time_s,
            issue: OdometryIssue::DistanceJump {
                field,
                step_m: jump.step_m,
                speed_mps: jump.speed_mps,
            },
        });
    }

    /// Replaces the spikes of a field at the usable items, and reports them.
    pub fn replace_spikes(&mut self, values: &mut [f64], limits: Limits, field: &'static str) {
        for Spike { index, value, used } in replace_spikes(&self.times_s(), values, limits) {
            let Some(&(item, time_s)) = self.usable.get(index) else {
                continue;
            };
            self.remarks.push(OdometryRemark {
                item,
                kind: self.kind,
                time_s,
                issue: OdometryIssue::ValueSpike { field, value, used },
            });
        }
    }

    /// Adds a remark on the file itself.
    pub fn remark(&mut self, issue: OdometryIssue) {
        self.remarks.push(OdometryRemark::of_file(self.kind, issue));
    }

    /// Returns the times of the usable items (s).
    pub fn times_s(&self) -> Vec<f64> {
        self.usable.iter().map(|it| it.1).collect()
    }

    /// Creates the log from the samples, one per usable item, with remarks on gaps.
    pub fn finish(mut self, samples: Vec<OdometrySample>, has_both: bool) -> OdometryLog {
        let steps_s = self.usable.windows(2).map(|pair| match pair {
            [(_, a_s), (_, b_s)] => b_s - a_s,
            _ => 0.0,
        });
        let steps_s: Vec<f64> = steps_s.collect();
        let mut sorted = steps_s.clone();
        sorted.sort_by(f64::total_cmp);
        let usual_s = sorted
            .get(sorted.len() / 2)
            .copied()
            .unwrap_or(f64::INFINITY);
        let ends = self.usable.iter().skip(1);
        let gaps = steps_s
            .iter()
            .zip(ends)
            .filter(|(gap_s, _)| **gap_s > GAP_STEPS * usual_s)
            .map(|(&gap_s, &(item, time_s))| OdometryRemark {
                item,
                kind: self.kind,
                time_s,
                issue: OdometryIssue::Gap { gap_s },
            });
        self.remarks.extend(gaps);
        let start_s = self.usable.first().map(|it| it.1);
        if let Some((first_s, start_s)) = self.first_s.zip(start_s)
            && start_s - first_s > LATE_START_S
        {
            let text = format!(
                "its first {:.1} s are not usable; the start pose is that of its first usable {}, at {start_s} s",
                start_s - first_s,
                self.kind
            );
            self.remark(OdometryIssue::Doubtful(text));
        }
        self.remarks.sort_by_key(|remark| remark.item);
        OdometryLog {
            samples,
            remarks: self.remarks,
            fields: self.fields,
            has_both,
        }
    }
}
