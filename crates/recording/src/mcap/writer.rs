//! Writer of poses, verdicts and diagnostics to an MCAP file.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::cdr::Encoder;
use super::schema::{DIAGNOSTICS, ODOMETRY, Schema, TRANSFORMS, UNOBSERVED, VERDICT};
use onboard::AngleResult;
use onboard::geometry::{Pose, wrap_angle};
use onboard::localize::PoseEstimate;

/// Indices of x, y and yaw among x, y, z, roll, pitch, yaw.
const PLANE: [usize; 3] = [0, 1, 5];

/// QoS profile that rosbag2 needs for playback: reliable, keep last 10, volatile.
const QOS_PROFILES: &str = "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n  \
    deadline:\n    sec: 9223372036\n    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    \
    nsec: 854775807\n  liveliness: 1\n  liveliness_lease_duration:\n    sec: 9223372036\n    \
    nsec: 854775807\n  avoid_ros_namespace_conventions: false";

/// Motion of the vehicle in its own frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist {
    /// Speed along the forward axis in m/s.
    pub speed_mps: f64,
    /// Variance of the speed in (m/s)².
    pub speed_variance: f64,
    /// Yaw rate in rad/s, counter-clockwise, and its variance in (rad/s)².
    pub yaw_rate: Option<(f64, f64)>,
}

/// Names of coordinate frames (REP-105).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frames<'a> {
    /// Frame of the pose.
    pub parent: &'a str,
    /// Frame of the twist.
    pub child: &'a str,
}

impl Frames<'_> {
    /// Frames of a localizer's pose.
    pub const MAP: Frames<'static> = Frames {
        parent: "map",
        child: "base_link",
    };
    /// Frames of an odometry pose.
    pub const ODOM: Frames<'static> = Frames {
        parent: "odom",
        child: "base_link",
    };
}

/// Severity of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiagnosticLevel {
    /// No problem.
    Ok = 0,
    /// Warning.
    Warn = 1,
    /// Error.
    Error = 2,
    /// No recent data.
    Stale = 3,
}

/// One diagnosis.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DiagnosticStatus {
    /// Severity.
    pub level: DiagnosticLevel,
    /// Name of the component.
    pub name: String,
    /// Short description.
    pub message: String,
    /// Details as key and value.
    pub values: Vec<(String, String)>,
}

/// Writer of an MCAP file; [`finish`](Self::finish) completes the file.
pub struct McapWriter<W: Write + Seek> {
    file: Writer<W>,
    /// Channel and next sequence number of each topic.
    topics: BTreeMap<String, (u16, u32)>,
    message: Encoder,
}

impl<W: Write> McapWriter<NoSeek<W>> {
    /// Creates a file whose chunks are compressed in memory and written as a whole, for a
    /// destination that only appends. Therefore, an interrupted write never leaves a chunk with an
    /// invalid length in the middle of the file.
    ///
    /// # Errors
    /// [`McapError`] if the destination cannot be written.
    pub fn appending(file: W) -> Result<Self, McapError> {
        // Zstandard's own threads cost more than they save for chunks of a few kilobytes.
        let options = WriteOptions::new()
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .disable_seeking(true);
        Self::with_options(NoSeek::new(file), options)
    }
}

impl<W: Write + Seek> McapWriter<W> {
    /// Creates a file.
    ///
    /// # Errors
    /// [`McapError`] if the file cannot be written.
    pub fn new(file: W) -> Result<Self, McapError> {
        Self::with_compression(file, None)
    }

    /// Creates a file whose chunks are compressed by Zstandard to about a tenth of their size.
    ///
    /// # Errors
    /// [`McapError`] if the file cannot be written.
    pub fn compressed(file: W) -> Result<Self, McapError> {
        Self::with_compression(file, Some(Compression::Zstd))
    }

    fn with_compression(file: W, compression: Option<Compression>) -> Result<Self, McapError> {
        Self::with_options(file, WriteOptions::new().compression(compression))
    }

    fn with_options(file: W, options: WriteOptions) -> Result<Self, McapError> {
        let options = options
            .profile("ros2")
            .library(concat!("access-av ", env!("CARGO_PKG_VERSION")));
        Ok(Self {
            file: options.create(file)?,
            topics: BTreeMap::new(),
            message: Encoder::default(),
        })
    }

    /// Completes the current chunk and flushes the destination. All messages written before this call can be
    /// read from the file even if no further byte is written.
    ///
    /// # Errors
    /// [`McapError`] if the destination cannot be written.
    pub fn flush(&mut self) -> Result<(), McapError> {
        self.file.flush()
    }

    /// Writes a pose as `nav_msgs/msg/Odometry`. Unobserved axes have a variance of 1e6, and all
    /// axes if the localizer provides no covariance.
    ///
    /// # Errors
    /// [`McapError`] if the message cannot be written.
    pub fn odometry(
        &mut self,
        topic: &str,
        frames: Frames<'_>,
        estimate: &PoseEstimate,
        twist: &Twist,
    ) -> Result<(), McapError> {
        let pose = estimate.pose;
        let (qz, qw) = (0.5 * wrap_angle(pose.heading_rad)).sin_cos();
        header(&mut self.message, estimate.time_s, frames.parent).string(frames.child);
        for value in [pose.x_m, pose.y_m, 0.0, 0.0, 0.0, qz, qw] {
            self.message.f64(value);
        }
        for value in pose_covariance(estimate) {
            self.message.f64(value);
        }
        let (yaw_rate_radps, yaw_rate_variance) = twist.yaw_rate.unwrap_or((0.0, UNOBSERVED));
        for value in [twist.speed_mps, 0.0, 0.0, 0.0, 0.0, yaw_rate_radps] {
            self.message.f64(value);
        }
        let mut covariance = unobserved();
        // A wheeled vehicle has no lateral velocity.
        for (axis, variance) in
            PLANE
                .into_iter()
                .zip([twist.speed_variance, 1e-4, yaw_rate_variance])
        {
            covariance[axis * 7] = variance;
        }
        for value in covariance {
            self.message.f64(value);
        }
        self.write(topic, &ODOMETRY, estimate.time_s)
    }

