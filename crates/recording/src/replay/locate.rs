//! Localization of a recorded drive.

use std::borrow::Cow;
use std::collections::BTreeMap;

use onboard::geometry::Pose;
use onboard::localize::UpdateReason;
use onboard::localize::ekf::EkfConfig;
use onboard::observation::SsbDetection;
use onboard::receive::ReceiverConfig;
use onboard::settings::{IntegritySettings, Site, Vehicle, WakeUpSettings};
use onboard::{AngleResult, Custom};

use super::clock::{AngleTimeOffset, MIN_ANGLE_TIME_OFFSET_S, angle_time_offset, earlier};
use super::data_quality::warnings;
use super::diagnosis::diagnose;
use super::drive::{Replay, check_odometry};
use super::error::ReplayError;
use super::hypotheses::Drive;
use super::located::{LocatedDrive, LocatedPose};
use super::receive::receive_recording;
use super::start::{StartChoice, starting};
use super::stated::with_phase;
use super::time_units::check_times;
use crate::angle_log::{AngleLog, LoggedAngle};
use crate::odometry::OdometryLog;
use crate::sigmf::Recording;

/// Locates a drive from logged angles, with optional smoothing.
///
/// # Errors
/// [`ReplayError`].
pub fn locate_angles(
    site: &Site,
    vehicle: &Vehicle,
    start: StartChoice,
    odometry: &OdometryLog,
    angles: &AngleLog,
    smooth: bool,
) -> Result<LocatedDrive, ReplayError> {
    let (mut vehicle, start) = starting(site, vehicle, start)?;
    check_odometry(odometry)?;
    if angles.angles.is_empty() {
        let why = angles.remarks.first().map(ToString::to_string);
        return Err(ReplayError::NoAngle { why });
    }
    check_times(odometry, &angles.angles)?;
    let measurand = vehicle.array.measurand();
    let mut logged = Cow::Borrowed(angles.angles.as_slice());
    let mut late = angle_time_offset(&as_given(site, &vehicle, odometry, &logged))?;
    if let Some(found) = &mut late {
        let angles: Vec<LoggedAngle> = logged.iter().map(|it| with_phase(it, &measurand)).collect();
        *found = resolved(*found, site, &vehicle, start, odometry, &angles)?;
    }
    if let Some(late) = late {
        logged = Cow::Owned(earlier(&logged, late.found_s));
        vehicle.receiver.angle_time_offset_std_s = Some(late.left_std_s);
    }
    let mut replay = Replay::new(site, &vehicle, start, Custom::default(), odometry)?;
    if let Some(late) = late {
        replay.set_back(late.found_s);
    }
    for remark in &angles.remarks {
        replay.remark(remark.time_s, remark.to_string());
    }
    let angles: Vec<LoggedAngle> = logged.iter().map(|it| with_phase(it, &measurand)).collect();
    for (time_s, text) in warnings(site, &vehicle, odometry, &angles)? {
        replay.remark(time_s, text);
    }
    replay.process(&angles)?;
    explain(&mut replay, site, &vehicle, odometry, &logged)?;
    finish(replay, site, &vehicle, start, odometry, smooth)
}

