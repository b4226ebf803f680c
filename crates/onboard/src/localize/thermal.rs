//! What thermal noise leaves of an angle, by the link budget.

use aoa::bound;

use crate::elements::for_elements;
use crate::link_budget::LinkBudget;
use crate::radio_head::RadioHead;
use crate::settings::{Pilots, Site, Vehicle};

/// Thermal noise of an electrical angle: the Cramér–Rao bound of the snapshots of one SSB.
#[derive(Clone, Debug)]
pub struct ThermalNoise {
    budget: LinkBudget,
    elements: u8,
    pilots: Pilots,
    snapshots: usize,
}

impl ThermalNoise {
    /// That of a vehicle at a site.
    pub fn new(site: &Site, vehicle: &Vehicle) -> Self {
        Self {
            budget: LinkBudget::new(site, vehicle),
            elements: vehicle.array.elements,
            pilots: vehicle.receiver.pilots,
            snapshots: usize::from(vehicle.receiver.snapshots),
        }
    }

    /// Variance (rad²) of the electrical angle to a radio head at this distance, at the SNR of the
    /// link budget.
    pub fn variance(&self, head: &RadioHead, distance_m: f64) -> f64 {
        self.sigma_rad(self.budget.snr_db(head, distance_m)).powi(2)
    }

    /// Standard deviation (rad) of the electrical angle at an SNR per antenna and resource element.
    pub fn sigma_rad(&self, snr_db: f64) -> f64 {
        let snr = 10f64.powf(0.1 * snr_db);
        for_elements!(self.elements, N => match self.pilots.per_symbol() {
            None => bound::stochastic::<N>(snr, self.snapshots),
            Some(symbols) => {
                let elements: u16 = symbols.iter().sum();
                bound::known_signal::<N>(snr * f64::from(elements))
            }
        })
    }
}
