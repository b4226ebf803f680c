//! Text files: CSV of odometry, wheels, angles and roads, roads as GeoJSON, TUM.
//!
//! Byte 0: kind of file. The remaining bytes are the file.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use onboard::settings::Library;
use recording::{Files, read_angle_log, read_odometry_csv, read_tum, read_wheel_odometry_csv};

static NEXT: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// Path of this thread's file.
    static STEM: PathBuf = {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("access-av-fuzz-table-{}-{number}", std::process::id());
        std::env::temp_dir().join(name)
    };
}

pub fn run(input: &[u8]) {
    let [what, rest @ ..] = input else {
        return;
    };
    STEM.with(|stem| {
        let ending = if what % 6 == 5 { "geojson" } else { "csv" };
        let file = stem.with_extension(ending);
        std::fs::write(&file, rest).expect("a directory to write to");
        match what % 6 {
            0 | 1 => {
                let read = match what % 6 {
                    0 => read_odometry_csv(&file),
                    _ => read_wheel_odometry_csv(&file, Some(0.6)),
                };
                if let Ok(log) = with_message(read) {
                    for it in &log.samples {
                        let rate = it.yaw_rate_radps.unwrap_or(0.0);
                        let all = [it.time_s, it.distance_m, it.speed_mps, rate];
                        assert!(all.into_iter().all(f64::is_finite));
                    }
                    assert!(log.samples.windows(2).all(|it| it[0].time_s < it[1].time_s));
                    assert!(log.remarks.iter().all(|it| !it.to_string().is_empty()));
                }
            }
            2 => {
                if let Ok(log) = with_message(read_angle_log(&file)) {
                    for it in &log.angles {
                        // The array model converts between phase and angle: the file needs only one of them.
                        let it = &it.measured;
                        assert!(it.time_s.is_finite());
                        assert!(it.phase_rad.is_finite() || it.angle_rad.is_finite());
                    }
                    assert!(log.remarks.iter().all(|it| !it.to_string().is_empty()));
                }
            }
            3 => {
                if let Ok(poses) = with_message(read_tum(&file)) {
                    let finite = |it: &recording::TimedPose| {
                        it.time_s.is_finite() && it.pose.x_m.is_finite()
                    };
                    assert!(poses.iter().all(finite));
                }
            }
            _ => {
                let points = Files.points_m(&file.display().to_string(), "");
                if let Ok(points) = with_message(points) {
                    assert!(points.iter().flatten().all(|it| it.is_finite()));
                }
            }
        }
        std::fs::remove_file(&file).expect("written above");
    });
}

/// Asserts that an error has a message.
fn with_message<T, E: std::fmt::Display>(read: Result<T, E>) -> Result<T, E> {
    if let Err(error) = &read {
        assert!(!error.to_string().is_empty());
    }
    read
}
