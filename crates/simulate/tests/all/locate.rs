//! Recording of a simulated drive and localization from the recording.

use crate::common;
use std::path::Path;

use onboard::receive::ReceiveError;
use onboard::settings::{SettingsError, Site, Vehicle};
use recording::replay::{
    LocatedDrive, LocatedPose, ReplayError, StartChoice, locate_angles, locate_recording,
};
use recording::scan::{ScanSettings, scan};
use recording::{
    Datatype, LoggedAngle, OdometryLog, Recording, load, read_angle_log, read_odometry_csv,
    read_tum, write_angle_log,
};
use simulate::scenario::Scenario;
use simulate::{SynthSettings, synthesize};
use toml::Value;

use crate::common::{changed, shipped, value};

const SETTINGS: SynthSettings = SynthSettings {
    seed: 1,
    run: 0,
    duration_s: None,
    continuous: false,
    datatype: Datatype::Ci16Le,
};

fn scenario() -> Scenario {
    changed(
        "paper-real-odometry-2",
        [
            (
                "site.road.segments",
                value("[{ length_m = 60.0, turn_rad = 0.1 }]"),
            ),
            ("site.radio_heads[1].ssb_index", Value::from(2)),
            ("iq.channel_phase_rad", Value::from(0.5)),
            ("iq.channel_gain_db", Value::from(1.0)),
        ],
    )
}

/// Reads the site and vehicle files of a recorded drive.
fn nominal(dir: &Path) -> (Site, Vehicle) {
    let path = |name: &str| dir.join(name).display().to_string();
    let site = load(&path("site.toml")).unwrap();
    (site, load(&path("vehicle.toml")).unwrap())
}

/// Locates recorded samples from the start in the vehicle file.
fn locate(
    (site, vehicle): &(Site, Vehicle),
    odometry: &OdometryLog,
    recording: &mut Recording,
) -> Result<LocatedDrive, ReplayError> {
    let start = StartChoice::AsSet;
    locate_recording(site, vehicle, start, odometry, recording, 0.0, false)
}

