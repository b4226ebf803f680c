//! Export of a located drive as an MCAP file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use mcap::McapError;

use super::writer::{DiagnosticLevel, DiagnosticStatus, Frames, McapWriter, Twist};
use crate::error::RecordingError;
use crate::file::Partial;
use crate::replay::{LocatedDrive, LocatedPose, Remark};
use onboard::AngleResult;
use onboard::localize::IntegrityState;

/// Topic of the poses.
const POSE_TOPIC: &str = "/access_av/odometry";
/// Topic of the smoothed poses.
const SMOOTHED_TOPIC: &str = "/access_av/smoothed";
/// Topic of the verdicts.
const VERDICT_TOPIC: &str = "/access_av/verdicts";
/// Variance of a wheel speed in (m/s)².
const SPEED_VARIANCE: f64 = 1e-4;
/// Variance of a yaw rate in (rad/s)².
const YAW_RATE_VARIANCE: f64 = 1e-4;
/// Period of the diagnostics in seconds (REP-107).
const DIAGNOSTIC_PERIOD_S: f64 = 1.0;

/// Writes poses, verdicts and one diagnostic message per second in order of time. There are no
/// poses until the first pose is found. The diagnostics contain every remark on the input.
///
/// # Errors
/// [`RecordingError`] if the file cannot be written.
pub fn write_drive_mcap(file: &Path, drive: &LocatedDrive) -> Result<(), RecordingError> {
    let (partial, made) = Partial::create(file)?;
    write(BufWriter::new(made), drive).map_err(|error| RecordingError::Write {
        file: file.display().to_string(),
        message: error.to_string(),
    })?;
    partial.finish()
}

fn write(file: BufWriter<File>, drive: &LocatedDrive) -> Result<(), McapError> {
    let mut writer = McapWriter::new(file)?;
    let mut aoa_estimates = drive.aoa_estimates.iter().peekable();
    let mut recent: Vec<&AngleResult> = Vec::new();
    let mut remarks = drive.remarks.as_slice();
    let mut diagnosed_s = f64::NEG_INFINITY;
    let mut smoothed = drive.smoothed.iter().peekable();
    for pose in &drive.poses {
        let time_s = pose.estimate.time_s;
        while let Some(angle_result) = aoa_estimates.next_if(|it| it.ssb.time_s <= time_s) {
            writer.verdict(VERDICT_TOPIC, angle_result)?;
            recent.push(angle_result);
        }
        if pose.searching.is_none() {
            writer.odometry(POSE_TOPIC, Frames::MAP, &pose.estimate, &twist(pose))?;
        }
        if let Some(pose) = smoothed.next_if(|it| it.estimate.time_s <= time_s) {
            writer.odometry(SMOOTHED_TOPIC, Frames::MAP, &pose.estimate, &twist(pose))?;
        }
        if time_s - diagnosed_s >= DIAGNOSTIC_PERIOD_S {
            let known = remarks.partition_point(|remark| remark.time_s <= time_s);
            let (current, later) = remarks.split_at(known);
            writer.diagnostics(time_s, &[diagnosis(pose, &recent), input(current)])?;
            diagnosed_s = time_s;
            remarks = later;
            recent.clear();
        }
    }
    for angle_result in aoa_estimates {
        writer.verdict(VERDICT_TOPIC, angle_result)?;
    }
    if let (Some(last), [_, ..]) = (drive.poses.last(), remarks) {
        writer.diagnostics(last.estimate.time_s, &[input(remarks)])?;
    }
    writer.finish()
}

fn twist(pose: &LocatedPose) -> Twist {
    Twist {
        speed_mps: pose.speed_mps,
        speed_variance: SPEED_VARIANCE,
        yaw_rate: pose
            .yaw_rate_radps
            .map(|rate_radps| (rate_radps, YAW_RATE_VARIANCE)),
    }
}

