//! From a scenario to a recorded drive and back to where the vehicle was.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "this is a test")]

mod common;

use std::fs;
use std::path::Path;

use access_av::geometry::Point;
use access_av::receive::{ScanSettings, scan};
use access_av::recording::{
    Datatype, LoggedAngle, OdometryLog, Recording, Site, read_angle_log, read_odometry_csv,
    read_tum, write_angle_log,
};
use access_av::replay::{LocatedDrive, ReplayError, locate_angles, locate_recording};
use access_av::scenario::{Scenario, ScenarioError};
use access_av::simulate::{SynthSettings, synthesize};
use toml::Value;

const SETTINGS: SynthSettings = SynthSettings {
    seed: 1,
    run: 0,
    duration_s: None,
    continuous: false,
    datatype: Datatype::Ci16Le,
};

fn scenario() -> Scenario {
    let segments: Value =
        toml::from_str::<toml::Table>("s = [{ length_m = 60.0, turn_rad = 0.1 }]").unwrap()["s"]
            .clone();
    Scenario::load("paper-real-odometry-2")
        .unwrap()
        .with_overrides([
            ("track.segments", segments),
            ("radio_heads[1].ssb_index", Value::from(2)),
            ("iq.channel_phase_rad", Value::from(0.5)),
            ("iq.channel_gain_db", Value::from(1.0)),
        ])
        .unwrap()
}