/// Returns the RMS horizontal error in metres.
fn rms_error_m(drive: &LocatedDrive, truth: &Path) -> f64 {
    let truth = read_tum(truth).unwrap();
    let squares: Vec<f64> = truth
        .iter()
        .filter_map(|truth| {
            let near = |it: &&LocatedPose| (it.estimate.time_s - truth.time_s).abs() < 1e-6;
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
    let made = synthesize(&scenario(), &SETTINGS, &dir, &mut |_| true).unwrap();
    let nominal = nominal(&dir);
    let odometry = read_odometry_csv(&dir.join("odometry.csv")).unwrap();
    let mut recording = Recording::open(&made.recording).unwrap();
    assert_eq!(recording.warnings(), []);
    assert_eq!(recording.length(), made.samples);

    let drive = locate(&nominal, &odometry, &mut recording).unwrap();
    assert_eq!(drive.poses.len(), odometry.samples.len());
    // Two radio heads; the acquisition of the second takes one or two bursts.
    assert!(
        drive.aoa_estimates.len() + 5 > 2 * made.bursts,
        "{}",
        drive.aoa_estimates.len()
    );
    let accepted = drive
        .aoa_estimates
        .iter()
        .filter(|it| it.verdict.accepted)
        .count();
    assert!(accepted * 100 > drive.aoa_estimates.len() * 98);
    let from_samples_m = rms_error_m(&drive, &dir.join("truth.tum"));

    // Repeat with an angle log that contains an angle of an unknown cell.
    let mut angles: Vec<LoggedAngle> = drive
        .aoa_estimates
        .iter()
        .map(|it| LoggedAngle {
            ssb: it.ssb,
            measured: it.measured.unwrap(),
        })
        .collect();
    let mut unknown_head = angles[20];
    unknown_head.ssb.pci = 999;
    angles.insert(20, unknown_head);
    let file = dir.join("angles.csv");
    write_angle_log(&file, &angles).unwrap();
    let mut angles = read_angle_log(&file).unwrap();
    // Add an angle that arrives one second late; the reader would leave it out as repeated.
    let late = angles.angles[4];
    angles.angles.insert(100, late);
    // A recording has one clock, but the replay of a log searches for a time offset; disable this.
    let (site, mut vehicle) = nominal.clone();
    vehicle.receiver.angle_time_offset_std_s = Some(0.0);
    let (site, vehicle) = (&site, &vehicle);
    let start = StartChoice::AsSet;
    let again = locate_angles(site, vehicle, start, &odometry, &angles, false).unwrap();
    let from_angles_m = rms_error_m(&again, &dir.join("truth.tum"));
    assert_eq!(
        again.aoa_estimates[20].verdict.reason.name(),
        "unknown radio head"
    );
    assert_eq!(again.aoa_estimates[100].verdict.reason.name(), "too late");
    println!("RMS error {from_samples_m:.3} m from samples, {from_angles_m:.3} m from angles");
    assert!(from_samples_m < 0.5, "{from_samples_m}");
    assert!((from_samples_m - from_angles_m).abs() < 1e-6);
}

#[test]
fn a_continuous_recording_is_scanned_and_located_equally() {
    let settings = SynthSettings {
        duration_s: Some(0.5),
        continuous: true,
        datatype: Datatype::Cf32Le,
        ..SETTINGS
    };
    let dir = common::scratch("continuous");
    let made = synthesize(&scenario(), &settings, &dir, &mut |_| true).unwrap();
    let mut recording = Recording::open(&made.recording).unwrap();
    assert!((made.samples as f64 / 3.84e6 - 0.52).abs() < 1e-3);

    let settings = ScanSettings {
        ssb_freq_hz: Some(3.5e9),
        ..ScanSettings::default()
    };
    let found = scan(&mut recording, &settings).unwrap();
    let annotations = recording.annotations();
    for annotation in annotations {
        let near = found.ssbs.iter().any(|found| {
            (found.sample_start - annotation.sample_start as f64).abs() < 2.0
                && annotation.other["nr:ssb"]["pci"] == found.ssb.pci.get()
        });
        assert!(near, "{annotation:?}");
    }
    assert_eq!(found.ssbs.len(), annotations.len());

    let nominal = nominal(&dir);
    let odometry = read_odometry_csv(&dir.join("odometry.csv")).unwrap();
    let drive = locate(&nominal, &odometry, &mut recording).unwrap();
    assert_eq!(drive.aoa_estimates.len(), 2 * made.bursts);
}

#[test]
fn incompatible_inputs_are_rejected() {
    let dir = common::scratch("misfit-drive");
    let settings = SynthSettings {
        duration_s: Some(0.1),
        datatype: Datatype::Cf32Le,
        ..SETTINGS
    };
    let made = synthesize(&scenario(), &settings, &dir, &mut |_| true).unwrap();
    let nominal = nominal(&dir);
    let mut recording = Recording::open(&made.recording).unwrap();
    let error = locate(&nominal, &OdometryLog::default(), &mut recording).unwrap_err();
    assert!(matches!(error, ReplayError::NoOdometry { why: None }));

    let odometry = read_odometry_csv(&dir.join("odometry.csv")).unwrap();
    let mut elsewhere = nominal.clone();
    elsewhere.0.carrier_mhz = 3600.0;
    let error = locate(&elsewhere, &odometry, &mut recording).unwrap_err();
    assert!(matches!(error, ReplayError::FrontEnd { .. }), "{error}");

    let data = dir.join("iq.sigmf-data");
    let mut mono = Recording::open_raw(&[&data], 3.84e6, Some(3.5e9)).unwrap();
    let error = locate(&nominal, &odometry, &mut mono).unwrap_err();
    let ReplayError::Receive { source, .. } = &error else {
        panic!("{error}")
    };
    let (found, elements) = (1, 4);
    assert_eq!(*source, ReceiveError::Antennas { found, elements });

    let mut far = shipped("paper");
    far.site.ssb.subcarrier_spacing_khz = 120.0;
    assert!(synthesize(&far, &settings, &dir, &mut |_| true).is_err());

    // With one radio head, several positions are possible.
    let (mut site, mut vehicle) = nominal;
    vehicle.start.pose = None;
    site.radio_heads.truncate(1);
    let error = locate(&(site, vehicle), &odometry, &mut recording).unwrap_err();
    let ReplayError::Settings(SettingsError::Value { key, .. }) = &error else {
        panic!("{error}")
    };
    assert_eq!(key, "start.pose");
}
