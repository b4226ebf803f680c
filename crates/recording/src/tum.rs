//! TUM trajectories: `t x y z qx qy qz qw` per line, separated by single spaces.

use std::fmt::Write as _;
use std::path::Path;

use crate::error::RecordingError;
use crate::file as files;
use crate::foreign::text_of;
use onboard::geometry::{Pose, wrap_angle};
use onboard::time_unit::TimeUnit;

/// Maximum coordinate of a position (m), larger than in any map projection.
const MAX_COORDINATE_M: f64 = 1e8;

/// Pose with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedPose {
    /// Time in seconds.
    pub time_s: f64,
    /// Position and heading.
    pub pose: Pose,
}

/// Returns a TUM trajectory as text, with times in nanoseconds.
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

/// Reads a TUM trajectory; lines that begin with `#` are comments. Roll and pitch are ignored. The
/// heading is NaN if the quaternion is not a rotation.
///
/// # Errors
/// [`RecordingError::Io`]; [`RecordingError::Value`] for a line that is not eight numbers, or whose
/// time is not in seconds.
pub fn read_tum(file: &Path) -> Result<Vec<TimedPose>, RecordingError> {
    let bytes =
        files::read(file, files::MAX_BYTES).map_err(|source| RecordingError::io(file, source))?;
    let text = text_of(&bytes, "TUM").map_err(|message| RecordingError::Syntax {
        file: file.display().to_string(),
        format: "TUM",
        message,
    })?;
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
            pose(line).map_err(|allowed| {
                let line = format!("`{line}`");
                RecordingError::value(file, format!("line {}", index + 1), line, allowed)
            })
        })
        .collect()
}

/// Maximum deviation of a quaternion's norm from 1; numbers with two digits deviate by up to 0.01.
const NORM_TOLERANCE: f64 = 0.02;

fn pose(line: &str) -> Result<TimedPose, String> {
    const ALLOWED: &str = "it must be the eight numbers t x y z qx qy qz qw";
    let numbers = line.split_whitespace().map(str::parse);
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().map_err(|_| {
        if line.contains([',', ';']) {
            format!("{ALLOWED}, separated by blanks, with decimal points")
        } else {
            ALLOWED.to_owned()
        }
    })?;
    let &[time_s, x_m, y_m, z_m, qx, qy, qz, qw] = numbers.as_slice() else {
        return Err(format!("{ALLOWED}, and it is {}", numbers.len()));
    };
    if ![time_s, x_m, y_m, z_m]
        .iter()
        .all(|value| value.is_finite())
    {
        return Err("t, x, y and z must be finite".to_owned());
    }
    if [x_m, y_m].iter().any(|it| it.abs() > MAX_COORDINATE_M) {
        return Err("x and y must be within 1e8 m of 0".to_owned());
    }
    if let Some(unit) = TimeUnit::of_epoch(time_s) {
        return Err(format!("t must be in seconds, and is likely in {unit}"));
    }
    let norm = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
    // Yaw of a unit quaternion.
    let [qx, qy, qz, qw] = [qx, qy, qz, qw].map(|it| it / norm);
    let heading_rad = (2.0 * (qw * qz + qx * qy)).atan2(1.0 - 2.0 * (qy * qy + qz * qz));
    let is_rotation = (norm - 1.0).abs() < NORM_TOLERANCE;
    Ok(TimedPose {
        time_s,
        pose: Pose {
            x_m,
            y_m,
            heading_rad: if is_rotation { heading_rad } else { f64::NAN },
        },
    })
}
