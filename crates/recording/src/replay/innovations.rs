//! What the angles of a drive say of what was believed before each of them.

use std::sync::Arc;

use onboard::localize::ekf::EkfConfig;
use onboard::localize::{Ekf, InitialPose};
use onboard::radio_head::RadioHead;
use onboard::settings::{Check, Site, Vehicle};

use super::error::ReplayError;
use super::stated::with_phase;
use crate::angle_log::LoggedAngle;
use crate::odometry::OdometryLog;

/// An angle as the tracker met it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// Measured electrical angle minus the predicted one (rad).
    pub residual_rad: f64,
    /// Variance of that as the tracker believes it (rad²).
    pub variance: f64,
    /// Whether the tracker used it.
    pub used: bool,
}

/// Drives with a tracker that neither searches nor guards itself, and tells what it met; `None` for
/// an angle that told it nothing. Where `used` says which angles count, exactly those do, however
/// far they are from what was expected; without, its gate decides.
///
/// So the residuals are those of the innovations form: given site and vehicle they are independent
/// and normal, and their likelihood is that of the drive (Schweppe, IEEE Trans. IT 11(1), 1965).
///
/// # Errors
/// [`ReplayError::Settings`] for a road that cannot be built, or an unknown start.
pub fn innovations(
    site: &Site,
    vehicle: &Vehicle,
    odometry: &OdometryLog,
    angles: &[LoggedAngle],
    used: Option<&[bool]>,
) -> Result<Vec<Option<Met>>, ReplayError> {
    let (file, pose) = (&vehicle.name, vehicle.start.pose);
    Check { file }.that(
        pose.is_some(),
        "start.pose",
        "missing",
        "a drive that says something of the site has a known start",
    )?;
    let start = InitialPose {
        pose: pose.unwrap_or_default(),
        position_std_m: vehicle.start.position_std_m,
        heading_std_rad: vehicle.start.heading_std_rad,
    };
    let heads = RadioHead::heard(site, vehicle);
    let road = site.build_road()?.filter(|_| vehicle.follows_road());
    let config = EkfConfig::new(site, vehicle);
    let mut tracker = Ekf::new(config, road.map(Arc::new), &heads, &start);
    if used.is_some() {
        tracker.set_gate(f64::INFINITY);
    }
    let mut odometry = odometry.samples.iter().peekable();
    let measurand = vehicle.array.measurand();
    let met = angles.iter().enumerate().map(|(index, logged)| {
        let mut measured = with_phase(logged, &measurand).measured;
        measured.time_s -= vehicle.receiver.lateness_s;
        while let Some(sample) = odometry.next_if(|sample| sample.time_s <= measured.time_s) {
            tracker.odometry(sample);
        }
        let head = heads
            .iter()
            .find(|head| head.sends(logged.ssb.pci, logged.ssb.ssb_index))?;
        let innovation = tracker.innovation(head, &measured)?;
        let wanted = used.is_none_or(|used| used.get(index).copied().unwrap_or(false));
        Some(Met {
            residual_rad: innovation.residual,
            variance: innovation.variance,
            used: wanted && tracker.update(head, &measured).accepted,
        })
    });
    Ok(met.collect())
}
