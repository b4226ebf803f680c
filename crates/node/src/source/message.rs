//! Newline-delimited JSON messages, one object per line.

use onboard::geometry::Pose;
use onboard::live::{AngleObservation, RangeObservation, RangeValue};
use onboard::observation::{MeasurementKind, OdometrySample};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::clock::unix_s;
use crate::inbox::{Command, Input};

/// Allowed values of the key `type`.
const TYPES: &str = "odometry, angle, range, set-pose, reset, exclude or readmit";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Odometry {
    time_s: Option<f64>,
    speed_mps: f64,
    distance_m: Option<f64>,
    yaw_rate_radps: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Angle {
    time_s: f64,
    pci: u16,
    #[serde(default)]
    ssb_index: u8,
    phase_rad: f64,
    phase_sigma_rad: f64,
    snr_db: Option<f64>,
    #[serde(default = "default_true")]
    resolved: bool,
    #[serde(default)]
    at_head: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Distance {
    time_s: f64,
    pci: u16,
    #[serde(default)]
    ssb_index: u8,
    range_m: Option<f64>,
    sigma_m: Option<f64>,
    delay_ns: Option<f64>,
    delay_sigma_ns: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SetPose {
    time_s: Option<f64>,
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    covariance: Option<[[f64; 3]; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Reset {}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cell {
    pci: u16,
}

const fn default_true() -> bool {
    true
}

/// Byte order mark of UTF-8.
const BOM: &[u8] = b"\xef\xbb\xbf";

/// Parses a line; `None` for a blank line.
///
/// # Errors
/// Description of the error with the key.
pub fn parse(line: &[u8]) -> Result<Option<Input>, String> {
    let line = line.strip_prefix(BOM).unwrap_or(line);
    if line.trim_ascii().is_empty() {
        return Ok(None);
    }
    let value: Value = serde_json::from_slice(line)
        .map_err(|error| format!("not a JSON object in UTF-8 on one line: {error}"))?;
    let Value::Object(mut message) = value else {
        return Err(format!(
            "not an object; it must be one with the key `type`: {TYPES}"
        ));
    };
    let Some(kind) = message.remove("type") else {
        return Err(format!("the key `type` is missing; it must be {TYPES}"));
    };
    Ok(Some(match kind.as_str() {
        Some("odometry") => odometry(&read(message)?),
        Some("angle") => angle(&read(message)?),
        Some("range") => range(&read(message)?)?,
        Some("set-pose") => set_pose(&read(message)?),
        Some("reset") => {
            let Reset {} = read(message)?;
            Input::Command(Command::Reset)
        }
        Some("exclude") => Input::Command(Command::Exclude(read::<Cell>(message)?.pci)),
        Some("readmit") => Input::Command(Command::Readmit(read::<Cell>(message)?.pci)),
        _ => return Err(format!("type is {kind}; it must be {TYPES}")),
    }))
}

/// Deserializes a message; errors contain the key.
fn read<T: DeserializeOwned>(message: Map<String, Value>) -> Result<T, String> {
    serde_path_to_error::deserialize(Value::Object(message)).map_err(|error| {
        let key = error.path().to_string();
        let why = error.into_inner();
        if key == "." {
            why.to_string()
        } else {
            format!("{key}: {}", plain_message(&why.to_string()))
        }
    })
}

/// Replaces the names of Rust's types in a message of serde.
fn plain_message(why: &str) -> String {
    let Some((found, expected)) = why.split_once(", expected ") else {
        return why.to_owned();
    };
    let expected = match expected {
        "f64" => "a number",
        "u8" => "an integer from 0 to 255",
        "u16" => "an integer from 0 to 65535",
        other => other,
    };
    format!("{found}, expected {expected}")
}

fn odometry(message: &Odometry) -> Input {
    let time_s = message.time_s.unwrap_or_else(unix_s);
    let sample = OdometrySample::of_speed(time_s, message.speed_mps, message.yaw_rate_radps);
    Input::Odometry(OdometrySample {
        distance_m: message.distance_m.unwrap_or(sample.distance_m),
        ..sample
    })
}

const fn angle(message: &Angle) -> Input {
    Input::Angle(AngleObservation {
        kind: MeasurementKind::of_angle(message.at_head),
        pci: message.pci,
        ssb_index: message.ssb_index,
        time_s: message.time_s,
        phase_rad: message.phase_rad,
        sigma_rad: message.phase_sigma_rad,
        snr_db: message.snr_db,
        resolved: message.resolved,
    })
}

fn range(message: &Distance) -> Result<Input, String> {
    let (value, sigma) = match (message.range_m, message.delay_ns) {
        (Some(range_m), None) if message.delay_sigma_ns.is_none() => {
            (RangeValue::RangeM(range_m), message.sigma_m)
        }
        (None, Some(delay_ns)) if message.sigma_m.is_none() => {
            (RangeValue::DelayNs(delay_ns), message.delay_sigma_ns)
        }
        _ => {
            return Err(
                "a range has either range_m and sigma_m, or delay_ns and delay_sigma_ns".to_owned(),
            );
        }
    };
    Ok(Input::Range(RangeObservation {
        pci: message.pci,
        ssb_index: message.ssb_index,
        time_s: message.time_s,
        value,
        sigma,
    }))
}

const fn set_pose(message: &SetPose) -> Input {
    Input::Command(Command::SetPose {
        time_s: message.time_s,
        pose: Pose {
            x_m: message.x_m,
            y_m: message.y_m,
            heading_rad: message.heading_rad,
        },
        covariance: message.covariance,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_type_of_message_is_read() {
        let speed = br#"{"type":"odometry","time_s":1.5,"speed_mps":2}"#;
        let Ok(Some(Input::Odometry(sample))) = parse(speed) else {
            panic!("odometry");
        };
        assert_eq!((sample.time_s, sample.speed_mps), (1.5, 2.0));
        assert!(sample.distance_m.is_nan() && sample.yaw_rate_radps.is_none());
        let angle =
            br#"{"type":"angle","time_s":1,"pci":11,"phase_rad":0.1,"phase_sigma_rad":0.02}"#;
        assert!(matches!(parse(angle), Ok(Some(Input::Angle(it))) if it.pci == 11));
        let range = br#"{"type":"range","time_s":1,"pci":11,"delay_ns":120,"delay_sigma_ns":5}"#;
        assert!(matches!(
            parse(range),
            Ok(Some(Input::Range(RangeObservation {
                value: RangeValue::DelayNs(120.0),
                ..
            })))
        ));
        let pose = br#"{"type":"set-pose","x_m":1,"y_m":2,"heading_rad":0}"#;
        assert!(matches!(
            parse(pose),
            Ok(Some(Input::Command(Command::SetPose { time_s: None, .. })))
        ));
        for (text, command) in [
            (r#"{"type":"reset"}"#, Command::Reset),
            (r#"{"type":"exclude","pci":7}"#, Command::Exclude(7)),
            (r#"{"type":"readmit","pci":7}"#, Command::Readmit(7)),
        ] {
            let Ok(Some(Input::Command(found))) = parse(text.as_bytes()) else {
                panic!("{text}");
            };
            assert_eq!(found, command);
        }
        assert!(matches!(parse(b" \r"), Ok(None)));
    }

    #[test]
    fn invalid_lines_are_reported_with_their_error() {
        for (line, expected) in [
            ("{", "EOF"),
            ("[1]", "type"),
            (r#"{"type":"odometer"}"#, "odometry"),
            (r#"{"type":"odometry","time_s":1}"#, "speed_mps"),
            (
                r#"{"type":"odometry","speed_mps":1,"speed":2}"#,
                "unknown field `speed`",
            ),
            (r#"{"type":"odometry","speed_mps":1e999}"#, "out of range"),
            (
                r#"{"type":"odometry","time_s":"abc","speed_mps":1}"#,
                "time_s: invalid type: string \"abc\"",
            ),
            (
                r#"{"type":"set-pose","x_m":1,"y_m":2,"heading_rad":0,"covariance":[[1,0,0],[0,"1",0],[0,0,1]]}"#,
                "covariance[1][1]: invalid type: string",
            ),
            (
                r#"{"type":"range","time_s":1,"pci":1,"range_m":5,"delay_ns":5}"#,
                "either range_m",
            ),
            (
                r#"{"type":"angle","time_s":1,"pci":-1,"phase_rad":0,"phase_sigma_rad":1}"#,
                "-1",
            ),
        ] {
            let error = parse(line.as_bytes()).unwrap_err();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
