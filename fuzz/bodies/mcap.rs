//! Odometry, IMU and angles of arbitrary MCAP files, alone and as one of two files of a bag.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use recording::{OdometryLog, RecordingError, read_angles_mcap, read_odometry_mcap};

static NEXT: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// Folder of this thread's bag.
    static BAG: PathBuf = {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("access-av-fuzz-bag-{}-{number}", std::process::id());
        std::env::temp_dir().join(name)
    };
}

pub fn run(input: &[u8]) {
    BAG.with(|bag| {
        std::fs::create_dir_all(bag).expect("a directory to write to");
        let [first, second] = ["b.mcap", "a.mcap"].map(|name| bag.join(name));
        std::fs::write(&first, input).expect("the same directory");
        let alone = read_odometry_mcap(&first, None, None);
        let asked = read_odometry_mcap(&first, Some("/odom"), Some("/imu"));
        std::fs::write(&second, input).expect("the same directory");
        let twice = read_odometry_mcap(bag, None, None);
        for read in [&alone, &asked, &twice] {
            check(read);
        }
        if let Ok(log) = read_angles_mcap(&first, None) {
            assert!(
                log.angles
                    .iter()
                    .all(|it| it.measured.phase_rad.is_finite())
            );
            assert!(log.remarks.iter().all(|it| !it.to_string().is_empty()));
        }
        // Repeated messages add only remarks. A time stamp is checked against the other
        // stamps, so that repetition may change the diagnosis of a damaged log.
        if let (Ok(alone), Ok(twice)) = (&alone, &twice)
            && alone.remarks.is_empty()
        {
            assert_eq!(alone.samples.len(), twice.samples.len());
        }
        std::fs::remove_dir_all(bag).expect("written above");
    });
}

fn check(read: &Result<OdometryLog, RecordingError>) {
    match read {
        Ok(log) => {
            assert!(log.samples.iter().all(|it| {
                let rate = it.yaw_rate_radps;
                [it.time_s, it.distance_m, it.speed_mps, rate.unwrap_or(0.0)]
                    .into_iter()
                    .all(f64::is_finite)
            }));
            assert!(log.samples.windows(2).all(|it| it[0].time_s < it[1].time_s));
            assert!(log.remarks.iter().all(|it| !it.to_string().is_empty()));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}
