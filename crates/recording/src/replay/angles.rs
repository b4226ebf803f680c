//! A recording's angles, as the vehicle's receiver and estimator find them, without locating it.

use onboard::BoxError;
use onboard::estimator;
use onboard::localize::ekf::EkfConfig;
use onboard::receive::ReceiverConfig;
use onboard::settings::{Check, Site, Vehicle, check_together};
use onboard::thermal::ThermalNoise;

use super::error::ReplayError;
use super::receive::receive_recording;
use crate::angle_log::LoggedAngle;
use crate::sigmf::Recording;

/// The angles of a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordedAngles {
    /// Each with all of its error that is believed as its deviation: see [`all_of_error`].
    pub angles: Vec<LoggedAngle>,
    /// Of each the deviation by the receiver's noise alone (rad).
    pub noise_sigma_rad: Vec<f64>,
}

/// Estimates the angle of every SSB of the site's radio heads in a recording, whose sample 0 was
/// received at `start_time_s`. Times are the SSBs' own: the receiver's lateness is not taken off.
///
/// # Errors
/// [`ReplayError`] when the recording cannot be read, does not suit the receiver or holds no SSB of the
/// site, and when the vehicle cannot serve there.
pub fn estimate_angles(
    site: &Site,
    vehicle: &Vehicle,
    recording: &mut Recording,
    start_time_s: f64,
) -> Result<RecordedAngles, ReplayError> {
    if !start_time_s.is_finite() {
        return Err(ReplayError::StartTime { start_time_s });
    }
    let file = &vehicle.name;
    check_together(site, vehicle, Check { file })?;
    let file = recording.data_file().display().to_string();
    let config = ReceiverConfig::new(site, vehicle);
    let custom = |error| ReplayError::Custom(BoxError::from(error));
    let mut estimator = estimator::built_in(vehicle).map_err(custom)?;
    let (measurand, thermal) = (vehicle.array.measurand(), ThermalNoise::new(site, vehicle));
    let scatter_rad = scatter_sigma_rad(site, vehicle);
    let mut found = RecordedAngles::default();
    receive_recording(config, recording, start_time_s, |observations| {
        for observation in observations {
            let ssb = observation.ssb;
            let estimated = estimator.estimate(observation);
            let estimated = estimated.map_err(ReplayError::Custom)?;
            let bound_rad = || thermal.sigma_rad(ssb.snr_db);
            let measured =
                estimated.and_then(|it| estimator::measurement(&ssb, it, &measurand, bound_rad));
            let Some(mut measured) = measured else {
                continue;
            };
            found.noise_sigma_rad.push(measured.phase_sigma_rad);
            measured.phase_sigma_rad = measured.phase_sigma_rad.hypot(scatter_rad);
            found.angles.push(LoggedAngle { ssb, measured });
        }
        Ok(())
    })?;
    if found.angles.is_empty() {
        return Err(ReplayError::NoSsb { file });
    }
    Ok(found)
}

/// Deviation (rad) that the scatter which a site states by its Rician K adds to an angle.
pub fn scatter_sigma_rad(site: &Site, vehicle: &Vehicle) -> f64 {
    let config = EkfConfig::new(site, vehicle);
    let measurand = config.array.measurand;
    let variance = measurand.scatter_variance(config.rician_k, measurand.mean_aperture());
    variance.sqrt()
}

/// The vehicle for a log of angles whose deviations hold the receiver's noise and the site's scatter:
/// all of an angle's error is another half a wavelength on. How well the array is mounted and
/// calibrated is not in them: the localizer reckons with it by itself.
pub fn all_of_error(site: &Site, vehicle: &Vehicle) -> Vehicle {
    let mut vehicle = vehicle.clone();
    vehicle.receiver.phase_bias_share = Some(1.0);
    vehicle.receiver.phase_bias_correlation_m = 0.5 * site.wavelength_m();
    vehicle.receiver.phase_bias_correlation_s = 1e-3; // only the way forgets
    vehicle
}
