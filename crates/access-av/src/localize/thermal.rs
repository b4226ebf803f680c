//! What thermal noise leaves of an angle, by the link budget.

use aoa::bound;

use crate::channel::LinkBudget;
use crate::observation::ANTENNAS;
use crate::scenario::{Pilots, Scenario};
use crate::world::RadioHead;

/// Thermal noise of an electrical angle: the Cramér–Rao bound of the snapshots of one SSB at the
/// SNR of the link budget.
#[derive(Clone, Debug)]
pub struct ThermalNoise {
    budget: LinkBudget,
    pilots: Pilots,
    snapshots: usize,
}

impl ThermalNoise {
    /// The scenario's.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            budget: LinkBudget::new(scenario),
            pilots: scenario.receiver.pilots,
            snapshots: usize::from(scenario.array.snapshots),
        }
    }

    /// Variance (rad²) of the electrical angle to a radio head at this distance.
    pub fn variance(&self, head: &RadioHead, distance_m: f64) -> f64 {
        let snr = 10f64.powf(0.1 * self.budget.snr_db(head, distance_m));
        let sigma = match self.pilots.per_symbol() {
            None => bound::stochastic::<ANTENNAS>(snr, self.snapshots),
            Some(symbols) => {
                let elements: u16 = symbols.iter().sum();
                bound::known_signal::<ANTENNAS>(snr * f64::from(elements))
            }
        };
        sigma * sigma
    }
}
