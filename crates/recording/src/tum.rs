//! TUM trajectories: `t x y z qx qy qz qw` per line, single spaces, nothing else.

use std::fmt::Write as _;
use std::path::Path;

use crate::error::RecordingError;
use crate::file as files;
use onboard::geometry::{Pose, wrap_angle};

/// A day of poses at 50 Hz.
const MOST_BYTES: u64 = 512 << 20;

/// A pose and its time in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedPose {
    /// Time in seconds.
    pub time_s: f64,
    /// Place and heading.
    pub pose: Pose,
}

/// A TUM trajectory as text; times to the nanosecond.
pub fn tum_text(poses: &[TimedPose]) -> String {
    let mut text = String::with_capacity(poses.len() * 80);
    for TimedPose { time_s, pose } in poses {
        // A rotation about z by ψ is the quaternion (0, 0, sin ψ/2, cos ψ/2); a wrapped ψ makes it unique.
        let (qz, qw) = (0.5 * wrap_angle(pose.heading_rad)).sin_cos();
        // Writing into a string does not fail.
        let _ = writeln!(
            text,
            "{time_s:.9} {:.9} {:.9} 0 0 0 {qz:.12} {qw:.12}",
            pose.x_m, pose.y_m
        );
    }
    text
}

/// Writes a TUM trajectory.
///
/// # Errors
/// [`RecordingError::Io`].
pub fn write_tum(file: &Path, poses: &[TimedPose]) -> Result<(), RecordingError> {
    files::write(file, tum_text(poses).as_bytes())
}

/// Reads a TUM trajectory; lines that begin with `#` are comments. Roll and pitch are dropped.
///
/// # Errors
/// [`RecordingError::Io`], or [`RecordingError::Value`] naming the line that is not eight numbers
/// with a unit quaternion.
pub fn read_tum(file: &Path) -> Result<Vec<TimedPose>, RecordingError> {
    let bytes = files::read(file, MOST_BYTES).map_err(|source| RecordingError::io(file, source))?;
    let text = String::from_utf8_lossy(&bytes);
    let lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .filter(|(_, line)| {
            let line = line.trim();
            !line.is_empty() && !line.starts_with('#')
        });
    lines
        .map(|(index, line)| {
            pose(line).ok_or_else(|| {
                let allowed = "it must be the eight numbers t x y z qx qy qz qw";
                let line = format!("`{line}`");
                RecordingError::value(file, format!("line {}", index + 1), line, allowed)
            })
        })
        .collect()
}

fn pose(line: &str) -> Option<TimedPose> {
    let numbers: Vec<f64> = line
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()
        .ok()?;
    let &[time_s, x_m, y_m, z_m, qx, qy, qz, qw] = numbers.as_slice() else {
        return None;
    };
    let norm = qx * qx + qy * qy + qz * qz + qw * qw;
    let finite = [time_s, x_m, y_m, z_m]
        .iter()
        .all(|value| value.is_finite());
    // Yaw of a unit quaternion.
    let heading_rad = (2.0 * (qw * qz + qx * qy)).atan2(1.0 - 2.0 * (qy * qy + qz * qz));
    (finite && (norm - 1.0).abs() < 1e-3).then_some(TimedPose {
        time_s,
        pose: Pose {
            x_m,
            y_m,
            heading_rad,
        },
    })
}
