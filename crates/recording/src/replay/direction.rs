//! Odometry that counts upwards in reverse, like single-channel encoders.
//!
//! A vehicle changes its direction at a standstill. The parts of the drive between standstills are
//! processed in turn: each is tried ahead and in reverse, and the direction that predicts the
//! angles up to its end better is retained. If no part was driven in reverse, the standstills may be
//! shorter than a sample: then the drive is divided into parts of equal duration, and the ends of the
//! reversed ones are moved to where they predict the angles best.

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
/// Minimum duration of a part without standstills in seconds: some metres of motion at usual speeds.
const MIN_PART_S: f64 = 2.0;
/// Maximum number of stretches in reverse in a drive without standstills.
const MAX_REVERSED: usize = 4;
/// Number of halvings of the step by which the ends of a stretch are moved: an eighth of a part.
const HALVINGS: usize = 3;

/// Returns the hypothesis that some parts of a drive were driven in reverse. Returns `None` if the
/// odometry has a sign, or if all parts are explained better by driving ahead.
///
/// # Errors
/// Errors of [`screened`].
pub fn reversed_parts(given: &Drive<'_>) -> Result<Option<Hypothesis>, ReplayError> {
    let samples = &given.odometry.samples;
    let gives_direction = samples.iter().any(|it| it.speed_mps < 0.0)
        || samples.windows(2).any(|pair| match pair {
            [a, b] => b.distance_m < a.distance_m,
            _ => false,
        });
    if gives_direction {
        return Ok(None);
    }
    let parts = parts(samples);
    if (2..=MAX_PARTS).contains(&parts.len()) {
        let reversed = better_in_reverse(given, &parts)?;
        if !reversed.is_empty() {
            // Each part has two possible directions.
            let penalty = FREEDOM_LOG_ODDS + std::f64::consts::LN_2 * parts.len() as f64;
            let which = format!(
                "{} of {} parts between standstills",
                reversed.len(),
                parts.len()
            );
            return Ok(Some(hypothesis(given, &reversed, &which, penalty)));
        }
    }
    let parts = equal_parts(samples);
    let mut reversed = joined(better_in_reverse(given, &parts)?);
    if !(1..=MAX_REVERSED).contains(&reversed.len()) {
        return Ok(None);
    }
    let part = parts.first().map_or(1, ExactSizeIterator::len);
    refine(given, &mut reversed, part)?;
    // Each end is one of all samples.
    let ends = 2.0 * reversed.len() as f64;
    let penalty = FREEDOM_LOG_ODDS + ends * (samples.len() as f64).ln();
    let time_s = |index: usize| samples.get(index).map_or(f64::NAN, |it| it.time_s);
    let stretches: Vec<String> = reversed
        .iter()
        .map(|it| {
            format!(
                "from {:.1} to {:.1} s",
                time_s(it.start),
                time_s(it.end.saturating_sub(1))
            )
        })
        .collect();
    let which = stretches.join(", ");
    Ok(Some(hypothesis(given, &reversed, &which, penalty)))
}

fn hypothesis(
    given: &Drive<'_>,
    reversed: &[Range<usize>],
    which: &str,
    penalty: f64,
) -> Hypothesis {
    let log = with_reversed(&given.odometry, reversed, given.odometry.samples.len());
    Hypothesis::of_odometry(
        format!("distances count upwards in reverse ({which})"),
        "the sign of distance_m and speed_mps: they count down in reverse",
        penalty,
        log,
    )
}

/// Returns the parts that predict the angles better in reverse.
fn better_in_reverse(
    given: &Drive<'_>,
    parts: &[Range<usize>],
) -> Result<Vec<Range<usize>>, ReplayError> {
    let mut reversed: Vec<Range<usize>> = Vec::new();
    for part in parts {
        let mut turned = reversed.clone();
        turned.push(part.clone());
        let ahead = log_likelihood(given, &reversed, part.end)?;
        let back = log_likelihood(given, &turned, part.end)?;
        if back > ahead {
            reversed = turned;
        }
    }
    Ok(reversed)
}

/// Moves the ends of the stretches by at most one part to where the angles of the whole drive are
/// most likely.
fn refine(
    given: &Drive<'_>,
    reversed: &mut [Range<usize>],
    part: usize,
) -> Result<(), ReplayError> {
    let count = given.odometry.samples.len();
    let mut best = log_likelihood(given, reversed, count)?;
    for index in 0..reversed.len() {
        for is_start in [true, false] {
            let mut step = part;
            for _ in 0..HALVINGS {
                step = (step / 2).max(1);
                let Some(kept) = reversed.get(index).cloned() else {
                    continue;
                };
                for earlier in [true, false] {
                    let moved = |at: usize| {
                        if earlier {
                            at.saturating_sub(step)
                        } else {
                            at.saturating_add(step).min(count)
                        }
                    };
                    let trial = if is_start {
                        moved(kept.start)..kept.end
                    } else {
                        kept.start..moved(kept.end)
                    };
                    let mut trials = reversed.to_vec();
                    if let Some(place) = trials.get_mut(index) {
                        *place = trial;
                    }
                    let likelihood = log_likelihood(given, &trials, count)?;
                    if likelihood > best {
                        best = likelihood;
                        reversed.clone_from_slice(&trials);
                    }
                }
            }
        }
    }
    Ok(())
}

/// Joins ranges of which each begins at the end of the previous one.
fn joined(ranges: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let mut joined: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => joined.push(range),
        }
    }
    joined
}

/// Divides a drive into parts of an equal number of samples.
fn equal_parts(samples: &[OdometrySample]) -> Vec<Range<usize>> {
    let duration_s = match samples {
        [first, .., last] => last.time_s - first.time_s,
        _ => 0.0,
    };
    let number = ((duration_s / MIN_PART_S) as usize).clamp(1, MAX_PARTS);
    let length = samples.len().div_ceil(number).max(1);
    (0..samples.len())
        .step_by(length)
        .map(|start| start..(start + length).min(samples.len()))
        .collect()
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
    fn equal_parts_cover_the_drive() {
        let samples = |count: u32, step_s: f64| -> Vec<OdometrySample> {
            let times_s = (0..count).map(|k| step_s * f64::from(k));
            let sample = |time_s| OdometrySample {
                time_s,
                distance_m: 0.0,
                speed_mps: 0.0,
                yaw_rate_radps: None,
            };
            times_s.map(sample).collect()
        };
        assert_eq!(equal_parts(&samples(11, 0.5)), [0..6, 6..11]);
        assert_eq!(equal_parts(&samples(1000, 1.0)).len(), MAX_PARTS);
        assert_eq!(equal_parts(&[]), []);
        let part = |range| std::slice::from_ref(&range).to_vec();
        assert_eq!(joined(vec![0..3, 3..5, 8..9]), [0..5, 8..9]);
        assert_eq!(joined(part(2..4)), part(2..4));
    }

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
