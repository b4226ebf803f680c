//! Received power and noise power (paper: "Path Loss and Fading Model").

use std::f64::consts::PI;

use crate::radio_head::RadioHead;
use crate::settings::{Site, Vehicle};

/// Boltzmann's constant in J/K (SI, exact).
const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;

/// Standard noise temperature in kelvin, to which noise figures refer (ITU-R P.372).
pub(crate) const NOISE_TEMPERATURE_K: f64 = 290.0;

/// Link budget, without the properties of a radio head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkBudget {
    wavelength_m: f64,
    rx_gain_dbi: f64,
    noise_dbm: f64,
}

impl LinkBudget {
    /// Returns the link budget between a site's cells and a vehicle.
    pub fn new(site: &Site, vehicle: &Vehicle) -> Self {
        let receiver = &vehicle.receiver;
        let noise_w = BOLTZMANN_J_PER_K * NOISE_TEMPERATURE_K * site.ssb.bandwidth_hz();
        Self {
            wavelength_m: site.wavelength_m(),
            rx_gain_dbi: vehicle.array.rx_gain_dbi,
            noise_dbm: 10.0 * (noise_w * 1e3).log10() + receiver.noise_figure_db,
        }
    }

    /// Returns the noise power in dBm: k·T·B times the noise figure.
    pub const fn noise_dbm(&self) -> f64 {
        self.noise_dbm
    }

    /// Returns the free-space path loss in dB, 20·log₁₀(4πd/λ) (Friis).
    pub fn path_loss_db(&self, distance_m: f64) -> f64 {
        20.0 * (4.0 * PI * distance_m / self.wavelength_m).log10()
    }

    /// Returns the SNR per antenna and sample in dB, without shadowing and fading.
    pub fn snr_db(&self, head: &RadioHead, distance_m: f64) -> f64 {
        head.eirp_dbm + self.rx_gain_dbi - self.path_loss_db(distance_m) - self.noise_dbm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Shipped, TomlFile};

    #[test]
    fn the_link_budget_equals_that_of_the_paper() {
        let site = Site::from_library("paper", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("paper", &Shipped).unwrap();
        let budget = LinkBudget::new(&site, &vehicle);
        // −174 dBm/Hz at 290 K, 10·log10(3.6e6) = 65.56, noise figure 5 dB.
        assert!((budget.noise_dbm() - (-173.975 + 65.563 + 5.0)).abs() < 1e-3);
        // 20·log10(100 m) + 20·log10(3.5e9 Hz) − 147.552
        assert!((budget.path_loss_db(100.0) - (40.0 + 190.881 - 147.552)).abs() < 1e-3);
        let head = RadioHead {
            eirp_dbm: -17.0,
            array: None,
            ..RadioHead::from(&site.radio_heads[0])
        };
        // −27 + 10 + 5 − 83.329 + 103.412 = 8.08 dB at 100 m; minus 6.02 dB at twice the distance.
        assert!((budget.snr_db(&head, 100.0) - 8.083).abs() < 2e-3);
        assert!((budget.snr_db(&head, 200.0) - 2.063).abs() < 2e-3);
    }
}
