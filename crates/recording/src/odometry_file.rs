//! Odometry out of whatever holds it.

use std::path::Path;

use crate::error::RecordingError;
use crate::mcap::{is_bag, read_odometry_mcap};
use crate::odometry::OdometryLog;
use crate::odometry_csv::read_wheel_odometry_csv;

/// What has to be known of odometry beside where it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OdometryChoice<'a> {
    /// Topic of the odometry, where a bag has several.
    pub topic: Option<&'a str>,
    /// Topic of the IMU that tells the yaw rate, where it is not to be the odometry.
    pub imu_topic: Option<&'a str>,
    /// Distance of left and right wheel in metres, where it is theirs.
    pub track_width_m: Option<f64>,
}

/// Reads odometry: of a rosbag2 folder, or by the name's ending MCAP or CSV.
///
/// # Errors
/// As [`read_odometry_mcap`] and [`read_wheel_odometry_csv`], and for a topic of a file that has none.
pub fn read_odometry(
    path: &Path,
    choice: &OdometryChoice<'_>,
) -> Result<OdometryLog, RecordingError> {
    if is_bag(path) {
        return read_odometry_mcap(path, choice.topic, choice.imu_topic);
    }
    if path.file_name().is_some_and(|it| it == "metadata.yaml") {
        let folder = path.parent().map_or(Path::new("."), |it| it);
        let allowed = format!(
            "give the rosbag2 folder that it is in: {}",
            folder.display()
        );
        return Err(RecordingError::value(
            path,
            "odometry",
            "the metadata of a bag",
            allowed,
        ));
    }
    for (key, topic) in [("topic", choice.topic), ("imu_topic", choice.imu_topic)] {
        if let Some(topic) = topic {
            let allowed = "only an MCAP file or a rosbag2 folder has topics";
            return Err(RecordingError::value(path, key, topic, allowed));
        }
    }
    read_wheel_odometry_csv(path, choice.track_width_m)
}
