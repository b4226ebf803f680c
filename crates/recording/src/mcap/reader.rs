//! Odometry out of an MCAP file.

use std::path::Path;

use super::cdr::Decoder;
use super::messages::each_odometry_message;
use crate::error::RecordingError;
use crate::odometry::{OdometryCollector, OdometryLog};
use onboard::observation::OdometrySample;

/// What is used of one `nav_msgs/msg/Odometry`.
struct Reading {
    time_s: f64,
    x_m: f64,
    y_m: f64,
    speed_mps: f64,
    yaw_rate_radps: f64,
}

/// Reads the `nav_msgs/msg/Odometry` messages of one topic; of the only such topic where none is
/// named. The distance is the length of the path of their poses, backwards where the speed is
/// negative. Where the yaw rate is zero throughout there is no gyroscope.
///
/// # Errors
/// [`RecordingError`] when the file is no MCAP, is cut off, or does not have exactly that topic.
/// Single messages are only remarked upon.
pub fn read_odometry_mcap(file: &Path, topic: Option<&str>) -> Result<OdometryLog, RecordingError> {
    let mut topics: Vec<String> = Vec::new();
    let mut collector = OdometryCollector::of("message");
    let mut last_place: Option<(f64, f64)> = None;
    let mut item = 0;
    each_odometry_message(file, |message_topic, data| {
        if topic.is_some_and(|topic| topic != message_topic) {
            return;
        }
        if !topics.iter().any(|topic| topic == message_topic) {
            topics.push(message_topic.to_owned());
        }
        item += 1;
        let Some(reading) = decode(data) else {
            collector.add(item, Err("no complete nav_msgs/msg/Odometry".to_owned()));
            return;
        };
        let place = (reading.x_m, reading.y_m);
        let step_m = last_place.map_or(0.0, |(x_m, y_m)| {
            let length_m = (place.0 - x_m).hypot(place.1 - y_m);
            length_m.copysign(if reading.speed_mps < 0.0 { -1.0 } else { 1.0 })
        });
        let before = collector.last().copied();
        let driven_m = before.map_or(0.0, |sample| sample.distance_m);
        collector.add(
            item,
            Ok(OdometrySample {
                time_s: reading.time_s,
                distance_m: driven_m + step_m,
                speed_mps: reading.speed_mps,
                yaw_rate_radps: Some(reading.yaw_rate_radps),
            }),
        );
        // A sample that was left out must not move the place from which the next step counts.
        if collector.last().copied() != before {
            last_place = Some(place);
        }
    })?;
    one_topic(file, topic, &topics)?;
    let mut log = collector.finish();
    if log
        .samples
        .iter()
        .all(|sample| sample.yaw_rate_radps == Some(0.0))
    {
        log.samples
            .iter_mut()
            .for_each(|sample| sample.yaw_rate_radps = None);
    }
    Ok(log)
}

fn one_topic(file: &Path, wanted: Option<&str>, found: &[String]) -> Result<(), RecordingError> {
    match (found, wanted) {
        ([_], _) => Ok(()),
        ([], _) => Err(RecordingError::Missing {
            file: file.display().to_string(),
            key: wanted
                .unwrap_or("a topic of nav_msgs/msg/Odometry")
                .to_owned(),
            allowed: "the file must hold nav_msgs/msg/Odometry in CDR on it".to_owned(),
        }),
        (several, _) => Err(RecordingError::value(
            file,
            "topic",
            "not given",
            format!(
                "several topics hold odometry, choose one of {}",
                several.join(", ")
            ),
        )),
    }
}

fn decode(message: &[u8]) -> Option<Reading> {
    let mut decoder = Decoder::new(message)?;
    let (seconds, nanoseconds) = (decoder.i32()?, decoder.u32()?);
    decoder.skip_string()?;
    decoder.skip_string()?;
    let [x_m, y_m, _z_m] = decoder.f64s()?;
    let _orientation: [f64; 4] = decoder.f64s()?;
    let _covariance: [f64; 36] = decoder.f64s()?;
    let [speed_mps, _, _] = decoder.f64s()?;
    let [_, _, yaw_rate_radps] = decoder.f64s()?;
    Some(Reading {
        time_s: f64::from(seconds) + 1e-9 * f64::from(nanoseconds),
        x_m,
        y_m,
        speed_mps,
        yaw_rate_radps,
    })
}
