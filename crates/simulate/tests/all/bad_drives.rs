//! Recorded drives with errors: each error is reported, and the pose is as if the erroneous item
//! were missing.

use crate::common;
use std::fs;
use std::path::{Path, PathBuf};

use mcap::MessageStream;
use onboard::localize::UpdateReason;
use recording::replay::{LocatedDrive, StartChoice, locate_angles};
use recording::{
    AngleLog, OdometryLog, read_angle_log, read_odometry_csv, write_angle_log, write_drive_mcap,
    write_odometry_csv,
};
use simulate::Step;
use simulate::scenario::Scenario;

use crate::common::{changed, unguarded, value};

/// A drive as files, with its truth.
struct Drive {
    dir: PathBuf,
    scenario: Scenario,
    odometry: Vec<String>,
    angles: Vec<String>,
    truth: Vec<Step>,
}

impl Drive {
    fn new(name: &str) -> Self {
        let dir = common::scratch(name);
        let road = value("[{ length_m = 60.0, turn_rad = 0.1 }]");
        let scenario = changed("paper-real-odometry-2", [("site.road.segments", road)]);
        let (odometry, angles, record) = common::logs(&scenario, 4);
        write_odometry_csv(&dir.join("odometry.csv"), &odometry.samples).unwrap();
        write_angle_log(&dir.join("angles.csv"), &angles.angles).unwrap();
        let lines = |name: &str| {
            let text = fs::read_to_string(dir.join(name)).unwrap();
            text.lines().map(str::to_owned).collect()
        };
        Self {
            odometry: lines("odometry.csv"),
            angles: lines("angles.csv"),
            scenario,
            truth: record.steps,
            dir,
        }
    }

    /// Locates the drive from its current files.
    fn locate(&self) -> LocatedDrive {
        let (odometry, angles) = (self.dir.join("odometry.csv"), self.dir.join("angles.csv"));
        fs::write(&odometry, self.odometry.join("\n")).unwrap();
        fs::write(&angles, self.angles.join("\n")).unwrap();
        let odometry = read_odometry_csv(&odometry).unwrap();
        let angles = read_angle_log(&angles).unwrap();
        self.locate_these(&odometry, &angles)
    }

    fn locate_these(&self, odometry: &OdometryLog, angles: &AngleLog) -> LocatedDrive {
        let (site, vehicle) = (&self.scenario.site, &self.scenario.vehicle);
        let start = StartChoice::At(self.truth[0].truth);
        locate_angles(site, vehicle, start, odometry, angles, false).unwrap()
    }

    /// Returns the largest error of a pose, normalised by its standard deviation.
    fn worst(&self, drive: &LocatedDrive) -> f64 {
        let deviations = drive.poses.iter().filter_map(|pose| {
            let number = (pose.estimate.time_s / 0.02).round() as usize;
            let truth = self.truth.get(number)?.truth.point();
            let [larger, _] = pose.estimate.principal_variances();
            let error_m = pose.estimate.pose.point().distance_m(truth);
            // The start is known exactly, with a singular covariance.
            (number > 50).then(|| error_m / larger.sqrt())
        });
        deviations.fold(0.0, f64::max)
    }

    /// Returns the texts of the diagnoses in the MCAP file.
    fn diagnoses(&self, drive: &LocatedDrive) -> String {
        let file = self.dir.join("drive.mcap");
        write_drive_mcap(&file, drive).unwrap();
        diagnoses(&file)
    }
}

fn diagnoses(file: &Path) -> String {
    let bytes = fs::read(file).unwrap();
    let messages = MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    messages
        .filter(|message| message.channel.topic == "/diagnostics")
        .map(|message| String::from_utf8_lossy(&message.data).into_owned())
        .collect()
}

#[test]
fn a_drive_without_errors_has_no_remarks() {
    let drive = Drive::new("drive-sound");
    let located = drive.locate();
    assert_eq!(located.remarks, []);
    assert!(drive.worst(&located) < 4.5);
    let report = drive.diagnoses(&located);
    assert!(report.contains("no remarks") && !report.contains("1 remark"));
}

#[test]
fn bad_odometry_is_reported_and_ignored() {
    let sound = Drive::new("drive-odometry").locate();
    let mut drive = Drive::new("drive-odometry");
    let duplicate = drive.odometry[200].clone();
    let earlier = drive.odometry[100].clone();
    let time_s = |line: &str| line.split(',').next().unwrap().to_owned();
    let between = "3.9701,NaN,1.0".to_owned();
    for (place, line) in [
        (300, "4.9701,zero,1.0".to_owned()),
        (250, earlier.clone()),
        (201, duplicate.clone()),
        (199, between),
    ] {
        drive.odometry.insert(place, line);
    }
    let located = drive.locate();
    let texts: Vec<&str> = located.remarks.iter().map(|it| it.text.as_str()).collect();
    let expected = [
        "line 200: left out, distance_m is missing or not finite".to_owned(),
        format!(
            "line 203: left out, a second sample at {} s",
            time_s(&duplicate)
        ),
        format!("line 253: left out, {} s comes after", time_s(&earlier)),
        "line 304: left out, distance_m `zero` is not a number".to_owned(),
    ];
    assert_eq!(texts.len(), expected.len(), "{texts:?}");
    let report = drive.diagnoses(&located);
    for (text, expected) in texts.iter().zip(&expected) {
        assert!(text.contains(expected), "{text}: {expected}");
        assert!(report.contains(text), "{text}");
    }
    assert!(report.contains("1 remark"));
    // The state equals the state without the erroneous samples.
    assert_eq!(located.poses, sound.poses);
}

