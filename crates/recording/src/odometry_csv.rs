//! Wheel odometry as CSV.
//!
//! | quantity | column | substitute if the column is missing |
//! |---|---|---|
//! | time | `time_s` | |
//! | distance | `distance_m` | mean of `left_m` and `right_m`; otherwise the integrated speed |
//! | speed | `speed_mps` | mean of `left_mps` and `right_mps`; otherwise derived from the distance |
//! | yaw rate | `yaw_rate_radps` | difference of `left_mps` and `right_mps`, or of `left_m` and `right_m`, divided by the track width; otherwise none |

use std::fmt::Write as _;
use std::path::Path;

use onboard::observation::OdometrySample;

use crate::clock_faults::time_faults;
use crate::counter_jumps::{Jump, replace_jumps};
use crate::error::RecordingError;
use crate::file as files;
use crate::odometry::{OdometryCollector, OdometryFields, OdometryIssue, OdometryLog};
use crate::table::Table;
use crate::value_spikes::Limits;

const COLUMNS: [&str; 7] = [
    "distance_m",
    "speed_mps",
    "yaw_rate_radps",
    "left_m",
    "right_m",
    "left_mps",
    "right_mps",
];

/// Access to an optional value of a row.
type Value = fn(&mut Row) -> Option<&mut f64>;

/// Columns whose jumps are replaced.
const COUNTERS: [(&str, Value); 3] = [
    ("distance_m", |row| row.distance_m.as_mut()),
    ("left_m", |row| row.wheels_m.as_mut().map(|[left, _]| left)),
    ("right_m", |row| {
        row.wheels_m.as_mut().map(|[_, right]| right)
    }),
];

/// Columns whose spikes are replaced.
const RATES: [(&str, Limits, Value); 4] = [
    ("speed_mps", Limits::SPEED, |row| row.speed_mps.as_mut()),
    ("left_mps", Limits::SPEED, |row| {
        row.wheels_mps.as_mut().map(|[left, _]| left)
    }),
    ("right_mps", Limits::SPEED, |row| {
        row.wheels_mps.as_mut().map(|[_, right]| right)
    }),
    ("yaw_rate_radps", Limits::YAW_RATE, |row| {
        row.yaw_rate_radps.as_mut()
    }),
];

/// Reads odometry of a vehicle without a specified track width, see [`read_wheel_odometry_csv`].
///
/// # Errors
/// Errors of [`read_wheel_odometry_csv`].
pub fn read_odometry_csv(file: &Path) -> Result<OdometryLog, RecordingError> {
    read_wheel_odometry_csv(file, None)
}

/// Reads odometry from a CSV file with `time_s` and distance or speed, of the vehicle or of its
/// left and right wheels. The contact points of the wheels are `track_width_m` apart.
///
/// # Errors
/// [`RecordingError`] if the file cannot be read, has neither distance nor speed, or has wheel
/// columns without a specified track width. Invalid single rows are reported as remarks only.
pub fn read_wheel_odometry_csv(
    file: &Path,
    track_width_m: Option<f64>,
) -> Result<OdometryLog, RecordingError> {
    let table = Table::read(file, &["time_s"], &COLUMNS)?;
    let has = |name| table.has(name);
    let wheels_m = has("left_m") && has("right_m");
    let wheels_mps = has("left_mps") && has("right_mps");
    let has_distance = has("distance_m") || wheels_m;
    let has_speed = has("speed_mps") || wheels_mps;
    if !has_distance && !has_speed {
        return Err(table.missing(
            "distance_m",
            "the first line must name time_s and one of distance_m, speed_mps, left_m and \
             right_m, left_mps and right_mps",
        ));
    }
    let wheels_turn = (wheels_m || wheels_mps) && !has("yaw_rate_radps");
    if wheels_turn && track_width_m.is_none() {
        return Err(table.missing(
            "yaw_rate_radps",
            "the left and right wheel determine it if the vehicle file contains \
             odometer.track_width_m",
        ));
    }
    let mut collector = OdometryCollector::new("line", OdometryFields::CSV);
    let mut rows = usable_rows(&table, &mut collector);
    let times_s = collector.times_s();
    if !has_speed {
        collector.remark(derived("speed_mps", "the distances"));
    } else if !has_distance {
        collector.remark(derived("distance_m", "the speeds"));
    }
    for (column, value) in COUNTERS {
        replace(&times_s, &mut rows, &mut collector, column, value);
    }
    for (column, limits, value) in RATES {
        let mut values: Vec<f64> = rows
            .iter_mut()
            .map(|row| value(row).map_or(f64::NAN, |it| *it))
            .collect();
        collector.replace_spikes(&mut values, limits, column);
        for (row, replaced) in rows.iter_mut().zip(values) {
            if let Some(value) = value(row) {
                *value = replaced;
            }
        }
    }
    let mut samples: Vec<OdometrySample> = Vec::with_capacity(rows.len());
    let mut before: Option<Row> = None;
    for row in rows {
        let last = before.as_ref().zip(samples.last());
        samples.push(row.sample(last, track_width_m));
        before = Some(row);
    }
    Ok(collector.finish(samples, has_distance && has_speed))
}

fn derived(column: &'static str, from: &str) -> OdometryIssue {
    let from = String::from(from);
    OdometryIssue::Derived { column, from }
}

