//! Recorded drives: readers, writers and [replay]. [scan] searches a recording for cells.
//!
//! | what | format | |
//! |---|---|---|
//! | IQ of one or more antennas | [SigMF](sigmf); one raw file per antenna | read, written; read |
//! | angles of arrival | [CSV](read_angle_log); [verdicts](read_angles_mcap) | read, written |
//! | ranges | [CSV](read_range_log); [OpenAirInterface](read_prs_log) | read |
//! | odometry, IMU | [CSV](read_odometry_csv); [MCAP, rosbag2](mcap) | read; odometry written |
//! | trajectories | [TUM](write_tum) | read, written |
//! | poses, verdicts, diagnoses | [MCAP](mcap) | written |
//! | sites, vehicles, scenarios, platforms | [TOML](Files) | read |
//!
//! A file that cannot be used at all is a [`RecordingError`]. Single invalid items are omitted and
//! reported next to the data.

mod angle_file;
mod angle_log;
mod clock_faults;
mod counter_jumps;
mod error;
mod file;
mod foreign;
mod library;
pub mod mcap;
mod number;
mod odometry;
mod odometry_csv;
mod odometry_file;
mod prs_log;
mod range_log;
pub mod replay;
mod road_file;
pub mod scan;
pub mod sigmf;
mod table;
mod text;
mod tum;
mod value_spikes;

pub use angle_file::read_angles;
pub use angle_log::{
    AngleLog, AngleRemark, LoggedAngle, angle_log_of_columns, read_angle_log, write_angle_log,
};
pub use error::RecordingError;
pub use file::{MAX_BYTES as MAX_FILE_BYTES, write as write_file};
pub use library::{Files, load};
pub use mcap::{McapWriter, read_angles_mcap, read_odometry_mcap, write_drive_mcap};
pub use odometry::{OdometryFields, OdometryIssue, OdometryLog, OdometryRemark};
pub use odometry_csv::{read_odometry_csv, read_wheel_odometry_csv, write_odometry_csv};
pub use odometry_file::{OdometryChoice, read_odometry};
pub use prs_log::{is_prs_log, read_prs_log};
pub use range_log::{LoggedRange, RangeLog, is_range_log, read_range_log};
pub use sigmf::{
    Annotation, Capture, Datatype, Recording, RecordingWarning, RecordingWriter, Segment,
    WriterSettings,
};
pub use tum::{TimedPose, read_tum, tum_text, write_tum};