#[test]
fn a_gap_and_a_reset_of_the_odometer_are_reported_and_bridged() {
    let mut drive = Drive::new("drive-gap");
    // The counter restarts at zero after eight seconds.
    let reset_m: f64 = drive.odometry[400]
        .split(',')
        .nth(1)
        .unwrap()
        .parse()
        .unwrap();
    for line in drive.odometry.iter_mut().skip(400) {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        let distance_m: f64 = fields[1].parse().unwrap();
        fields[1] = (distance_m - reset_m).to_string();
        *line = fields.join(",");
    }
    // One second of samples is missing.
    drive.odometry.drain(500..550);
    let located = drive.locate();
    let texts: Vec<&str> = located.remarks.iter().map(|it| it.text.as_str()).collect();
    assert_eq!(texts.len(), 2, "{texts:?}");
    assert!(texts[0].contains("distance_m jumps by -") && texts[0].contains("is used instead"));
    assert!(
        texts[1].contains("line 501: 1.020 s after the one before"),
        "{}",
        texts[1]
    );
    let report = drive.diagnoses(&located);
    assert!(texts.iter().all(|text| report.contains(text)));
    let worst = drive.worst(&located);
    assert!(worst < 4.5, "{worst}");
}

#[test]
fn bad_angles_are_reported_and_ignored() {
    let sound = Drive::new("drive-angles").locate();
    let mut drive = Drive::new("drive-angles");
    let changed = |line: &str, column: usize, value: &str| {
        let mut fields: Vec<&str> = line.split(',').collect();
        fields[column] = value;
        fields.join(",")
    };
    let late = drive.angles[100].clone();
    for (place, column, value) in [
        (700, 4, "0"),
        (600, 4, "-0.1"),
        (500, 3, "NaN"),
        (400, 1, "999"),
    ] {
        let line = changed(&drive.angles[place], column, value);
        drive.angles.insert(place, line);
    }
    drive.angles.insert(300, late);
    let located = drive.locate();
    let texts: Vec<&str> = located.remarks.iter().map(|it| it.text.as_str()).collect();
    let expected = [
        "1 angles are of pci 999, ssb_index 0, which the site does not have",
        "line 301: time_s 0.98 is earlier than a previous time (1 lines in total)",
        "line 301: left out, pci 1 has the same angle at 0.98 s twice",
        "line 503: left out, phase_rad is not finite",
        "line 604: left out, phase_sigma_rad -0.1 is not above 0 (and 1 more like this)",
    ];
    assert_eq!(texts.len(), expected.len(), "{texts:?}");
    let report = drive.diagnoses(&located);
    for (text, expected) in texts.iter().zip(&expected) {
        assert!(text.contains(expected), "{text}: {expected}");
        assert!(report.contains(text), "{text}");
    }
    // Each readable angle gets its own verdict.
    let refused = |reason| {
        let aoa_estimates = located.aoa_estimates.iter();
        aoa_estimates
            .filter(|it| it.verdict.reason == reason)
            .count()
    };
    assert_eq!(refused(UpdateReason::UnknownRadioHead), 1);
    // The repeated angle is left out before the localizer could reject it as too late.
    assert_eq!(refused(UpdateReason::TooLate), 0);
    assert!(report.contains("refused: unknown radio head"));
    assert_eq!(located.poses, sound.poses);
}

#[test]
fn an_angle_without_a_variance_is_unusable_for_every_estimator() {
    let mut drive = Drive::new("drive-variance");
    drive.angles.truncate(3); // a comment, the columns, and an angle
    let odometry = {
        drive.locate();
        read_odometry_csv(&drive.dir.join("odometry.csv")).unwrap()
    };
    let (_, mut angles, _) = common::logs(&unguarded("paper-real-odometry-2"), 4);
    angles.angles.truncate(5);
    let mut sound = angles.clone();
    sound.angles.truncate(1);
    for (angle, sigma_rad) in
        angles
            .angles
            .iter_mut()
            .skip(1)
            .zip([f64::NAN, -0.1, 0.0, f64::INFINITY])
    {
        angle.measured.phase_sigma_rad = sigma_rad;
    }
    let located = drive.locate_these(&odometry, &angles);
    let reasons: Vec<_> = located
        .aoa_estimates
        .iter()
        .map(|it| it.verdict.reason)
        .collect();
    assert_eq!(reasons[1..], [UpdateReason::Unusable; 4]);
    let sound = drive.locate_these(&odometry, &sound);
    assert_eq!(located.poses, sound.poses);
}
