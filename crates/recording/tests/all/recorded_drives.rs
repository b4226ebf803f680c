//! Odometry, angles and trajectories are read as they were written; each invalid item is reported
//! and omitted.

use crate::common;
use std::fs::{self, File};
use std::path::Path;

use mcap::{Compression, MessageStream, WriteOptions};
use proptest::prelude::*;

use onboard::AngleResult;
use onboard::geometry::Pose;
use onboard::localize::{
    AngleMeasurement, MeasurementKind, PoseEstimate, UpdateReason, UpdateResult,
};
use onboard::observation::{OdometrySample, SsbDetection};
use recording::mcap::{Frames, Twist};
use recording::{
    LoggedAngle, McapWriter, OdometryIssue, OdometryLog, RecordingError, TimedPose, read_angle_log,
    read_angles, read_angles_mcap, read_odometry_csv, read_odometry_mcap, read_tum,
    write_angle_log, write_odometry_csv, write_tum,
};

fn sample(time_s: f64) -> OdometrySample {
    OdometrySample {
        time_s,
        distance_m: 4.0 * time_s,
        speed_mps: 4.0,
        yaw_rate_radps: Some(0.01),
    }
}

#[test]
fn odometry_csv_round_trips_bit_by_bit() {
    let file = common::scratch("odometry").join("odo.csv");
    let mut samples: Vec<_> = (0..50).map(|k| sample(f64::from(k) * 0.02)).collect();
    write_odometry_csv(&file, &samples).unwrap();
    let log = read_odometry_csv(&file).unwrap();
    assert_eq!((log.samples, log.remarks.len()), (samples.clone(), 0));
    for sample in &mut samples {
        sample.yaw_rate_radps = None;
    }
    write_odometry_csv(&file, &samples).unwrap();
    assert_eq!(read_odometry_csv(&file).unwrap().samples, samples);
}

#[test]
fn bad_odometry_rows_are_reported_one_by_one_and_the_rest_is_kept() {
    let file = common::scratch("odometry-bad").join("odo.csv");
    let rows = [
        "note,time_s,distance_m,speed_mps,yaw_rate_radps", // other columns do not disturb
        "a,0.00,0.0,4.0,",
        "b,0.02,0.08,4.0,0.1",
        "c,0.02,0.08,4.0,0.1", // line 4: duplicate
        "d,0.01,0.04,4.0,0.1", // line 5: backwards
        "e,0.04,NaN,4.0,0.1",  // line 6: not finite
        "f,0.04,zero,4.0,0.1", // line 7: no number
        "g,0.04,0.16",         // line 8: too few fields
        "h,0.04,0.16,4.0,0.1",
        "",
        "i,0.06,0.24,4.0,0.1",
        "j,1.06,4.24,4.0,0.1", // line 12: gap, used
    ];
    fs::write(&file, rows.join("\n")).unwrap();
    let log = read_odometry_csv(&file).unwrap();
    let times: Vec<f64> = log.samples.iter().map(|sample| sample.time_s).collect();
    assert_eq!(times, [0.0, 0.02, 0.04, 0.06, 1.06]);
    assert_eq!(log.samples[0].yaw_rate_radps, None);
    let lines: Vec<usize> = log.remarks.iter().map(|remark| remark.item).collect();
    assert_eq!(lines, [4, 5, 6, 7, 8, 12]);
    let issues: Vec<_> = log.remarks.iter().map(|remark| &remark.issue).collect();
    assert!(matches!(
        issues[..],
        [
            OdometryIssue::Duplicate { .. },
            OdometryIssue::TimeReversed { .. },
            OdometryIssue::NotFinite {
                column: "distance_m"
            },
            OdometryIssue::Malformed(_),
            OdometryIssue::Malformed(_),
            OdometryIssue::Gap { .. },
        ]
    ));
    assert!(
        log.remarks
            .iter()
            .all(|remark| !remark.to_string().is_empty())
    );

    let text = log.remarks[2].to_string();
    assert_eq!(
        text,
        "odometry line 6: left out, distance_m is missing or not finite"
    );

    fs::write(&file, "time_s,yaw_rate_radps\n0,1\n").unwrap();
    let error = read_odometry_csv(&file).unwrap_err();
    assert!(matches!(error, RecordingError::Missing { ref key, .. } if key == "distance_m"));
    assert!(matches!(
        read_odometry_csv(Path::new("/no/such.csv")),
        Err(RecordingError::Io { .. })
    ));
}

