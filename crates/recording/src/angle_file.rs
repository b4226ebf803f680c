//! Reader of angles from files of several formats.

use std::path::Path;

use crate::angle_log::{AngleLog, read_angle_log};
use crate::error::RecordingError;
use crate::mcap::{is_bag, read_angles_mcap};

/// Reads angles from a rosbag2 folder, or from an MCAP or CSV file according to the file extension.
///
/// # Errors
/// Errors of [`read_angles_mcap`] and [`read_angle_log`]; an error for a topic with a file that has
/// none.
pub fn read_angles(path: &Path, topic: Option<&str>) -> Result<AngleLog, RecordingError> {
    if is_bag(path) {
        return read_angles_mcap(path, topic);
    }
    if let Some(topic) = topic {
        let allowed = "only an MCAP file or a rosbag2 folder has topics";
        return Err(RecordingError::value(path, "topic", topic, allowed));
    }
    read_angle_log(path)
}