/// Root mean square of the horizontal error in metres.
fn rms_error_m(drive: &LocatedDrive, truth: &Path) -> f64 {
    let truth = read_tum(truth).unwrap();
    let squares: Vec<f64> = truth
        .iter()
        .filter_map(|truth| {
            let near = |it: &&access_av::replay::LocatedPose| {
                (it.estimate.time_s - truth.time_s).abs() < 1e-6
            };
            let pose = drive.poses.iter().find(near)?;
            Some(
                pose.estimate
                    .pose
                    .point()
                    .distance_m(truth.pose.point())
                    .powi(2),
            )
        })
        .collect();
    assert!(squares.len() > 100);
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_recorded_drive_is_located() {
    let dir = common::scratch("drive");
    let made = synthesize(&scenario(), &SETTINGS, &dir).unwrap();
    let site = Site::read(&dir.join("site.toml")).unwrap();
    let odometry = read_odometry_csv(&dir.join("odometry.csv")).unwrap();
    let mut recording = Recording::open(&made.recording).unwrap();
    assert_eq!(recording.warnings(), []);
    assert_eq!(recording.length(), made.samples);

    let drive = locate_recording(&site, &odometry, &mut recording, 0.0, false).unwrap();
    assert_eq!(drive.poses.len(), odometry.samples.len());
    // Two heads; what the acquisition of the second costs is a burst or two.
    assert!(
        drive.executions.len() + 5 > 2 * made.bursts,
        "{}",
        drive.executions.len()
    );
    let accepted = drive
        .executions
        .iter()
        .filter(|it| it.verdict.accepted)
        .count();
    assert!(accepted * 100 > drive.executions.len() * 98);
    let from_samples_m = rms_error_m(&drive, &dir.join("truth.tum"));

    // The same by way of an angle log, with an angle from a cell that the site does not know.
    let mut angles: Vec<LoggedAngle> = drive
        .executions
        .iter()
        .map(|it| LoggedAngle {
            ssb: it.ssb,
            measured: it.measured.unwrap(),
        })
        .collect();
    let mut stranger = angles[20];
    stranger.ssb.pci = 999;
    angles.insert(20, stranger);
    // And one that comes a second late.
    angles.insert(100, angles[4]);
    let file = dir.join("angles.csv");
    write_angle_log(&file, &angles).unwrap();
    let angles = read_angle_log(&file).unwrap();
    let again = locate_angles(&site, &odometry, &angles, false).unwrap();
    let from_angles_m = rms_error_m(&again, &dir.join("truth.tum"));
    assert_eq!(
        again.executions[20].verdict.reason.name(),
        "unknown radio head"
    );
    assert_eq!(again.executions[100].verdict.reason.name(), "time reversed");
    println!("RMS error {from_samples_m:.3} m from samples, {from_angles_m:.3} m from angles");
    assert!(from_samples_m < 0.5, "{from_samples_m}");
    assert!((from_samples_m - from_angles_m).abs() < 1e-6);
}

#[test]
fn a_recording_without_gaps_is_scanned_and_located_alike() {
    let settings = SynthSettings {
        duration_s: Some(0.5),
        continuous: true,
        datatype: Datatype::Cf32Le,
        ..SETTINGS
    };
    let dir = common::scratch("continuous");
    let made = synthesize(&scenario(), &settings, &dir).unwrap();
    let mut recording = Recording::open(&made.recording).unwrap();
    assert!((made.samples as f64 / 3.84e6 - 0.52).abs() < 1e-3);

    let told = ScanSettings {
        ssb_freq_hz: Some(3.5e9),
        ..ScanSettings::default()
    };
    let found = scan(&mut recording, &told).unwrap();
    let annotations = recording.annotations();
    for annotation in annotations {
        let near = found.ssbs.iter().any(|found| {
            (found.sample_start - annotation.sample_start as f64).abs() < 2.0
                && annotation.other["nr:ssb"]["pci"] == found.ssb.pci.get()
        });
        assert!(near, "{annotation:?}");
    }
    assert_eq!(found.ssbs.len(), annotations.len());

    let site = Site::read(&dir.join("site.toml")).unwrap();
    let odometry = read_odometry_csv(&dir.join("odometry.csv")).unwrap();
    let drive = locate_recording(&site, &odometry, &mut recording, 0.0, false).unwrap();
    assert_eq!(drive.executions.len(), 2 * made.bursts);
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let dir = common::scratch("misfit-drive");
    let settings = SynthSettings {
        duration_s: Some(0.1),
        ..SETTINGS
    };
    let made = synthesize(&scenario(), &settings, &dir).unwrap();
    let text = fs::read_to_string(dir.join("site.toml")).unwrap();
    let site = Site::from_toml(&text, "site.toml").unwrap();
    let mut recording = Recording::open(&made.recording).unwrap();
    let error =
        locate_recording(&site, &OdometryLog::default(), &mut recording, 0.0, false).unwrap_err();
    assert!(matches!(error, ReplayError::NoOdometry));

    let odometry = read_odometry_csv(&dir.join("odometry.csv")).unwrap();
    let mut elsewhere = site.clone();
    elsewhere.scenario.ssb.carrier_mhz = 3600.0;
    let error = locate_recording(&elsewhere, &odometry, &mut recording, 0.0, false).unwrap_err();
    assert!(matches!(error, ReplayError::FrontEnd { .. }), "{error}");

    let data = dir.join("iq.sigmf-data");
    let mut mono = Recording::open_raw(&[&data], 3.84e6, Some(3.5e9)).unwrap();
    let error = locate_recording(&site, &odometry, &mut mono, 0.0, false).unwrap_err();
    assert!(matches!(error, ReplayError::Channels { channels: 1, .. }));

    let scenario = Scenario::load("paper").unwrap();
    let mut far = scenario.clone();
    far.ssb.subcarrier_spacing_khz = 120.0;
    assert!(synthesize(&far, &settings, &dir).is_err());
}

#[test]
fn site_files_are_checked() {
    let head =
        |pci: u16, x: f64| format!("[[radio_heads]]\nposition_m = [{x:.1}, 80.0]\npci = {pci}\n");
    let start = "[initial_pose]\nx_m = 1.0\ny_m = 2.0\nheading_rad = 0.3\n";
    let good = format!("{start}{}{}", head(1, 0.0), head(2, 50.0));
    let site = Site::from_toml(&good, "site.toml").unwrap();
    assert_eq!(site.initial_pose.unwrap().point(), Point::new(1.0, 2.0));
    assert_eq!(site.scenario.radio_heads.len(), 2);
    let listed = Site::from_toml(&format!("pci_allow_list = [2]\n{good}"), "site.toml").unwrap();
    assert_eq!(listed.scenario.radio_heads.len(), 1);
    assert_eq!(listed.receiver_config().cells, Some(vec![2]));

    let cases = [
        (
            format!("{start}{}{}", head(1, 0.0), head(2, 0.0)),
            "radio_heads[1].position_m",
        ),
        (
            format!("{start}{}{}", head(1, 0.0), head(1, 50.0)),
            "radio_heads[1].pci",
        ),
        (format!("pci_allow_list = [3]\n{good}"), "pci_allow_list[0]"),
        (format!("pci_allow_list = []\n{good}"), "pci_allow_list"),
        (format!("radio_heads = []\n{start}"), "radio_heads"),
        (head(1, 0.0), "initial_pose"),
        (
            format!("channel_gains = [[1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]\n{good}"),
            "channel_gains[1]",
        ),
        (format!("pci_allow = [1]\n{good}"), "pci_allow"),
    ];
    for (text, expected) in cases {
        match Site::from_toml(&text, "site.toml").unwrap_err() {
            ScenarioError::Value { file, key, .. }
            | ScenarioError::UnknownKey { file, key, .. } => {
                assert_eq!((file.as_str(), key.as_str()), ("site.toml", expected));
            }
            other => panic!("{expected}: {other}"),
        }
    }
}