/// Notations of spreadsheets, other locales and manual editing.
#[test]
fn odometry_csv_of_all_notations_is_read() {
    let file = common::scratch("odometry-kinds").join("odo.csv");
    let samples: Vec<_> = (0..5).map(|k| sample(f64::from(k) * 0.02)).collect();
    write_odometry_csv(&file, &samples).unwrap();
    let plain = fs::read_to_string(&file).unwrap();
    for text in [
        plain.replace(',', ";"),
        plain.replace(',', "\t"),
        plain.replace(',', " , "),
        plain.replace('\n', "\r\n"),
        plain.replace('\n', "\r"),
        plain.replace('\n', "\n\n"),
        format!("\u{feff}{}", plain.replace("speed_mps", "\"speed_mps\"")),
        format!("\n# of robot 3, left; right\n{plain}\n  \n"),
        plain
            .replace("time_s", "\"where, when\",time_s")
            .replace("\n0", "\n\"a, b\",0"),
    ] {
        fs::write(&file, &text).unwrap();
        let log = read_odometry_csv(&file).unwrap();
        assert_eq!(
            (log.samples, log.remarks.len()),
            (samples.clone(), 0),
            "{text}"
        );
    }
}

#[test]
fn missing_csv_columns_are_reported_with_those_found() {
    let file = common::scratch("odometry-named").join("odo.csv");
    for (text, expected) in [
        (
            "",
            "`time_s` is missing; the first line must name the columns time_s; the file is empty",
        ),
        ("t|v\n0|1\n", "it names t|v"),
        ("Time,speed_mps\n0,1\n", "it names Time, speed_mps"),
        ("time_s,heading\n0,1\n", "it names time_s, heading"),
        (
            "time_s,speed_mps,speed_mps\n0,1,2\n",
            "`speed_mps` is there twice",
        ),
    ] {
        fs::write(&file, text).unwrap();
        let error = read_odometry_csv(&file).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

fn estimate(time_s: f64) -> PoseEstimate {
    let pose = Pose {
        x_m: 4.0 * time_s,
        y_m: -1.0,
        heading_rad: 0.0,
    };
    let covariance = Some([[0.04, 0.0, 0.0], [0.0, 0.09, 0.0], [0.0, 0.0, 1e-4]]);
    PoseEstimate {
        time_s,
        pose,
        covariance,
        integrity: None,
    }
}

fn write_mcap(file: &Path, topics: &[&str], yaw_rate_radps: f64) {
    let mut writer = McapWriter::new(File::create(file).unwrap()).unwrap();
    let twist = Twist {
        speed_mps: 4.0,
        speed_variance: 0.01,
        yaw_rate: Some((yaw_rate_radps, 1e-4)),
    };
    for k in 0..20 {
        for topic in topics {
            let estimate = estimate(f64::from(k) * 0.25);
            writer
                .odometry(topic, Frames::ODOM, &estimate, &twist)
                .unwrap();
        }
    }
    writer.finish().unwrap();
}

#[test]
fn odometry_is_read_from_mcap() {
    let file = common::scratch("odometry-mcap").join("odo.mcap");
    write_mcap(&file, &["/odom"], 0.02);
    let log = read_odometry_mcap(&file, None, None).unwrap();
    assert_eq!((log.samples.len(), log.remarks.len()), (20, 0));
    for (k, sample) in log.samples.iter().enumerate() {
        assert!((sample.time_s - k as f64 * 0.25).abs() < 1e-9);
        assert!((sample.distance_m - k as f64).abs() < 1e-9);
        assert_eq!((sample.speed_mps, sample.yaw_rate_radps), (4.0, Some(0.02)));
    }
    // A yaw rate of zero throughout is the lack of a gyroscope; but the position moves straight along the orientation.
    write_mcap(&file, &["/odom"], 0.0);
    let log = read_odometry_mcap(&file, Some("/odom"), None).unwrap();
    let mut rates = log.samples.iter().map(|sample| sample.yaw_rate_radps);
    assert!(rates.all(|rate| rate == Some(0.0)));
    let remarks: Vec<String> = log.remarks.iter().map(ToString::to_string).collect();
    assert_eq!(
        remarks,
        ["odometry: yaw_rate_radps is taken from pose.orientation of /odom"]
    );
}

/// Rewrites a file with compressed chunks of the same messages, as most recorders write them.
fn compress(file: &Path, compression: Compression) {
    let whole = fs::read(file).unwrap();
    let options = WriteOptions::new()
        .compression(Some(compression))
        .chunk_size(Some(4096));
    let mut writer = options.create(File::create(file).unwrap()).unwrap();
    for message in MessageStream::new(&whole).unwrap() {
        writer.write(&message.unwrap()).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn compressed_mcap_is_read_equally() {
    let dir = common::scratch("odometry-mcap-compressed");
    let plain = dir.join("plain.mcap");
    write_mcap(&plain, &["/odom"], 0.02);
    let expected = read_odometry_mcap(&plain, None, None).unwrap();
    for compression in [Compression::Lz4, Compression::Zstd] {
        let file = dir.join("odo.mcap");
        fs::copy(&plain, &file).unwrap();
        compress(&file, compression);
        assert!(fs::metadata(&file).unwrap().len() < fs::metadata(&plain).unwrap().len());
        assert_eq!(read_odometry_mcap(&file, None, None).unwrap(), expected);
        let whole = fs::read(&file).unwrap();
        fs::write(&file, &whole[..whole.len() / 3]).unwrap();
        // A file that was not closed is read up to its last complete chunk, and reported.
        let partial = read_odometry_mcap(&file, None, None).unwrap();
        assert!((1..expected.samples.len()).contains(&partial.samples.len()));
        assert!(expected.samples.starts_with(&partial.samples));
        assert!(is_truncated(&partial));
    }
}

fn is_truncated(log: &OdometryLog) -> bool {
    log.remarks
        .iter()
        .any(|it| matches!(it.issue, OdometryIssue::Truncated(_)))
}

#[test]
fn an_mcap_record_longer_than_its_chunk_is_rejected() {
    let file = common::scratch("odometry-mcap-chunk").join("odo.mcap");
    write_mcap(&file, &["/odom"], 0.02);
    let mut bytes = fs::read(&file).unwrap();
    let length = |at: usize| usize::from_le_bytes(*bytes[at..].first_chunk().unwrap());
    // Magic bytes, then the header record, then the first chunk: type, length, body.
    let chunk = 8 + (1 + 8 + length(8 + 1));
    assert_eq!(bytes[chunk], mcap::records::op::CHUNK);
    // The body begins with times, size, CRC, an empty compression and the length of the records.
    let first_record = chunk + 1 + 8 + (8 + 8 + 8 + 4) + 4 + 8;
    let too_long = length(chunk + 1) + 20;
    bytes[first_record + 1..][..8].copy_from_slice(&too_long.to_le_bytes());
    fs::write(&file, bytes).unwrap();
    let error = read_odometry_mcap(&file, None, None).unwrap_err();
    assert!(error.to_string().contains("MCAP"), "{error}");
}

/// A damaged length of a name is reported, without an allocation of that size.
#[test]
fn mcap_names_longer_than_their_record_are_rejected() {
    let file = common::scratch("odometry-mcap-damaged").join("odo.mcap");
    write_mcap(&file, &["/odom"], 0.02);
    let whole = fs::read(&file).unwrap();
    for name in ["nav_msgs/msg/Odometry", "/odom"] {
        let start = (4..whole.len())
            .find(|&at| whole[at..].starts_with(name.as_bytes()))
            .unwrap();
        let mut damaged = whole.clone();
        damaged[start - 1] = 0xff;
        fs::write(&file, damaged).unwrap();
        let error = read_odometry_mcap(&file, None, None)
            .unwrap_err()
            .to_string();
        assert!(error.contains("damaged"), "{error}");
    }
}

#[test]
fn mcap_files_without_a_unique_topic_are_rejected() {
    let file = common::scratch("odometry-mcap-bad").join("odo.mcap");
    write_mcap(&file, &["/a", "/b"], 0.0);
    assert!(matches!(
        read_odometry_mcap(&file, None, None),
        Err(RecordingError::Value { .. })
    ));
    assert_eq!(
        read_odometry_mcap(&file, Some("/b"), None)
            .unwrap()
            .samples
            .len(),
        20
    );
    assert!(matches!(
        read_odometry_mcap(&file, Some("/c"), None),
        Err(RecordingError::Missing { .. })
    ));
    let whole = fs::read(&file).unwrap();
    for length in [0, 5, 100, whole.len() / 2, whole.len() - 1] {
        fs::write(&file, &whole[..length]).unwrap();
        match read_odometry_mcap(&file, Some("/a"), None) {
            Ok(log) => assert!(is_truncated(&log), "{length}"),
            Err(error) => assert!(
                matches!(
                    error,
                    RecordingError::Syntax { format: "MCAP", .. } | RecordingError::Missing { .. }
                ),
                "{length}: {error}"
            ),
        }
    }
}

#[test]
fn angle_logs_round_trip_and_invalid_lines_are_omitted() {
    let file = common::scratch("angles").join("angles.csv");
    let angle = |time_s: f64| LoggedAngle {
        ssb: SsbDetection {
            pci: 7,
            ssb_index: 2,
            time_s,
            snr_db: 12.5,
        },
        measured: AngleMeasurement {
            kind: MeasurementKind::Angle,
            time_s,
            phase_rad: 0.1,
            phase_sigma_rad: 0.02,
            angle_rad: 1.5,
            snr_db: 12.5,
            resolved: true,
        },
    };
    let mut angles = [angle(0.0), angle(0.02)];
    angles[1].measured.resolved = false;
    write_angle_log(&file, &angles).unwrap();
    assert_eq!(read_angle_log(&file).unwrap().angles, angles);

    let good = fs::read_to_string(&file).unwrap();
    let bad = "0.04,1008,0,0,0.1,1,0\n0.04,1,-1,0,0.1,1,0\n0.04,1,0,0,-0.1,1,0\n0.04,1,0,0,0,1,0\n\
               0.04,1,0,NaN,0.1,1,0\n0.04,1,0,0,inf,1,0\n0.04,1,0,,0.1,1,0\n0.04,1.5,0,0,0.1,1,0\n\
               1.7e18,1,0,0,0.1,1,0\n";
    fs::write(&file, good + &bad.replace('\n', ",1,0\n")).unwrap();
    let log = read_angle_log(&file).unwrap();
    assert_eq!(log.angles, angles);
    let lines: Vec<usize> = log.remarks.iter().map(|remark| remark.line).collect();
    // After a comment, the header and two good ones.
    assert_eq!(lines, (5..14).collect::<Vec<_>>());
    let nanoseconds = log.remarks.last().unwrap().to_string();
    assert!(nanoseconds.contains("it must be seconds"), "{nanoseconds}");
}

#[test]
fn angles_are_read_from_mcap_verdicts_and_verdicts_without_an_angle_skipped() {
    let folder = common::scratch("angles-mcap");
    let file = folder.join("drive.mcap");
    let verdict = |time_s: f64, angle: Option<(f64, bool)>| {
        let (phase_rad, resolved) = angle.unzip();
        let ssb = SsbDetection {
            pci: 300,
            ssb_index: 7,
            time_s,
            snr_db: 12.5,
        };
        let measured = phase_rad.map(|phase_rad| AngleMeasurement {
            kind: MeasurementKind::Angle,
            time_s,
            phase_rad,
            phase_sigma_rad: 0.02,
            angle_rad: 1.0,
            snr_db: 12.5,
            resolved: resolved == Some(true),
        });
        AngleResult {
            ssb,
            measured,
            verdict: UpdateResult::unused(UpdateReason::Outlier),
            wake_up_time_s: 0.02,
        }
    };
    let results = [
        verdict(1.5, Some((0.25, true))),
        verdict(1.52, None),
        verdict(1.54, Some((-0.5, false))),
    ];
    let mut writer = McapWriter::compressed(File::create(&file).unwrap()).unwrap();
    for angle_result in &results {
        writer.verdict("/access_av/verdicts", angle_result).unwrap();
    }
    writer.finish().unwrap();
    for read in [
        read_angles_mcap(&file, None).unwrap(),
        read_angles(&folder, Some("/access_av/verdicts")).unwrap(),
    ] {
        assert_eq!(read.remarks, []);
        let [first, second] = &read.angles[..] else {
            panic!("{read:?}");
        };
        for (found, expected) in [(first, &results[0]), (second, &results[2])] {
            assert_eq!(
                (found.ssb.pci, found.ssb.ssb_index, found.ssb.snr_db),
                (300, 7, 12.5)
            );
            assert!((found.ssb.time_s - expected.ssb.time_s).abs() < 1e-9);
            let measured = expected.measured.unwrap();
            assert_eq!(found.measured.phase_rad, measured.phase_rad);
            assert_eq!(found.measured.phase_sigma_rad, 0.02);
            assert_eq!(found.measured.resolved, measured.resolved);
        }
    }
    let error = read_angles_mcap(&file, Some("/elsewhere")).unwrap_err();
    assert!(error.to_string().contains("/elsewhere"), "{error}");
    write_mcap(&file, &["/odom"], 0.0);
    let error = read_angles_mcap(&file, None).unwrap_err().to_string();
    assert!(error.contains("AngleVerdict"), "{error}");
    let csv = folder.join("angles.csv");
    let error = read_angles(&csv, Some("/t")).unwrap_err().to_string();
    assert!(error.contains("topics"), "{error}");
}

#[test]
fn an_mcap_file_that_was_not_closed_is_read_up_to_its_last_chunk() {
    let file = common::scratch("not-closed").join("odo.mcap");
    let mut writer = McapWriter::appending(File::create(&file).unwrap()).unwrap();
    let twist = Twist {
        speed_mps: 4.0,
        speed_variance: 0.01,
        yaw_rate: Some((0.02, 1e-4)),
    };
    // The length of the file after each chunk of ten messages.
    let mut lengths = Vec::new();
    for k in 0..40 {
        let estimate = estimate(f64::from(k) * 0.25);
        writer
            .odometry("/odom", Frames::ODOM, &estimate, &twist)
            .unwrap();
        if k % 10 == 9 {
            writer.flush().unwrap();
            lengths.push(fs::metadata(&file).unwrap().len() as usize);
        }
    }
    let bytes = fs::read(&file).unwrap();
    drop(writer);
    assert_eq!(bytes.len(), lengths[3]);
    for cut in lengths[0]..bytes.len() {
        fs::write(&file, &bytes[..cut]).unwrap();
        let complete = 10 * lengths.iter().filter(|it| **it <= cut).count();
        let log = read_odometry_mcap(&file, None, None).unwrap();
        assert!(
            log.samples.len() >= complete,
            "{} at {cut}",
            log.samples.len()
        );
        let remarks: Vec<String> = log.remarks.iter().map(ToString::to_string).collect();
        let named = remarks
            .iter()
            .filter(|it| it.contains("odo.mcap: the file was not closed"));
        assert_eq!(named.count(), 1, "{remarks:?}");
    }
    // A file without any record, or with a damaged one, is an error.
    for damaged in [&bytes[..4], &[&bytes[..8], &[0xff; 100]].concat()] {
        fs::write(&file, damaged).unwrap();
        let error = read_odometry_mcap(&file, None, None).unwrap_err();
        assert!(error.to_string().contains("MCAP"), "{error}");
    }
}

#[test]
fn tum_has_eight_fields_and_round_trips() {
    let file = common::scratch("tum").join("drive.tum");
    let poses: Vec<_> = (0..40)
        .map(|k| TimedPose {
            time_s: 1_700_000_000.25 + f64::from(k) * 0.02,
            pose: Pose {
                x_m: f64::from(k),
                y_m: -0.5,
                heading_rad: -3.0 + 0.15 * f64::from(k),
            },
        })
        .collect();
    write_tum(&file, &poses).unwrap();
    let text = fs::read_to_string(&file).unwrap();
    assert!(
        text.lines()
            .all(|line| line.split(' ').count() == 8 && line == line.trim())
    );
    assert!(text.starts_with("1700000000.250000000 "));
    for (read, written) in read_tum(&file).unwrap().iter().zip(&poses) {
        assert!((read.time_s - written.time_s).abs() < 1e-6);
        assert!(read.pose.point().distance_m(written.pose.point()) < 1e-8);
        assert!((read.pose.heading_rad - written.pose.heading_rad).abs() < 1e-9);
    }
    for line in [
        "1 2 3",
        "1 2 3 4 5 6 7 8 9",
        "1 x 0 0 0 0 0 1",
        "1 2 nan 0 0 0 0 1",
        "1.7e18 2 3 0 0 0 0 1",
    ] {
        fs::write(&file, format!("# comment\n{line}\n")).unwrap();
        let error = read_tum(&file).unwrap_err();
        assert!(matches!(error, RecordingError::Value { ref key, .. } if key == "line 2"));
    }
    // Only the positions of a truth are used: its orientation may be unknown or rounded.
    fs::write(&file, "1 2 3 0 0 0 0 0\n2 2 3 0 0 0 0.04 1.00\n").unwrap();
    let read = read_tum(&file).unwrap();
    assert!(read[0].pose.heading_rad.is_nan());
    assert!((read[1].pose.heading_rad - 0.08).abs() < 1e-3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Any damage to a file gives an error or what is left of it, never a panic.
    #[test]
    fn damaged_files_never_cause_a_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in prop::option::of(any::<prop::sample::Index>()),
        kind in 0..5usize,
    ) {
        let dir = common::scratch("damage");
        let file = dir.join("file");
        match kind {
            0 => write_mcap(&file, &["/odom"], 0.1),
            1 | 2 => {
                write_mcap(&file, &["/odom"], 0.1);
                let compressions = [Compression::Lz4, Compression::Zstd];
                compress(&file, compressions[kind - 1]);
            }
            3 => write_odometry_csv(&file, &[sample(0.0), sample(0.1)]).unwrap(),
            _ => write_tum(&file, &[TimedPose { time_s: 0.5, pose: Pose::default() }]).unwrap(),
        }
        let mut bytes = fs::read(&file).unwrap();
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        fs::write(&file, bytes).unwrap();
        let _ = read_odometry_mcap(&file, None, None);
        let _ = read_odometry_csv(&file);
        let _ = read_angle_log(&file);
        let _ = read_tum(&file);
    }
}
