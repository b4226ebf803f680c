//! Reader of odometry from files of several formats.

use std::path::Path;

use crate::error::RecordingError;
use crate::mcap::{is_bag, read_odometry_mcap};
use crate::odometry::OdometryLog;
use crate::odometry_csv::read_wheel_odometry_csv;

/// Additional choices for reading odometry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OdometryChoice<'a> {
    /// Topic of the odometry in a bag with several.
    pub topic: Option<&'a str>,
    /// Topic of the IMU with the yaw rate [default: yaw rate of the odometry].
    pub imu_topic: Option<&'a str>,
    /// Distance between left and right wheel in metres, for odometry of single wheels.
    pub track_width_m: Option<f64>,
}

/// Reads odometry from a rosbag2 folder, or from an MCAP or CSV file according to the file
/// extension.
///
/// # Errors
/// Errors of [`read_odometry_mcap`] and [`read_wheel_odometry_csv`]; an error for a topic with a
/// file that has none.
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
