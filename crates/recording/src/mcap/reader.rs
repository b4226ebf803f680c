//! Reader of odometry from MCAP files.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use onboard::observation::OdometrySample;

use super::bag::files_of;
use super::cdr::Decoder;
use super::messages::{FileEnd, Kind, TRUNCATED, each_message};
use super::motion::{Filled, MAX_COORDINATE_M, Motion, Reading, motion};
use super::schema::UNOBSERVED;
use super::turn_rate::{Gyroscope, rates_of_headings, yaw_rad};
use crate::clock_faults::{TimeFault, time_faults};
use crate::error::RecordingError;
use crate::odometry::{
    OdometryCollector, OdometryFields, OdometryIssue, OdometryLog, OdometryRemark,
};
use crate::value_spikes::Limits;

/// Name of an item in remarks.
const KIND: &str = "message";
/// Maximum step of the recorder's time (ns) for which unset time stamps are restored from the
/// recorder.
const MAX_RECORDED_STEP_NS: u64 = 1_000_000_000;

/// Reads the `nav_msgs/msg/Odometry` messages of one topic of an MCAP file or a rosbag2 folder. The
/// topic is optional if there is only one. The distance is the sum of the position steps along the
/// headings; [`motion`](super::motion) describes the exceptions.
///
/// The yaw rate has the following sources, in this order.
///
/// 1. The twist, unless `imu_topic` is given or the twist's yaw rate is unknown or always zero.
/// 2. `angular_velocity.z` of a `sensor_msgs/msg/Imu`, whose z axis is assumed to point upwards
///    (REP-103).
/// 3. The change of the orientation of the pose.
///
/// Each value is the mean over the step before its sample, according to the time stamps of the
/// headers. The source is reported as a remark.
///
/// # Errors
/// [`RecordingError`] if a file is not MCAP or damaged; if the topic is missing or ambiguous; if
/// several IMU topics have a yaw rate and none is given; if the given IMU topic has none. Invalid
/// single messages and an unclosed file are reported as remarks only.
pub fn read_odometry_mcap(
    bag: &Path,
    topic: Option<&str>,
    imu_topic: Option<&str>,
) -> Result<OdometryLog, RecordingError> {
    let mut topics: Vec<String> = Vec::new();
    let mut messages: Vec<Message> = Vec::new();
    let mut imus: BTreeMap<String, Gyroscope> = BTreeMap::new();
    let mut take = |kind, message_topic: &str, recorded_ns: u64, data: &[u8]| {
        if kind == Kind::Imu {
            if imu_topic.is_none_or(|topic| topic == message_topic) {
                if !imus.contains_key(message_topic) {
                    imus.insert(message_topic.to_owned(), Gyroscope::default());
                }
                if let Some(gyroscope) = imus.get_mut(message_topic) {
                    gyroscope.add(decode_imu(data));
                }
            }
            return;
        }
        if kind != Kind::Odometry {
            return;
        }
        if !topics.iter().any(|topic| topic == message_topic) {
            topics.push(message_topic.to_owned());
        }
        if topic.is_none_or(|topic| topic == message_topic) {
            messages.push(Message {
                recorded_ns,
                reading: decode_odometry(data),
            });
        }
    };
    let mut truncated = Vec::new();
    for file in files_of(bag)? {
        if each_message(&file, &mut take)? == FileEnd::Truncated {
            truncated.push(format!("{}: {TRUNCATED}", file.display()));
        }
    }
    imus.values_mut().for_each(Gyroscope::replace_spikes);
    let topic = one_topic(bag, topic, &topics)?;
    let (readings, motion, mut collector) = used(messages);
    for text in truncated {
        collector.remark(OdometryIssue::Truncated(text));
    }
    let times = readings
        .iter()
        .zip(&motion.distances_m)
        .zip(&motion.speeds_mps);
    let samples = times.map(|((reading, &distance_m), &speed_mps)| OdometrySample {
        time_s: reading.time_s,
        distance_m,
        speed_mps,
        yaw_rate_radps: None,
    });
    let mut log = collector.finish(samples.collect(), motion.has_both);
    Turning {
        bag,
        topic,
        readings: &readings,
        imus: &imus,
        is_straight: motion.is_straight,
    }
    .set_yaw_rates(&mut log, imu_topic)?;
    Ok(log)
}

/// Message of the odometry topic.
struct Message {
    /// Time according to the recorder's clock (ns).
    recorded_ns: u64,
    /// `None` if it is not complete.
    reading: Option<Reading>,
}