/// Locates a drive from recorded samples, with optional smoothing. `start_time_s` is the time of
/// the first sample according to the odometry's clock.
///
/// # Errors
/// [`ReplayError`].
pub fn locate_recording(
    site: &Site,
    vehicle: &Vehicle,
    start: StartChoice,
    odometry: &OdometryLog,
    recording: &mut Recording,
    start_time_s: f64,
    smooth: bool,
) -> Result<LocatedDrive, ReplayError> {
    if !start_time_s.is_finite() {
        return Err(ReplayError::StartTime { start_time_s });
    }
    let (mut vehicle, start) = starting(site, vehicle, start)?;
    check_odometry(odometry)?;
    check_times(odometry, &[])?;
    let mut replay = Replay::new(site, &vehicle, start, Custom::default(), odometry)?;
    let file = recording.data_file().display().to_string();
    let config = ReceiverConfig::new(site, &vehicle);
    let (mut angles_s, mut together) = (None, false);
    let gaps = receive_recording(config, recording, start_time_s, |ssbs| {
        for it in ssbs {
            let [first_s, _] = angles_s.unwrap_or([it.ssb.time_s; 2]);
            angles_s = Some([first_s, it.ssb.time_s]);
            together |= odometry.covers(it.ssb.time_s);
        }
        replay.process(ssbs)
    })?;
    if let (Some(odometry_s), Some(angles_s), false) = (odometry.interval_s(), angles_s, together) {
        return Err(ReplayError::Clocks {
            odometry_s,
            angles_s,
        });
    }
    if angles_s.is_none() {
        return Err(ReplayError::NoSsb { file });
    }
    let mut received: Vec<LoggedAngle> = replay
        .aoa_estimates()
        .iter()
        .filter_map(as_logged)
        .collect();
    let mut timed_vehicle = in_time(&vehicle);
    let mut late = if defines_times(recording) {
        None
    } else {
        angle_time_offset(&as_given(site, &timed_vehicle, odometry, &received))?
    };
    if let Some(found) = &mut late {
        let chosen = as_chosen(&timed_vehicle);
        *found = resolved(*found, site, &chosen, start, odometry, &received)?;
    }
    if let Some(late) = late {
        received = earlier(&received, late.found_s);
        vehicle.receiver.angle_time_offset_std_s = Some(late.left_std_s);
        timed_vehicle = in_time(&vehicle);
        let chosen = as_chosen(&timed_vehicle);
        replay = Replay::new(site, &chosen, start, Custom::default(), odometry)?;
        replay.set_back(late.found_s);
        replay.process(&received)?;
    }
    for gap in gaps {
        let text = format!(
            "samples before {:.2} s: {:.2} ms are missing, by the times of the SSBs, and were added to \
             the times of all that follow; write a capture with core:global_index after each gap",
            gap.before_s,
            1e3 * gap.lost_s
        );
        replay.remark(gap.before_s, text);
    }
    for warning in recording.warnings() {
        replay.remark(f64::NEG_INFINITY, warning.to_string());
    }
    explain(&mut replay, site, &timed_vehicle, odometry, &received)?;
    finish(replay, site, &vehicle, start, odometry, smooth)
}

/// Resolves an uncertain time offset: the localizer's filter estimates the offset over the whole
/// drive. A significant estimate is corrected from the start of the drive, and its variance
/// remains.
fn resolved(
    late: AngleTimeOffset,
    site: &Site,
    vehicle: &Vehicle,
    start: Pose,
    odometry: &OdometryLog,
    angles: &[LoggedAngle],
) -> Result<AngleTimeOffset, ReplayError> {
    if late.found_s != 0.0 {
        return Ok(late);
    }
    let mut vehicle = vehicle.clone();
    // The prior includes the candidate of the search, so that it does not bias the estimate.
    vehicle.receiver.angle_time_offset_std_s = Some(late.left_std_s.max(late.candidate_s.abs()));
    let mut replay = Replay::new(site, &vehicle, start, Custom::default(), odometry)?;
    replay.process(angles)?;
    let drive = replay.finish()?;
    let is_suspect = drive.suspicions().next().is_some();
    let estimate = drive.constants.map(|it| it.angle_time_offset_s);
    Ok(estimate
        .filter(|it| !is_suspect && it.certainly_differs_by(MIN_ANGLE_TIME_OFFSET_S))
        .map_or(late, |it| AngleTimeOffset {
            found_s: it.found - it.stated,
            left_std_s: it.std,
            ..late
        }))
}

/// Whether a recording defines the times of its samples, so that no time offset is searched for.
fn defines_times(recording: &Recording) -> bool {
    let captures = &recording.metadata().captures;
    let keys = ["core:global_index", "core:datetime"];
    (captures.iter()).any(|it| keys.iter().any(|key| it.other.contains_key(*key)))
}

