//! Angles out of whatever holds them.

use std::path::Path;

use crate::angle_log::{AngleLog, read_angle_log};
use crate::error::RecordingError;
use crate::mcap::read_angles_mcap;

/// Reads angles: of a rosbag2 folder, or by the name's ending MCAP or CSV.
///
/// # Errors
/// As [`read_angles_mcap`] and [`read_angle_log`], and for a topic of a file that has none.
pub fn read_angles(path: &Path, topic: Option<&str>) -> Result<AngleLog, RecordingError> {
    let ends_with = |extension: &str| {
        let found = path.extension();
        found.is_some_and(|it| it.eq_ignore_ascii_case(extension))
    };
    if path.is_dir() || ends_with("mcap") || ends_with("db3") {
        return read_angles_mcap(path, topic);
    }
    if let Some(topic) = topic {
        let allowed = "only an MCAP file or a rosbag2 folder has topics";
        return Err(RecordingError::value(path, "topic", topic, allowed));
    }
    read_angle_log(path)
}