/// Returns the rows with finite values in order of time; the others are reported.
fn usable_rows(table: &Table, collector: &mut OdometryCollector) -> Vec<Row> {
    let read = |line: &crate::table::Row| line.values.as_deref().ok().map(Row::new);
    let read: Vec<Option<Row>> = table.rows.iter().map(read).collect();
    let times_s: Vec<f64> = read
        .iter()
        .map(|row| row.map_or(f64::NAN, |row| row.time_s))
        .collect();
    let faults = time_faults(&times_s);
    let mut rows = Vec::with_capacity(read.len());
    for ((line, row), fault) in table.rows.iter().zip(read).zip(faults) {
        match (row, &line.values) {
            (Some(row), _) => {
                if collector.accept(line.line, row.time_s, fault, &row.values()) {
                    rows.push(row);
                }
            }
            (None, Err(message)) => {
                collector.report(line.line, OdometryIssue::Malformed(message.clone()));
            }
            (None, Ok(_)) => {}
        }
    }
    rows
}

/// Replaces the jumps of a column in the rows that have it, and reports them.
fn replace(
    times_s: &[f64],
    rows: &mut [Row],
    collector: &mut OdometryCollector,
    column: &'static str,
    value: Value,
) {
    let mut given: Vec<(usize, f64, &mut f64)> = times_s
        .iter()
        .zip(rows.iter_mut())
        .enumerate()
        .filter_map(|(index, (time_s, row))| Some((index, *time_s, value(row)?)))
        .collect();
    let times_s: Vec<f64> = given.iter().map(|it| it.1).collect();
    let mut distances_m: Vec<f64> = given.iter().map(|it| *it.2).collect();
    for jump in replace_jumps(&times_s, &mut distances_m) {
        let index = given.get(jump.index).map_or(jump.index, |it| it.0);
        collector.report_jump(&Jump { index, ..jump }, column);
    }
    for ((_, _, value), distance_m) in given.iter_mut().zip(distances_m) {
        **value = distance_m;
    }
}

/// Values of a row.
#[derive(Clone, Copy)]
struct Row {
    time_s: f64,
    distance_m: Option<f64>,
    speed_mps: Option<f64>,
    yaw_rate_radps: Option<f64>,
    wheels_m: Option<[f64; 2]>,
    wheels_mps: Option<[f64; 2]>,
}

impl Row {
    fn new(values: &[Option<f64>]) -> Self {
        let value = |index: usize| values.get(index).copied().flatten();
        let pair = |left, right| Some([value(left)?, value(right)?]);
        Self {
            time_s: value(0).unwrap_or(f64::NAN),
            distance_m: value(1),
            speed_mps: value(2),
            yaw_rate_radps: value(3),
            wheels_m: pair(4, 5),
            wheels_mps: pair(6, 7),
        }
    }

    /// Returns the values that must be finite, with their columns.
    fn values(&self) -> Vec<(&'static str, f64)> {
        let mut values = Vec::with_capacity(4);
        values.extend(self.distance_m.map(|it| ("distance_m", it)));
        values.extend(self.speed_mps.map(|it| ("speed_mps", it)));
        values.extend(self.yaw_rate_radps.map(|it| ("yaw_rate_radps", it)));
        for (wheels, names) in [
            (self.wheels_m, ["left_m", "right_m"]),
            (self.wheels_mps, ["left_mps", "right_mps"]),
        ] {
            values.extend(
                wheels
                    .into_iter()
                    .flat_map(|wheels| names.into_iter().zip(wheels)),
            );
        }
        let moves = [self.distance_m, self.speed_mps];
        let has_wheels = self.wheels_m.is_some() || self.wheels_mps.is_some();
        if moves == [None, None] && !has_wheels {
            values.push(("distance_m", f64::NAN));
        }
        values
    }

    /// Converts the row to a sample, given the previous row.
    fn sample(
        &self,
        before: Option<(&Self, &OdometrySample)>,
        track_width_m: Option<f64>,
    ) -> OdometrySample {
        let mean = |[left, right]: [f64; 2]| 0.5 * (left + right);
        let difference = |[left, right]: [f64; 2]| right - left;
        let step_s = before.map(|(_, last)| self.time_s - last.time_s);
        let step_s = step_s.filter(|step_s| *step_s > 0.0);
        let rate = |now: f64, last: f64| step_s.map_or(0.0, |step_s| (now - last) / step_s);

        let read_m = self.distance_m.or(self.wheels_m.map(mean));
        let read_mps = self.speed_mps.or(self.wheels_mps.map(mean));
        let last = before.map(|(_, last)| *last);
        let speed_mps = read_mps.unwrap_or_else(|| {
            let now_m = read_m.unwrap_or(f64::NAN);
            rate(now_m, last.map_or(now_m, |last| last.distance_m))
        });
        let distance_m = read_m.unwrap_or_else(|| {
            let step = |last: OdometrySample| {
                last.distance_m + 0.5 * (last.speed_mps + speed_mps) * (self.time_s - last.time_s)
            };
            last.map_or(0.0, step)
        });
        let wheels_turn = |track_m: f64| {
            let by_speed = self.wheels_mps.map(difference);
            let by_distance = || {
                let now_m = difference(self.wheels_m?);
                let last_m = before
                    .and_then(|(row, _)| row.wheels_m)
                    .map_or(now_m, difference);
                Some(rate(now_m, last_m))
            };
            Some(by_speed.or_else(by_distance)? / track_m)
        };
        OdometrySample {
            time_s: self.time_s,
            distance_m,
            speed_mps,
            yaw_rate_radps: self.yaw_rate_radps.or_else(|| wheels_turn(track_width_m?)),
        }
    }
}

/// Writes odometry in the format of [`read_odometry_csv`].
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
