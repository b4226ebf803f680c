//! What is believed of angles whose deviation somebody else has stated.

use std::f64::consts::TAU;

use onboard::geometry::wrap_angle;
use onboard::manifold::Measurand;
use onboard::settings::{DriveKind, Site, Vehicle};

use crate::angle_log::LoggedAngle;

/// Share of a stated variance that stays from angle to angle. On the sensors that were looked into,
/// cameras and a laser, whose data sheets are cautious, it is 0.08 to 0.2.
const USUAL_SHARE: f64 = 0.25;

/// Probability that errors stay over metres where nobody knows of scatter.
const UNKNOWN: f64 = 0.75;

/// Rician K (dB) of no scatter.
const NO_SCATTER_DB: f64 = 200.0;

/// Site and vehicle for angles whose stated deviation is all of their error: the site's scatter is
/// not added to it, and looks at one radio head within a second or a metre do not count as
/// independent, unless the receiver's settings say otherwise. On a road vehicle, where nothing is stated
/// of errors that stay, they are found while driving.
pub fn as_stated(site: &Site, vehicle: &Vehicle) -> (Site, Vehicle) {
    let site = Site {
        rician_k_db: NO_SCATTER_DB,
        ..site.clone()
    };
    let mut vehicle = vehicle.clone();
    let receiver = &mut vehicle.receiver;
    // A differential drive is as often lost as its angles are off by reflections, and would take the
    // one for the other.
    let is_unstated = receiver.phase_bias_share.is_none() && receiver.phase_bias_std_rad == 0.0;
    let may_be_found = is_unstated && vehicle.drive == DriveKind::Road;
    (receiver.phase_bias_probability).get_or_insert(if may_be_found { UNKNOWN } else { 0.0 });
    receiver.phase_bias_share.get_or_insert(USUAL_SHARE);
    (site, vehicle)
}

/// The electrical angle of a row for one that was logged as the angle from the array's axis; of any
/// other array, and at a radio head, both are the same azimuth.
pub fn with_phase(logged: &LoggedAngle, measurand: &Measurand) -> LoggedAngle {
    let mut logged = *logged;
    let measured = &mut logged.measured;
    if measured.kind.is_at_head() {
        if measured.phase_rad.is_nan() {
            measured.phase_rad = wrap_angle(measured.angle_rad);
        }
    } else if measured.phase_rad.is_nan() {
        measured.phase_rad = measurand.value_rad(measured.angle_rad, 1.0);
        if let Measurand::ElectricalAngle {
            spacing_wavelengths,
            ..
        } = measurand
        {
            let (sin, cos) = measured.angle_rad.sin_cos();
            let sigma = measured.phase_sigma_rad;
            // Along the axis the angle moves the phase by its square.
            measured.phase_sigma_rad =
                TAU * spacing_wavelengths * sigma * sin.abs().hypot(sigma * cos);
        }
    }
    logged
}
