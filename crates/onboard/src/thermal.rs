//! Variance of an angle due to thermal noise, from the link budget.

use crate::link_budget::LinkBudget;
use crate::manifold::Measurand;
use crate::radio_head::RadioHead;
use crate::settings::{Pilots, Site, Vehicle};

/// Thermal noise of an angle: the Cramér–Rao bound of the snapshots of one SSB. If the array's
/// sensitivity depends on the azimuth, it is the mean over all azimuths at the horizon.
#[derive(Clone, Debug)]
pub struct ThermalNoise {
    budget: LinkBudget,
    measurand: Measurand,
    pilots: Pilots,
    snapshots: usize,
}

impl ThermalNoise {
    /// Returns the thermal noise of a vehicle at a site.
    pub fn new(site: &Site, vehicle: &Vehicle) -> Self {
        Self {
            budget: LinkBudget::new(site, vehicle),
            measurand: vehicle.array.measurand(),
            pilots: vehicle.receiver.pilots,
            snapshots: usize::from(vehicle.receiver.snapshots),
        }
    }

    /// Returns the variance (rad²) of the angle to a radio head at a distance, with the SNR of the
    /// link budget.
    pub fn variance(&self, head: &RadioHead, distance_m: f64) -> f64 {
        self.sigma_rad(self.budget.snr_db(head, distance_m)).powi(2)
    }

    /// Returns the standard deviation (rad) of an angle for an SNR per antenna and resource
    /// element.
    pub fn sigma_rad(&self, snr_db: f64) -> f64 {
        let snr = 10f64.powf(0.1 * snr_db);
        let n = f64::from(self.measurand.elements());
        // An unknown signal increases the variance by the factor 1 + 1/(N snr) (Stoica and Nehorai
        // 1990).
        let (total_snr, cost) = match self.pilots.per_symbol() {
            None => (snr * self.snapshots as f64, 1.0 + 1.0 / (n * snr)),
            Some(symbols) => (snr * f64::from(symbols.iter().sum::<u16>()), 1.0),
        };
        (cost / (2.0 * total_snr * self.measurand.mean_aperture())).sqrt()
    }
}