/// Returns the usable messages, their motion, and a collector with remarks on the others.
fn used(mut messages: Vec<Message>) -> (Vec<Reading>, Motion, OdometryCollector) {
    let stamp_s = |it: &Message| it.reading.map_or(f64::NAN, |it| it.time_s);
    let times_s: Vec<f64> = messages.iter().map(stamp_s).collect();
    let mut faults = time_faults(&times_s);
    let mut collector = OdometryCollector::new(KIND, OdometryFields::ROS);
    for index in restore_times(&mut messages, &mut faults) {
        let time_s = times_s.get(index).copied().unwrap_or(f64::NAN);
        let field = OdometryFields::ROS.time;
        collector.report(index + 1, OdometryIssue::TimeRestored { field, time_s });
    }
    let readings = messages.iter().filter_map(|it| it.reading.as_ref());
    let filled = Filled::new(readings);
    let mut readings = Vec::with_capacity(messages.len());
    for (item, (message, fault)) in (1..).zip(messages.iter().zip(faults)) {
        let Some(reading) = &message.reading else {
            let why = "no complete nav_msgs/msg/Odometry".to_owned();
            collector.report(item, OdometryIssue::Malformed(why));
            continue;
        };
        let values = filled.required(reading);
        let is_too_far = |it: &&(&str, f64)| it.1.is_finite() && it.1.abs() > MAX_COORDINATE_M;
        if let Some(&(field, value)) = values.iter().find(is_too_far) {
            let allowed = "it must be within 1e8 m of 0";
            collector.report(
                item,
                OdometryIssue::OutOfRange {
                    field,
                    value,
                    allowed,
                },
            );
        } else if collector.accept(item, reading.time_s, fault, &values) {
            readings.push(*reading);
        }
    }
    replace_spikes(&mut readings, &mut collector);
    let motion = motion(&readings, filled);
    for note in &motion.notes {
        collector.remark(OdometryIssue::Noted(note.clone()));
    }
    for doubt in &motion.warnings {
        collector.remark(OdometryIssue::Doubtful(doubt.clone()));
    }
    for jump in &motion.jumps {
        collector.report_jump(jump, OdometryFields::ROS.distance);
    }
    (readings, motion, collector)
}

/// Replaces impossible single values of the twists.
fn replace_spikes(readings: &mut [Reading], collector: &mut OdometryCollector) {
    type Value = fn(&mut Reading) -> Option<&mut f64>;
    let fields: [(&str, Limits, Value); 3] = [
        (OdometryFields::ROS.speed, Limits::SPEED, |it| {
            it.linear_mps.first_mut()
        }),
        ("twist.twist.linear.y", Limits::SPEED, |it| {
            it.linear_mps.last_mut()
        }),
        (OdometryFields::ROS.yaw_rate, Limits::YAW_RATE, |it| {
            it.yaw_rate_radps.as_mut()
        }),
    ];
    for (field, limits, value) in fields {
        let mut values: Vec<f64> = readings
            .iter_mut()
            .map(|it| value(it).map_or(f64::NAN, |it| *it))
            .collect();
        collector.replace_spikes(&mut values, limits, field);
        for (reading, replaced) in readings.iter_mut().zip(values) {
            if let Some(value) = value(reading) {
                *value = replaced;
            }
        }
    }
}

/// Restores the times of leading messages whose time stamp was not set, from the recorder's times
/// relative to the first message with a time stamp. Returns their indices; an empty range if the
/// recorder's times have a gap.
fn restore_times(messages: &mut [Message], faults: &mut [Option<TimeFault>]) -> Range<usize> {
    let unset = faults
        .iter()
        .take_while(|it| **it == Some(TimeFault::NotSet))
        .count();
    let first = messages
        .get(unset)
        .and_then(|it| Some((it.reading?.time_s, it.recorded_ns)));
    let Some((first_s, first_ns)) = first else {
        return 0..0;
    };
    let recorded = messages.iter().take(unset + 1).map(|it| it.recorded_ns);
    let recorded: Vec<u64> = recorded.collect();
    let is_continuous = recorded.windows(2).all(|pair| match pair {
        [a, b] => a < b && b - a <= MAX_RECORDED_STEP_NS,
        _ => false,
    });
    if !is_continuous {
        return 0..0;
    }
    for (message, fault) in messages.iter_mut().zip(faults).take(unset) {
        if let Some(reading) = &mut message.reading {
            reading.time_s = first_s - 1e-9 * (first_ns - message.recorded_ns) as f64;
        }
        *fault = None;
    }
    0..unset
}

