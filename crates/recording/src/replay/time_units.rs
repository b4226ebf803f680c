//! Time units of a recorded drive, checked before anything is computed from the times.

use onboard::time_unit::{OdometryTimes, TimeUnit};

use super::error::ReplayError;
use crate::angle_log::LoggedAngle;
use crate::odometry::OdometryLog;

/// Minimum fraction of the angles within the time of the odometry; below it, the unit of the
/// angles' times is checked.
const MIN_INSIDE: f64 = 0.5;
/// Minimum fraction of the angles within the time of the odometry for an accepted unit.
const EXPLAINED: f64 = 0.9;
/// Minimum duration of the angles as a fraction of the drive for an accepted unit. In a unit that is too long, all times
/// are near 0; a log of odometry that ends early is shorter than the angles, too.
const MIN_SPAN: f64 = 0.1;

/// Checks that the times of odometry and angles are in seconds.
///
/// # Errors
/// [`ReplayError::TimeUnit`] with the probable unit.
pub fn check_times(odometry: &OdometryLog, angles: &[LoggedAngle]) -> Result<(), ReplayError> {
    let field = odometry.fields.time;
    if let Some((unit, step)) = unit_of(odometry) {
        let (of, samples) = ("odometry", "samples");
        return Err(ReplayError::TimeUnit {
            of,
            field,
            unit,
            samples,
            step,
        });
    }
    if let Some((unit, step)) = unit_of_angles(odometry, angles) {
        let (of, samples, field) = ("angles", "angles", "time_s");
        return Err(ReplayError::TimeUnit {
            of,
            field,
            unit,
            samples,
            step,
        });
    }
    Ok(())
}

/// Returns the unit of the odometry's times and the median step; `None` if the unit may be seconds.
fn unit_of(odometry: &OdometryLog) -> Option<(TimeUnit, f64)> {
    let samples = &odometry.samples;
    let mut times = OdometryTimes {
        time_s: samples.last()?.time_s,
        step_s: median_step_s(samples.iter().map(|it| it.time_s)),
        by_speed_m: odometry.has_both.then_some(0.0),
        ..OdometryTimes::default()
    };
    for pair in samples.windows(2) {
        let [from, to] = pair else { continue };
        let step_s = to.time_s - from.time_s;
        let moved_m = (to.distance_m - from.distance_m).abs();
        times.by_distance_m += moved_m;
        times.moving_s += if moved_m > 0.0 { step_s } else { 0.0 };
        if let Some(by_speed_m) = &mut times.by_speed_m {
            *by_speed_m += 0.5 * (from.speed_mps + to.speed_mps).abs() * step_s;
        }
    }
    Some((times.unit()?, times.step_s))
}

/// Returns the unit in which the angles are within the time of the odometry; `None` if this unit is
/// seconds.
fn unit_of_angles(odometry: &OdometryLog, angles: &[LoggedAngle]) -> Option<(TimeUnit, f64)> {
    let times = || angles.iter().map(|it| it.measured.time_s);
    let inside = |per_second: f64| {
        let count = times()
            .filter(|time| odometry.covers(time / per_second))
            .count();
        count as f64 / angles.len().max(1) as f64
    };
    if angles.is_empty() || inside(1.0) >= MIN_INSIDE {
        return None;
    }
    let [first_s, last_s] = odometry.interval_s()?;
    let spans = |unit: &TimeUnit| {
        let first = times().fold(f64::INFINITY, f64::min) / unit.per_second();
        let last = times().fold(f64::NEG_INFINITY, f64::max) / unit.per_second();
        last - first > MIN_SPAN * (last_s - first_s)
    };
    let explains = |unit: &TimeUnit| inside(unit.per_second()) >= EXPLAINED && spans(unit);
    let unit = TimeUnit::ALL.into_iter().find(explains)?;
    Some((unit, median_step_s(times())))
}

/// Returns the median of the positive differences of successive times.
fn median_step_s(times_s: impl Iterator<Item = f64>) -> f64 {
    let mut before_s = None;
    let steps =
        times_s.filter_map(|time_s| before_s.replace(time_s).map(|before_s| time_s - before_s));
    let mut steps_s: Vec<f64> = steps.filter(|it| *it > 0.0).collect();
    steps_s.sort_by(f64::total_cmp);
    steps_s.get(steps_s.len() / 2).copied().unwrap_or(0.0)
}