    /// Writes transforms as `tf2_msgs/msg/TFMessage`: the pose of each child frame in its parent (REP-105).
    ///
    /// # Errors
    /// [`McapError`] if the message cannot be written.
    pub fn transforms(
        &mut self,
        time_s: f64,
        transforms: &[(Frames<'_>, Pose)],
    ) -> Result<(), McapError> {
        self.message.start().u32(transforms.len() as u32);
        for (frames, pose) in transforms {
            let (qz, qw) = (0.5 * wrap_angle(pose.heading_rad)).sin_cos();
            stamp(&mut self.message, time_s, frames.parent).string(frames.child);
            for value in [pose.x_m, pose.y_m, 0.0, 0.0, 0.0, qz, qw] {
                self.message.f64(value);
            }
        }
        self.write("/tf", &TRANSFORMS, time_s)
    }

    /// Writes the localizer's result for an angle as `access_av_msgs/msg/AngleVerdict`.
    ///
    /// # Errors
    /// [`McapError`] if the message cannot be written.
    pub fn verdict(&mut self, topic: &str, angle_result: &AngleResult) -> Result<(), McapError> {
        let (ssb, verdict) = (&angle_result.ssb, &angle_result.verdict);
        let measured = angle_result.measured.as_ref();
        header(&mut self.message, ssb.time_s, "base_link")
            .u16(ssb.pci)
            .u8(ssb.ssb_index)
            .u8(u8::from(verdict.accepted))
            .string(verdict.reason.name())
            .f64(measured.map_or(f64::NAN, |it| it.phase_rad))
            .f64(measured.map_or(f64::NAN, |it| it.phase_sigma_rad))
            .f64(ssb.snr_db)
            .f64(verdict.mahalanobis_squared.unwrap_or(f64::NAN))
            .f64(verdict.threshold.unwrap_or(f64::NAN))
            .f64(angle_result.wake_up_time_s)
            .u8(u8::from(measured.is_some_and(|it| it.resolved)))
            .u8(u8::from(measured.is_some_and(|it| it.kind.is_at_head())));
        self.write(topic, &VERDICT, ssb.time_s)
    }

    /// Writes diagnoses as `diagnostic_msgs/msg/DiagnosticArray`.
    ///
    /// # Errors
    /// [`McapError`] if the message cannot be written.
    pub fn diagnostics(
        &mut self,
        time_s: f64,
        statuses: &[DiagnosticStatus],
    ) -> Result<(), McapError> {
        let message = header(&mut self.message, time_s, "").u32(statuses.len() as u32);
        for status in statuses {
            message
                .u8(status.level as u8)
                .string(&status.name)
                .string(&status.message)
                .string("");
            message.u32(status.values.len() as u32);
            for (key, value) in &status.values {
                message.string(key).string(value);
            }
        }
        self.write("/diagnostics", &DIAGNOSTICS, time_s)
    }

    /// Completes the file.
    ///
    /// # Errors
    /// [`McapError`] if the file cannot be written.
    pub fn finish(mut self) -> Result<(), McapError> {
        self.file.finish().map(|_| ())
    }

    fn write(&mut self, topic: &str, schema: &Schema, time_s: f64) -> Result<(), McapError> {
        if !self.topics.contains_key(topic) {
            let id = self
                .file
                .add_schema(schema.name, "ros2msg", schema.definition.as_bytes())?;
            let metadata =
                BTreeMap::from([("offered_qos_profiles".to_owned(), QOS_PROFILES.to_owned())]);
            let channel = self.file.add_channel(id, topic, "cdr", &metadata)?;
            self.topics.insert(topic.to_owned(), (channel, 0));
        }
        let Some((channel_id, sequence)) = self.topics.get_mut(topic) else {
            return Ok(());
        };
        let time_ns = nanoseconds(time_s);
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        *sequence += 1;
        self.file
            .write_to_known_channel(&header, self.message.bytes())
    }
}

/// Converts a time to nanoseconds since the epoch; negative times become 0.
fn nanoseconds(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}

/// Starts a message with a `std_msgs/msg/Header`.
fn header<'a>(message: &'a mut Encoder, time_s: f64, frame: &str) -> &'a mut Encoder {
    stamp(message.start(), time_s, frame)
}

/// Adds a `std_msgs/msg/Header`.
fn stamp<'a>(message: &'a mut Encoder, time_s: f64, frame: &str) -> &'a mut Encoder {
    let time_ns = nanoseconds(time_s);
    message
        .i32((time_ns / 1_000_000_000) as i32)
        .u32((time_ns % 1_000_000_000) as u32)
        .string(frame)
}

/// Returns a 6 × 6 covariance, row by row (REP-103), without any observed axis.
fn unobserved() -> [f64; 36] {
    let mut covariance = [0.0; 36];
    covariance
        .iter_mut()
        .step_by(7)
        .for_each(|variance| *variance = UNOBSERVED);
    covariance
}

fn pose_covariance(estimate: &PoseEstimate) -> [f64; 36] {
    let mut covariance = unobserved();
    if let Some(known) = estimate.covariance {
        for (i, row) in PLANE.into_iter().zip(known) {
            for (j, value) in PLANE.into_iter().zip(row) {
                covariance[6 * i + j] = value;
            }
        }
    }
    covariance
}
