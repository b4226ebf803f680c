//! MCAP files of ROS 2 tools: profile `ros2`, messages in CDR, schemas in `ros2msg`.
//!
//! Written messages: `nav_msgs/msg/Odometry` with covariance and twist, `tf2_msgs/msg/TFMessage`,
//! `diagnostic_msgs/msg/DiagnosticArray` and
//! [`access_av_msgs/msg/AngleVerdict`](McapWriter::verdict). Read messages: odometry,
//! `sensor_msgs/msg/Imu` and angle verdicts, from a file or the files of a rosbag2 folder.

mod angles;
mod bag;
mod cdr;
mod drive;
mod messages;
mod motion;
#[cfg(test)]
mod motion_tests;
mod reader;
mod schema;
mod turn_rate;
mod writer;

pub use ::mcap::write::NoSeek;
pub use angles::read_angles_mcap;
pub(crate) use bag::is_bag;
pub use drive::write_drive_mcap;
pub use reader::read_odometry_mcap;
pub use writer::{DiagnosticLevel, DiagnosticStatus, Frames, McapWriter, Twist};