/// Returns the diagnostic status of the input with the recent remarks.
fn input(remarks: &[Remark]) -> DiagnosticStatus {
    let (level, message) = match remarks.len() {
        0 => (DiagnosticLevel::Ok, "no remarks".to_owned()),
        1 => (DiagnosticLevel::Warn, "1 remark".to_owned()),
        count => (DiagnosticLevel::Warn, format!("{count} remarks")),
    };
    let texts = remarks.iter().map(|remark| remark.text.clone());
    DiagnosticStatus {
        level,
        name: "access_av: input".to_owned(),
        message,
        values: (1..)
            .map(|number: usize| number.to_string())
            .zip(texts)
            .collect(),
    }
}

fn diagnosis(pose: &LocatedPose, recent: &[&AngleResult]) -> DiagnosticStatus {
    let accepted = recent
        .iter()
        .filter(|angle_result| angle_result.verdict.accepted)
        .count();
    let state = pose.estimate.integrity.map(|integrity| integrity.state);
    let (level, message) = match (accepted, recent.len()) {
        _ if pose.searching.is_some() => (DiagnosticLevel::Warn, "searching for the first pose"),
        _ if state == Some(IntegrityState::Unavailable) => {
            (DiagnosticLevel::Error, "the position is not reliable")
        }
        _ if state == Some(IntegrityState::Degraded) => (
            DiagnosticLevel::Warn,
            "protection level above the alert limit",
        ),
        (_, 0) => (DiagnosticLevel::Stale, "no SSB in the last second"),
        (0, _) => (
            DiagnosticLevel::Error,
            "no angle accepted in the last second",
        ),
        _ if pose.constants.is_some_and(|found| found.array_departs()) => (
            DiagnosticLevel::Warn,
            "the array deviates from its mounting or calibration",
        ),
        (few, all) if 2 * few < all => (DiagnosticLevel::Warn, "most angles rejected"),
        _ => (DiagnosticLevel::Ok, "angles accepted"),
    };
    let mut cells: Vec<u16> = recent
        .iter()
        .map(|angle_result| angle_result.ssb.pci)
        .collect();
    cells.sort_unstable();
    cells.dedup();
    let mut values = vec![
        ("angles".to_owned(), recent.len().to_string()),
        ("accepted".to_owned(), accepted.to_string()),
        ("cells".to_owned(), format!("{cells:?}")),
    ];
    if let Some(found) = pose.constants {
        for (name, constant) in [
            ("mounting_rad", found.mounting_rad),
            ("phase_rad", found.phase_rad),
        ] {
            // A constant that is assumed to be exact is omitted.
            if constant.std > 0.0 {
                let value = format!("{:.4} ± {:.4}", constant.departure(), constant.std);
                values.push((name.to_owned(), value));
            }
        }
    }
    if let Some(hypotheses) = pose.searching {
        values.push(("hypotheses".to_owned(), hypotheses.to_string()));
    }
    let mut refused = BTreeMap::new();
    for angle_result in recent.iter().filter(|it| !it.verdict.accepted) {
        *refused
            .entry(angle_result.verdict.reason.name())
            .or_insert(0u32) += 1;
    }
    values.extend(
        refused
            .into_iter()
            .map(|(reason, count)| (format!("refused: {reason}"), count.to_string())),
    );
    if let Some([[x, ..], [_, y, _], _]) = pose.estimate.covariance {
        values.push((
            "position_sigma_m".to_owned(),
            format!("{:.4}", (x + y).sqrt()),
        ));
    }
    if let Some(integrity) = &pose.estimate.integrity {
        let level_m = format!("{:.3}", integrity.protection_level_m);
        values.push(("protection_level_m".to_owned(), level_m));
        let hypothesis = integrity.hypothesis.name().to_owned();
        values.push(("selected_hypothesis".to_owned(), hypothesis));
        values.push(("integrity".to_owned(), integrity.state.name().to_owned()));
    }
    DiagnosticStatus {
        level,
        name: "access_av: localizer".to_owned(),
        message: message.to_owned(),
        values,
    }
}