fn one_topic<'a>(
    bag: &Path,
    wanted: Option<&'a str>,
    found: &'a [String],
) -> Result<&'a str, RecordingError> {
    match (found, wanted) {
        (_, Some(wanted)) if found.iter().any(|topic| topic == wanted) => Ok(wanted),
        ([topic], None) => Ok(topic),
        ([], _) => Err(RecordingError::Missing {
            file: bag.display().to_string(),
            key: wanted
                .unwrap_or("a topic of nav_msgs/msg/Odometry")
                .to_owned(),
            allowed: "no topic of the file has nav_msgs/msg/Odometry in CDR".to_owned(),
        }),
        (several, Some(wanted)) => Err(RecordingError::Missing {
            file: bag.display().to_string(),
            key: wanted.to_owned(),
            allowed: format!("nav_msgs/msg/Odometry in CDR is on {}", several.join(", ")),
        }),
        (several, None) => Err(RecordingError::value(
            bag,
            "topic",
            "not given",
            format!(
                "several topics contain odometry, choose one of {}",
                several.join(", ")
            ),
        )),
    }
}

/// Sources of the yaw rate in a bag.
struct Turning<'a> {
    bag: &'a Path,
    /// Topic of the odometry.
    topic: &'a str,
    /// Messages of the odometry topic, one per sample.
    readings: &'a [Reading],
    imus: &'a BTreeMap<String, Gyroscope>,
    /// Whether the position moves along headings that are all known.
    is_straight: bool,
}

impl Turning<'_> {
    /// Sets the yaw rate of the samples and adds a remark on its source.
    fn set_yaw_rates(
        &self,
        log: &mut OdometryLog,
        imu_topic: Option<&str>,
    ) -> Result<(), RecordingError> {
        let times_s: Vec<f64> = log.samples.iter().map(|sample| sample.time_s).collect();
        let by_twist: Vec<Option<f64>> = self.readings.iter().map(|it| it.yaw_rate_radps).collect();
        let twist_turns = by_twist.iter().flatten().any(|rate| *rate != 0.0);
        let mut remarks = Vec::new();
        let mut found = None;
        if let Some((imu, gyroscope)) = self.imu(imu_topic, twist_turns, &mut remarks)? {
            let rates = gyroscope.rates(&times_s);
            let source = format!("angular_velocity.z of {imu}");
            if rates.iter().any(Option::is_some) {
                let but = match gyroscope.left_out {
                    0 => String::new(),
                    count => format!("; {count} of its messages are left out"),
                };
                found = Some((
                    rates,
                    format!("{source}, whose z axis is assumed to point up{but}"),
                ));
            } else {
                let why = self.apart(&times_s, gyroscope);
                if imu_topic.is_some() {
                    let allowed = "both must be stamped by one clock, in their headers";
                    return Err(RecordingError::value(self.bag, imu, why, allowed));
                }
                remarks.push(OdometryIssue::Unused { source, why });
            }
        }
        if found.is_none() && twist_turns {
            // Only an alternative source requires a remark.
            let others: Vec<&str> = self.imus.keys().map(String::as_str).collect();
            let source = format!(
                "twist.angular.z of {}; --imu-topic selects that of {}",
                self.topic,
                others.join(" or ")
            );
            let source = if others.is_empty() {
                String::new()
            } else {
                source
            };
            found = Some((by_twist, source));
        }
        if found.is_none() {
            let headings: Vec<Option<f64>> =
                self.readings.iter().map(|it| it.heading_rad).collect();
            let mut rates = rates_of_headings(&times_s, &headings);
            if self.is_straight && rates.iter().all(Option::is_none) {
                // The orientation is filled and constant.
                rates.fill(Some(0.0));
            }
            if rates.iter().any(Option::is_some) {
                found = Some((rates, format!("pose.orientation of {}", self.topic)));
            }
        }
        if let Some((rates, from)) = found {
            for (sample, rate) in log.samples.iter_mut().zip(rates) {
                sample.yaw_rate_radps = rate;
            }
            if !from.is_empty() {
                let column = "yaw_rate_radps";
                remarks.push(OdometryIssue::Derived { column, from });
            }
        }
        let remarks = remarks.into_iter();
        let of_file = remarks.map(|issue| OdometryRemark::of_file(KIND, issue));
        log.remarks.splice(0..0, of_file);
        Ok(())
    }

    /// Returns the requested or required IMU with its topic; unusable IMUs are reported as remarks.
    fn imu(
        &self,
        imu_topic: Option<&str>,
        twist_turns: bool,
        remarks: &mut Vec<OdometryIssue>,
    ) -> Result<Option<(&str, &Gyroscope)>, RecordingError> {
        if let Some(imu_topic) = imu_topic {
            let Some((topic, gyroscope)) = self.imus.get_key_value(imu_topic) else {
                return Err(RecordingError::Missing {
                    file: self.bag.display().to_string(),
                    key: imu_topic.to_owned(),
                    allowed: "there must be sensor_msgs/msg/Imu in CDR on it".to_owned(),
                });
            };
            if let Some(why) = without_information(gyroscope) {
                let allowed = "it must have an IMU with a known angular velocity";
                return Err(RecordingError::value(self.bag, imu_topic, why, allowed));
            }
            return Ok(Some((topic, gyroscope)));
        }
        if twist_turns {
            return Ok(None);
        }
        let mut usable = Vec::new();
        for (topic, gyroscope) in self.imus {
            if let Some(why) = without_information(gyroscope) {
                let source = topic.clone();
                let why = why.to_owned();
                remarks.push(OdometryIssue::Unused { source, why });
            } else {
                usable.push((topic.as_str(), gyroscope));
            }
        }
        match usable.as_slice() {
            [] => Ok(None),
            [one] => Ok(Some(*one)),
            several => {
                let topics: Vec<&str> = several.iter().map(|(topic, _)| *topic).collect();
                Err(RecordingError::value(
                    self.bag,
                    "imu_topic",
                    "not given",
                    format!(
                        "the odometry has no yaw rate and several IMUs have one, choose one of {}",
                        topics.join(", ")
                    ),
                ))
            }
        }
    }

    /// Returns the text for odometry and IMU without common times.
    fn apart(&self, times_s: &[f64], gyroscope: &Gyroscope) -> String {
        let from_to = |[from_s, to_s]: [f64; 2]| format!("{from_s:.3} to {to_s:.3} s");
        let of_imu = gyroscope.interval_s().map_or_else(String::new, from_to);
        let ends = times_s.first().zip(times_s.last());
        let of_odometry = ends.map_or_else(String::new, |(from, to)| from_to([*from, *to]));
        format!("stamped {of_imu}, {} {of_odometry}", self.topic)
    }
}

