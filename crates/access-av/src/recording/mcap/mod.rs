//! MCAP as ROS 2 tools write and read it: profile `ros2`, messages in CDR, schemas in `ros2msg`.
//!
//! Written are `nav_msgs/msg/Odometry` with covariance and twist, `diagnostic_msgs/msg/
//! DiagnosticArray` and [`access_av_msgs/msg/AngleVerdict`](McapWriter::verdict); read is odometry.

mod cdr;
mod drive;
mod reader;
mod writer;

pub use drive::write_drive_mcap;
pub use reader::read_odometry_mcap;
pub use writer::{DiagnosticLevel, DiagnosticStatus, Frames, McapWriter, Twist};

/// Type name and definition of a message.
struct Schema {
    name: &'static str,
    definition: &'static str,
}

const ODOMETRY: Schema = Schema {
    name: "nav_msgs/msg/Odometry",
    definition: include_str!("definitions/nav_msgs-Odometry.msg"),
};
const DIAGNOSTICS: Schema = Schema {
    name: "diagnostic_msgs/msg/DiagnosticArray",
    definition: include_str!("definitions/diagnostic_msgs-DiagnosticArray.msg"),
};
const VERDICT: Schema = Schema {
    name: "access_av_msgs/msg/AngleVerdict",
    definition: include_str!("definitions/access_av_msgs-AngleVerdict.msg"),
};
