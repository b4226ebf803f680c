//! Error model of angles with a standard deviation from another receiver.

use std::f64::consts::TAU;

use onboard::geometry::wrap_angle;
use onboard::manifold::Measurand;
use onboard::settings::{DriveKind, Site, Vehicle};

use crate::angle_log::LoggedAngle;

/// Fraction of the specified variance that is correlated between angles. Examined sensors (cameras,
/// and a laser with cautious specifications) have 0.08 to 0.2.
const USUAL_SHARE: f64 = 0.25;

/// Prior probability of errors that are correlated over metres, if it is not specified.
const USUAL_PROBABILITY: f64 = 0.75;

/// Rician K factor (dB) without scatter.
const NO_SCATTER_DB: f64 = 200.0;

/// Returns the site and vehicle for angles whose specified standard deviation is the total error.
/// The site's scatter is not added. Angles to one radio head within a second or a metre are not
/// independent, unless the receiver's settings specify otherwise. For a road vehicle, errors that are correlated over
/// metres (multipath) are estimated while driving, unless their probability is specified.
pub fn as_stated(site: &Site, vehicle: &Vehicle) -> (Site, Vehicle) {
    let site = Site {
        rician_k_db: NO_SCATTER_DB,
        ..site.clone()
    };
    let mut vehicle = vehicle.clone();
    let receiver = &mut vehicle.receiver;
    // Angles of a differential drive with reflections resemble those of a lost drive, so that the
    // two would be confused.
    let is_road = vehicle.drive == DriveKind::Road;
    (receiver.multipath_bias_probability).get_or_insert(if is_road {
        USUAL_PROBABILITY
    } else {
        0.0
    });
    receiver
        .correlated_noise_fraction
        .get_or_insert(USUAL_SHARE);
    (site, vehicle)
}

/// Returns the angle with its electrical angle, computed from the angle from the array's axis for a
/// linear array. For any other array, and at a radio head, both are the azimuth.
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
            // Near the axis, the phase is a quadratic function of the angle.
            measured.phase_sigma_rad =
                TAU * spacing_wavelengths * sigma * sin.abs().hypot(sigma * cos);
        }
    }
    logged
}