/// Returns the reason why a gyroscope is unusable; `None` for a usable one.
fn without_information(gyroscope: &Gyroscope) -> Option<&'static str> {
    if gyroscope.len() < 2 {
        Some("without an angular velocity that is known, finite and in order of time")
    } else if gyroscope.is_silent() {
        Some("zero in every angular velocity")
    } else {
        None
    }
}

fn decode_odometry(message: &[u8]) -> Option<Reading> {
    let mut decoder = Decoder::new(message)?;
    let time_s = stamp_s(&mut decoder)?;
    decoder.skip_string()?; // frame of the pose
    decoder.skip_string()?; // frame of the twist
    let [x_m, y_m, _z_m] = decoder.f64s()?;
    let orientation: [f64; 4] = decoder.f64s()?;
    let _covariance: [f64; 36] = decoder.f64s()?;
    let [x_mps, y_mps, _] = decoder.f64s()?;
    let [_, _, yaw_rate_radps] = decoder.f64s()?;
    let covariance: [f64; 36] = decoder.f64s()?;
    let variance = covariance[35];
    let is_observed = variance.is_nan() || (0.0..UNOBSERVED).contains(&variance);
    let is_given = yaw_rate_radps.is_finite() && is_observed;
    Some(Reading {
        time_s,
        position_m: [x_m, y_m],
        heading_rad: yaw_rad(orientation),
        linear_mps: [x_mps, y_mps],
        yaw_rate_radps: is_given.then_some(yaw_rate_radps),
    })
}

/// Decodes time (s) and yaw rate (rad/s) of a `sensor_msgs/msg/Imu`. Returns `None` for a truncated
/// message, or if the first element of the covariance is −1, which marks the angular velocity as
/// unknown.
fn decode_imu(message: &[u8]) -> Option<(f64, f64)> {
    let mut decoder = Decoder::new(message)?;
    let time_s = stamp_s(&mut decoder)?;
    decoder.skip_string()?;
    let _orientation: [f64; 4] = decoder.f64s()?;
    let _covariance: [f64; 9] = decoder.f64s()?;
    let [_, _, yaw_rate_radps] = decoder.f64s()?;
    let [first, ..]: [f64; 9] = decoder.f64s()?;
    let _acceleration_and_covariance: [f64; 12] = decoder.f64s()?;
    (first != -1.0).then_some((time_s, yaw_rate_radps))
}

pub(super) fn stamp_s(decoder: &mut Decoder<'_>) -> Option<f64> {
    let (seconds, nanoseconds) = (decoder.i32()?, decoder.u32()?);
    Some(f64::from(seconds) + 1e-9 * f64::from(nanoseconds))
}