/// Processes the rest of the odometry and adds the diagnoses of the drive.
fn explain(
    replay: &mut Replay<'_>,
    site: &Site,
    vehicle: &Vehicle,
    odometry: &OdometryLog,
    angles: &[LoggedAngle],
) -> Result<(), ReplayError> {
    replay.process_remaining_odometry()?;
    let given = as_given(site, vehicle, odometry, angles);
    for mut diagnosis in diagnose(&given, replay.located())? {
        diagnosis.text = odometry.fields.named(&diagnosis.text);
        replay.diagnose(diagnosis);
    }
    Ok(())
}

fn as_given<'a>(
    site: &'a Site,
    vehicle: &'a Vehicle,
    odometry: &'a OdometryLog,
    angles: &'a [LoggedAngle],
) -> Drive<'a> {
    Drive {
        site: Cow::Borrowed(site),
        vehicle: Cow::Borrowed(vehicle),
        odometry: Cow::Borrowed(odometry),
        angles: Cow::Borrowed(angles),
    }
}

/// Converts the result of an angle to a logged angle. Its time offset is already corrected.
fn as_logged(angle_result: &AngleResult) -> Option<LoggedAngle> {
    let measured = angle_result.measured?;
    let ssb = SsbDetection {
        time_s: measured.time_s,
        ..angle_result.ssb
    };
    Some(LoggedAngle { ssb, measured })
}

/// Returns the vehicle with a policy that uses every angle, because the wake-up policy has already
/// selected them.
fn as_chosen(vehicle: &Vehicle) -> Vehicle {
    Vehicle {
        wake_up: Some(WakeUpSettings::EVERY_SSB),
        ..vehicle.clone()
    }
}

/// Returns the vehicle without a time offset, because it is already corrected.
fn in_time(vehicle: &Vehicle) -> Vehicle {
    let mut vehicle = vehicle.clone();
    vehicle.receiver.angle_time_offset_s = 0.0;
    vehicle
}

fn finish(
    replay: Replay<'_>,
    site: &Site,
    vehicle: &Vehicle,
    start: Pose,
    odometry: &OdometryLog,
    smooth: bool,
) -> Result<LocatedDrive, ReplayError> {
    let mut drive = replay.finish()?;
    if smooth {
        drive.smoothed = smoothed_poses(site, vehicle, start, odometry, &drive.aoa_estimates)?;
    }
    Ok(drive)
}

/// Processes the drive once more with smoothing. Angles of a radio head that was found faulty are
/// omitted until it was valid again, so that integrity monitoring is not needed.
fn smoothed_poses(
    site: &Site,
    vehicle: &Vehicle,
    start: Pose,
    odometry: &OdometryLog,
    aoa_estimates: &[AngleResult],
) -> Result<Vec<LocatedPose>, ReplayError> {
    let mut unguarded = Vehicle {
        integrity: Some(IntegritySettings::off()),
        ..as_chosen(&in_time(vehicle))
    };
    // The smoothed filter estimates biases if the monitored filter did.
    let multipath_bias_probability = EkfConfig::new(site, vehicle).multipath_bias_probability;
    unguarded.receiver.multipath_bias_probability = Some(multipath_bias_probability);
    let mut excluded_until_s = BTreeMap::new();
    for angle_result in aoa_estimates {
        if angle_result.verdict.reason == UpdateReason::Excluded {
            let ssb = &angle_result.ssb;
            excluded_until_s.insert((ssb.pci, ssb.ssb_index), ssb.time_s);
        }
    }
    let was_not_excluded = |angle_result: &&AngleResult| {
        let ssb = angle_result.ssb;
        let until_s = excluded_until_s.get(&(ssb.pci, ssb.ssb_index));
        until_s.is_none_or(|until_s| ssb.time_s > *until_s)
    };
    let aoa_estimates = aoa_estimates.iter().filter(was_not_excluded);
    let mut angles: Vec<LoggedAngle> = aoa_estimates.filter_map(as_logged).collect();
    // All data are available, so that no angle is late.
    angles.sort_by(|a, b| a.ssb.time_s.total_cmp(&b.ssb.time_s));
    let mut replay = Replay::new(site, &unguarded, start, Custom::default(), odometry)?;
    replay.keep_journal();
    replay.process(&angles)?;
    replay.smoothed()
}
