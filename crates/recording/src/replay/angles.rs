//! Angles of a recording from the vehicle's receiver and estimator, without localization.

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

/// Angles of a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordedAngles {
    /// Angles whose standard deviation is the total modelled error, see [`all_of_error`].
    pub angles: Vec<LoggedAngle>,
    /// Standard deviation of each angle due to receiver noise only (rad).
    pub noise_sigma_rad: Vec<f64>,
}

/// Estimates the angle of every SSB of the site's radio heads in a recording, whose first sample
/// was received at `start_time_s`. The times are those of the SSBs, without correction of the
/// receiver's time offset.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be read, is incompatible with the receiver or contains
/// no SSB of the site, and if the vehicle is incompatible with the site.
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

/// Returns the standard deviation (rad) of an angle due to the scatter with the site's Rician K
/// factor.
pub fn scatter_sigma_rad(site: &Site, vehicle: &Vehicle) -> f64 {
    let config = EkfConfig::new(site, vehicle);
    let measurand = config.array.measurand;
    let variance = measurand.scatter_variance(config.rician_k, measurand.mean_aperture());
    variance.sqrt()
}

/// Returns the vehicle for a log of angles whose standard deviations include the receiver noise and
/// the site's scatter. The errors are independent after half a wavelength. Mounting and calibration
/// errors of the array are not included, because the localizer models them.
pub fn all_of_error(site: &Site, vehicle: &Vehicle) -> Vehicle {
    let mut vehicle = vehicle.clone();
    vehicle.receiver.correlated_noise_fraction = Some(1.0);
    vehicle.receiver.noise_correlation_distance_m = 0.5 * site.wavelength_m();
    vehicle.receiver.noise_correlation_time_s = 1e-3; // correlation depends on distance only
    vehicle
}
