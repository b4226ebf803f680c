//! Odometry that counts upwards in reverse, like single-channel encoders.
//!
//! A vehicle changes its direction at a standstill. The parts of the drive between standstills are
//! processed in turn: each is tried ahead and in reverse, and the direction that predicts the
//! angles up to its end better is retained.

use std::ops::Range;

use onboard::observation::OdometrySample;

use super::error::ReplayError;
use super::evidence::screened;
use super::hypotheses::{Drive, FREEDOM_LOG_ODDS, Hypothesis};
use crate::odometry::OdometryLog;

/// Maximum speed of a standstill as a fraction of the median speed.
const STANDING_SHARE: f64 = 0.1;
/// Minimum of the maximum speed of a standstill (m/s).
const STANDING_MPS: f64 = 0.02;
/// Maximum number of parts, which limits the computing time.
const MAX_PARTS: usize = 40;

/// Returns the hypothesis that some parts of a drive were driven in reverse. Returns `None` if the
/// odometry has a sign, the vehicle never stops, or all parts are explained better by driving
/// ahead.
///
/// # Errors
/// Errors of [`screened`].
pub fn reversed_parts(given: &Drive<'_>) -> Result<Option<Hypothesis>, ReplayError> {
    let samples = &given.odometry.samples;
    let tells_direction = samples.iter().any(|it| it.speed_mps < 0.0)
        || samples.windows(2).any(|pair| match pair {
            [a, b] => b.distance_m < a.distance_m,
            _ => false,
        });
    let parts = parts(samples);
    if tells_direction || !(2..=MAX_PARTS).contains(&parts.len()) {
        return Ok(None);
    }
    let mut reversed: Vec<Range<usize>> = Vec::new();
    for part in &parts {
        let mut turned = reversed.clone();
        turned.push(part.clone());
        let ahead = log_likelihood(given, &reversed, part.end)?;
        let back = log_likelihood(given, &turned, part.end)?;
        if back > ahead {
            reversed = turned;
        }
    }
    if reversed.is_empty() {
        return Ok(None);
    }
    let count = reversed.len();
    // Each part has two possible directions.
    let penalty = FREEDOM_LOG_ODDS + std::f64::consts::LN_2 * parts.len() as f64;
    let log = with_reversed(&given.odometry, &reversed, samples.len());
    Ok(Some(Hypothesis::of_odometry(
        format!(
            "distances count upwards in reverse ({count} of {} parts between standstills)",
            parts.len()
        ),
        "the sign of distance_m and speed_mps: they count down in reverse",
        penalty,
        log,
    )))
}

/// Returns the sample ranges between the centres of successive standstills, which cover the whole
/// drive.
fn parts(samples: &[OdometrySample]) -> Vec<Range<usize>> {
    let speeds_mps = samples.iter().map(|it| it.speed_mps.abs());
    let mut moving_mps: Vec<f64> = speeds_mps.filter(|it| *it > 0.0).collect();
    moving_mps.sort_by(f64::total_cmp);
    let median_mps = moving_mps.get(moving_mps.len() / 2).copied().unwrap_or(0.0);
    let standing_mps = STANDING_MPS.max(STANDING_SHARE * median_mps);
    let mut parts = Vec::new();
    let (mut start, mut stands_since, mut has_moved) = (0, None, false);
    for (index, sample) in samples.iter().enumerate() {
        if sample.speed_mps.abs() <= standing_mps {
            stands_since.get_or_insert(index);
        } else {
            if let Some(since) = stands_since.take().filter(|_| has_moved) {
                let middle = usize::midpoint(since, index);
                parts.push(start..middle);
                start = middle;
            }
            has_moved = true;
        }
    }
    parts.push(start..samples.len());
    parts
}

/// Returns the log-likelihood of the angles up to a sample with some parts in reverse; minus
/// infinity if the filter is lost.
fn log_likelihood(
    given: &Drive<'_>,
    reversed: &[Range<usize>],
    end: usize,
) -> Result<f64, ReplayError> {
    let mut drive = given.clone();
    let log = with_reversed(&given.odometry, reversed, end);
    let last_s = log
        .samples
        .last()
        .map_or(f64::NEG_INFINITY, |last| last.time_s);
    drive
        .angles
        .to_mut()
        .retain(|it| it.measured.time_s <= last_s);
    *drive.odometry.to_mut() = log;
    let evidence = screened(&drive)?;
    Ok(evidence.map_or(f64::NEG_INFINITY, |it| it.log_likelihood))
}

/// Returns the first samples of an odometry with some parts in reverse.
fn with_reversed(odometry: &OdometryLog, reversed: &[Range<usize>], end: usize) -> OdometryLog {
    let mut before_m = None;
    let mut distance_m = 0.0;
    let samples = odometry
        .samples
        .iter()
        .take(end)
        .enumerate()
        .map(|(index, sample)| {
            let is_reversed = reversed.iter().any(|part| part.contains(&index));
            let sign = if is_reversed { -1.0 } else { 1.0 };
            let step_m = before_m
                .replace(sample.distance_m)
                .map_or(0.0, |before_m| sample.distance_m - before_m);
            distance_m += sign * step_m;
            OdometrySample {
                distance_m,
                speed_mps: sign * sample.speed_mps,
                ..*sample
            }
        });
    OdometryLog {
        samples: samples.collect(),
        ..odometry.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_end_at_the_centre_of_standstills() {
        let speeds = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.7, 0.0];
        let mut distance_m = 0.0;
        let samples: Vec<OdometrySample> = (0..)
            .zip(speeds)
            .map(|(k, speed_mps)| {
                distance_m += speed_mps;
                OdometrySample {
                    time_s: f64::from(k),
                    distance_m,
                    speed_mps,
                    yaw_rate_radps: None,
                }
            })
            .collect();
        assert_eq!(parts(&samples), [0..6, 6..11]);
        assert_eq!(parts(&samples[..5]), std::slice::from_ref(&(0..5)));
        let log = OdometryLog {
            samples,
            ..OdometryLog::default()
        };
        let back = with_reversed(&log, std::slice::from_ref(&(6..11)), 11);
        assert!((back.samples[10].distance_m - (2.0 - 1.2)).abs() < 1e-12);
        assert_eq!(back.samples[8].speed_mps, -0.5);
        assert_eq!(back.samples[3], log.samples[3]);
    }
}
