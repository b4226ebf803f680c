//! Reader of angles from the verdicts of MCAP files.

use std::path::Path;

use super::bag::files_of;
use super::cdr::Decoder;
use super::messages::{FileEnd, Kind, TRUNCATED, each_message};
use super::reader::stamp_s;
use crate::angle_log::{AngleLog, angle};
use crate::error::RecordingError;

/// Reads the angles of the `access_av_msgs/msg/AngleVerdict` messages of an MCAP file or a rosbag2
/// folder, optionally of one topic. A node or `access-av record locate` records these messages. Verdicts
/// without an angle are skipped. In files that were written before the messages had `resolved` and
/// `at_head`, all angles are resolved and measured on the vehicle.
///
/// # Errors
/// [`RecordingError`] if a file is not MCAP or is damaged, or if there is no such message. Invalid
/// single messages and an unclosed file are reported as remarks only.
pub fn read_angles_mcap(bag: &Path, topic: Option<&str>) -> Result<AngleLog, RecordingError> {
    let mut log = AngleLog::default();
    let mut item = 0;
    for file in files_of(bag)? {
        let end = each_message(&file, |kind, message_topic, _, data| {
            if kind != Kind::Verdict || topic.is_some_and(|topic| topic != message_topic) {
                return;
            }
            item += 1;
            match decode(data) {
                Some((phase_rad, _)) if phase_rad.is_nan() => {}
                Some((_, columns)) => log.add("message", item, angle(&columns)),
                None => {
                    let why = "no complete access_av_msgs/msg/AngleVerdict".to_owned();
                    log.add("message", item, Err(why));
                }
            }
        })?;
        if end == FileEnd::Truncated {
            let why = format!("{}: {TRUNCATED}", file.display());
            log.add("message", item, Err(why));
        }
    }
    if item == 0 {
        return Err(RecordingError::Missing {
            file: bag.display().to_string(),
            key: topic
                .unwrap_or("a topic of access_av_msgs/msg/AngleVerdict")
                .to_owned(),
            allowed: "there must be access_av_msgs/msg/AngleVerdict in CDR on it".to_owned(),
        });
    }
    Ok(log)
}

/// Decodes a verdict to the phase, which is NaN without an angle, and all columns of an angle log.
fn decode(message: &[u8]) -> Option<(f64, [Option<f64>; 10])> {
    let mut decoder = Decoder::new(message)?;
    let time_s = stamp_s(&mut decoder)?;
    decoder.skip_string()?;
    let (pci, ssb_index, _accepted) = (decoder.u16()?, decoder.u8()?, decoder.u8()?);
    decoder.skip_string()?;
    let [phase_rad, phase_sigma_rad, snr_db] = decoder.f64s()?;
    let _mahalanobis_threshold_and_wake_up: [f64; 3] = decoder.f64s()?;
    let is_resolved = decoder.u8().is_none_or(|it| it != 0);
    let is_at_head = decoder.u8().is_some_and(|it| it != 0);
    let columns = [
        Some(time_s),
        Some(f64::from(pci)),
        Some(f64::from(ssb_index)),
        Some(phase_rad),
        Some(phase_sigma_rad),
        None,
        None,
        Some(snr_db),
        Some(f64::from(u8::from(is_resolved))),
        Some(f64::from(u8::from(is_at_head))),
    ];
    Some((phase_rad, columns))
}
