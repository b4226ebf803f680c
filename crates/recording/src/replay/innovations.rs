//! Innovations of the angles of a drive.

use std::sync::Arc;

use onboard::geometry::Pose;
use onboard::localize::ekf::EkfConfig;
use onboard::localize::{self, AngleEvidence, Ekf, InitialPose, Localizer};
use onboard::radio_head::RadioHead;
use onboard::settings::{Check, Site, Vehicle};

use super::error::ReplayError;
use super::stated::with_phase;
use crate::angle_log::LoggedAngle;
use crate::odometry::OdometryLog;

/// Evidence of an angle in the localizer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnovationRecord {
    /// Innovation and likelihood before the update.
    pub evidence: AngleEvidence,
    /// Whether the localizer used the angle.
    pub used: bool,
}

/// Estimated pose at an angle and the innovation; `None` if the angle was not processed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Step {
    pub pose: Option<Pose>,
    pub met: Option<InnovationRecord>,
}

/// Processes a drive with a filter without search and integrity monitoring, and returns its
/// innovations; `None` for an angle that was not processed. If `used` is given, exactly the marked
/// angles are used, without a gate. Otherwise the filter's gate decides.
///
/// The innovations are independent and normal for the given site and vehicle, and their likelihood
/// is that of the drive (innovations form; Schweppe, IEEE Trans. IT 11(1), 1965).
///
/// # Errors
/// [`ReplayError::Settings`] if the road cannot be built or the start is unknown.
pub fn innovations(
    site: &Site,
    vehicle: &Vehicle,
    odometry: &OdometryLog,
    angles: &[LoggedAngle],
    used: Option<&[bool]>,
) -> Result<Vec<Option<InnovationRecord>>, ReplayError> {
    let mut ekf = plain_filter(site, vehicle)?;
    if used.is_some() {
        ekf.set_gate(f64::INFINITY);
    }
    let steps = replay_angles(&mut ekf, site, vehicle, odometry, angles, used)?;
    Ok(steps.into_iter().map(|step| step.met).collect())
}

/// Creates a filter at the known start without search and integrity monitoring.
///
/// # Errors
/// Errors of [`innovations`].
pub fn plain_filter(site: &Site, vehicle: &Vehicle) -> Result<Ekf, ReplayError> {
    let start = InitialPose {
        pose: known_start(vehicle)?,
        position_std_m: vehicle.start.position_std_m,
        heading_std_rad: vehicle.start.heading_std_rad,
    };
    let heads = RadioHead::received_by(site, vehicle);
    let road = site.build_road()?.filter(|_| vehicle.follows_road());
    let mut config = EkfConfig::new(site, vehicle);
    config.correlated_noise.is_found = false;
    Ok(Ekf::new(config, road.map(Arc::new), &heads, &start))
}

/// Creates the localizer of the vehicle's settings, including integrity monitoring.
///
/// # Errors
/// Errors of [`innovations`].
pub fn vehicles_localizer(
    site: &Site,
    vehicle: &Vehicle,
) -> Result<Box<dyn Localizer>, ReplayError> {
    Ok(localize::built_in(site, vehicle, known_start(vehicle)?)?)
}

fn known_start(vehicle: &Vehicle) -> Result<Pose, ReplayError> {
    let (file, pose) = (&vehicle.name, vehicle.start.pose);
    Check { file }.that(
        pose.is_some(),
        "start.pose",
        "missing",
        "a drive for the calibration of a site requires a known start",
    )?;
    Ok(pose.unwrap_or_default())
}

/// Maximum fraction of the angles at which a localizer is lost; with more, the evaluation stops.
const MAX_LOST: f64 = 0.2;

/// Processes a drive with a localizer and returns the estimated pose and the innovation at each
/// angle, until the localizer is lost for long. A search would take the time of a hundred filters.
///
/// # Errors
/// [`ReplayError::Custom`] if the localizer fails.
pub fn replay_angles(
    localizer: &mut dyn Localizer,
    site: &Site,
    vehicle: &Vehicle,
    odometry: &OdometryLog,
    angles: &[LoggedAngle],
    used: Option<&[bool]>,
) -> Result<Vec<Step>, ReplayError> {
    let heads = RadioHead::received_by(site, vehicle);
    let mut odometry = odometry.samples.iter().peekable();
    let measurand = vehicle.array.measurand();
    let max_lost = (MAX_LOST * angles.len() as f64) as usize;
    let (mut lost, mut steps) = (0, Vec::with_capacity(angles.len()));
    for (index, logged) in angles.iter().enumerate() {
        let mut measured = with_phase(logged, &measurand).measured;
        measured.time_s -= vehicle.receiver.angle_time_offset_s;
        while let Some(sample) = odometry.next_if(|sample| sample.time_s <= measured.time_s) {
            localizer.odometry(sample).map_err(ReplayError::Custom)?;
        }
        let ekf = localizer.ekf();
        let mut step = Step {
            pose: ekf.map(|ekf| ekf.pose(measured.time_s).pose),
            met: None,
        };
        let sends = |head: &&RadioHead| head.sends(logged.ssb.pci, logged.ssb.ssb_index);
        if let Some(head) = heads.iter().find(sends) {
            let evidence = ekf.and_then(|ekf| ekf.angle_evidence(head, &measured));
            let wanted = used.is_none_or(|used| used.get(index).copied().unwrap_or(false));
            let accepted = wanted
                && (localizer.update(head, &measured))
                    .map_err(ReplayError::Custom)?
                    .accepted;
            step.met = evidence.map(|evidence| InnovationRecord {
                evidence,
                used: accepted,
            });
        }
        steps.push(step);
        lost += usize::from(localizer.is_lost());
        if lost > max_lost {
            break;
        }
    }
    Ok(steps)
}
