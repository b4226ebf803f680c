//! What is believed of angles whose deviation somebody else has stated.

use onboard::settings::{Site, Vehicle};

/// Share of a stated deviation that stays from look to look on the sensors that were looked into.
const USUAL_BIAS_SHARE: f64 = 1.0;

/// Rician K (dB) of no scatter.
const NO_SCATTER_DB: f64 = 200.0;

/// Site and vehicle for angles whose stated deviation is all of their error: the site's scatter is
/// not added to it, and looks at one radio head within a second or a metre do not count as
/// independent, by as much as the receiver's settings say or, without, by about as much as is
/// stated.
pub fn as_stated(site: &Site, vehicle: &Vehicle, phase_sigma_rad: f64) -> (Site, Vehicle) {
    let site = Site {
        rician_k_db: NO_SCATTER_DB,
        ..site.clone()
    };
    let mut vehicle = vehicle.clone();
    if vehicle.receiver.phase_bias_std_rad == 0.0 {
        vehicle.receiver.phase_bias_std_rad = USUAL_BIAS_SHARE * phase_sigma_rad;
    }
    (site, vehicle)
}
