//! Newline JSON: one object a line.

use onboard::geometry::Pose;
use onboard::live::AngleObservation;
use onboard::observation::OdometrySample;
use serde::Deserialize;

use crate::clock::unix_s;
use crate::inbox::{Command, Input};

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
enum Message {
    Odometry {
        time_s: Option<f64>,
        speed_mps: f64,
        distance_m: Option<f64>,
        yaw_rate_radps: Option<f64>,
    },
    Angle {
        time_s: f64,
        pci: u16,
        #[serde(default)]
        ssb_index: u8,
        phase_rad: f64,
        phase_sigma_rad: f64,
        snr_db: Option<f64>,
        #[serde(default = "yes")]
        resolved: bool,
    },
    SetPose {
        time_s: Option<f64>,
        x_m: f64,
        y_m: f64,
        heading_rad: f64,
        covariance: Option<[[f64; 3]; 3]>,
    },
    Reset {},
    Exclude {
        pci: u16,
    },
    Readmit {
        pci: u16,
    },
}

const fn yes() -> bool {
    true
}

/// What a line says; nothing where it is blank.
///
/// # Errors
/// What is wrong with it.
pub fn parse(line: &[u8]) -> Result<Option<Input>, String> {
    if line.trim_ascii().is_empty() {
        return Ok(None);
    }
    let message = serde_json::from_slice(line).map_err(|error| error.to_string())?;
    Ok(Some(match message {
        Message::Odometry {
            time_s,
            speed_mps,
            distance_m,
            yaw_rate_radps,
        } => {
            let time_s = time_s.unwrap_or_else(unix_s);
            let sample = OdometrySample::of_speed(time_s, speed_mps, yaw_rate_radps);
            Input::Odometry(OdometrySample {
                distance_m: distance_m.unwrap_or(sample.distance_m),
                ..sample
            })
        }
        Message::Angle {
            time_s,
            pci,
            ssb_index,
            phase_rad,
            phase_sigma_rad,
            snr_db,
            resolved,
        } => Input::Angle(AngleObservation {
            pci,
            ssb_index,
            time_s,
            phase_rad,
            sigma_rad: phase_sigma_rad,
            snr_db,
            resolved,
        }),
        Message::SetPose {
            time_s,
            x_m,
            y_m,
            heading_rad,
            covariance,
        } => Input::Command(Command::SetPose {
            time_s,
            pose: Pose {
                x_m,
                y_m,
                heading_rad,
            },
            covariance,
        }),
        Message::Reset {} => Input::Command(Command::Reset),
        Message::Exclude { pci } => Input::Command(Command::Exclude(pci)),
        Message::Readmit { pci } => Input::Command(Command::Readmit(pci)),
    }))
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
    fn what_is_wrong_with_a_line_is_said() {
        for (line, said) in [
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
                r#"{"type":"angle","time_s":1,"pci":-1,"phase_rad":0,"phase_sigma_rad":1}"#,
                "-1",
            ),
        ] {
            let error = parse(line.as_bytes()).unwrap_err();
            assert!(error.contains(said), "{line}: {error}");
        }
    }
}
