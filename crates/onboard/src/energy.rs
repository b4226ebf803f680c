//! Energy of a run by component, with its boundary.
//!
//! Each received burst consumes the receiver's on-time (settling plus burst) and the cycles of its
//! reception. Each estimate consumes its own cycles. For the remaining time the board idles or is
//! suspended. Energies above idle are additive; at most one term may contain the board's idle
//! power, because two would count it twice.

use crate::settings::{
    Boundary, Extent, Figure, Platform, PowerMode, Provenance, SettingsError, Vehicle,
};

/// Duration of an SSB burst, which is transmitted within half a frame (TS 38.213, 4.1), in ms.
const BURST_MS: f64 = 5.0;

/// Energy model of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyModel {
    per_estimate_j: f64,
    per_listening_j: f64,
    /// Receiver on-time for one burst, including settling, in seconds.
    pub on_time_s: f64,
    idle_w: f64,
    sleep: Option<Sleep>,
    /// Components that the total includes.
    pub boundary: Boundary,
    /// Provenance of the energy per estimate.
    pub provenance: Provenance,
}

/// Suspend state between wake-ups.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sleep {
    power_w: f64,
    /// Awake time for each burst: transition, settling, burst and computation, in seconds.
    awake_s: f64,
}

/// Cost of one estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum EstimateCost {
    /// The value that the platform specifies for the estimation method of the vehicle.
    #[default]
    OfMethod,
    /// Energy above idle in joules, of a custom estimator.
    EnergyJ(f64),
    /// Duration on one busy core in seconds, of a custom estimator.
    TimeS(f64),
    /// Unknown, for a custom estimator without values.
    Unknown,
}

/// Energy of a run in joules.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Energy of the angle estimates.
    pub aoa_estimates_j: f64,
    /// Energy of the reception of SSBs; 0 if the platform does not include it.
    pub listening_j: f64,
    /// Idle energy of the board; 0 if the platform does not include it.
    pub idle_j: f64,
}

impl Energy {
    /// Returns the total energy.
    pub fn total_j(&self) -> f64 {
        self.aoa_estimates_j + self.listening_j + self.idle_j
    }
}

impl EnergyModel {
    /// Returns the energy model of a vehicle's method on its platform and power mode; `None` if the
    /// platform has no energy value for the method. `extent` selects the nominal values, or the
    /// ends of their ranges with the minimum or maximum energy.
    ///
    /// # Errors
    /// [`SettingsError`] if the platform does not have this mode, or counts the idle board twice.
    pub fn new(
        vehicle: &Vehicle,
        platform: &Platform,
        extent: Extent,
    ) -> Result<Option<Self>, SettingsError> {
        Self::with_cost(EstimateCost::OfMethod, vehicle, platform, extent)
    }

    /// Returns the energy model with a given cost of an estimate; `None` if the cost is unknown, or
    /// is a duration and the platform has no power of a busy core.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_cost(
        cost: EstimateCost,
        vehicle: &Vehicle,
        platform: &Platform,
        extent: Extent,
    ) -> Result<Option<Self>, SettingsError> {
        let mode = platform.mode(&vehicle.platform, &vehicle.name)?;
        let per_estimate = match cost {
            EstimateCost::OfMethod => CostPerEstimate::new(vehicle, platform, mode, extent),
            EstimateCost::EnergyJ(energy_j) => Some(CostPerEstimate {
                energy_j,
                time_s: 0.0,
                boundary: Boundary::Marginal,
                provenance: Provenance::Assumed,
            }),
            EstimateCost::TimeS(time_s) => CostPerEstimate::of_time(time_s, platform, mode, extent),
            EstimateCost::Unknown => None,
        };
        let Some(per_estimate) = per_estimate else {
            return Ok(None);
        };
        let idle = platform
            .idle_power_w(mode)
            .filter(|_| platform.idle.counted);
        let receiver = &platform.receiver;
        let radio = receiver.power_w.as_ref().filter(|_| receiver.counted);
        let boundary = platform.boundary_of_sum([
            Some(per_estimate.boundary),
            radio.map(|figure| figure.boundary),
            idle.map(|figure| figure.boundary),
        ])?;
        // Power above idle at the rails is divided by the efficiency of the supply.
        let efficiency = platform.supply_efficiency.as_ref();
        let loss = match (efficiency, boundary) {
            (Some(efficiency), Boundary::Wall) => 1.0 / efficiency.at(extent.opposite()),
            _ => 1.0,
        };
        let scale = |boundary| {
            if boundary == Boundary::Marginal {
                loss
            } else {
                1.0
            }
        };
        let settling_ms = receiver
            .settling_ms
            .as_ref()
            .map_or(0.0, |it| it.at(extent));
        let on_s = (settling_ms + BURST_MS) * 1e-3;
        let radio_j = radio.map_or(0.0, |it| it.at(extent) * on_s * scale(it.boundary));
        let cpu = platform.cpu.as_ref().filter(|_| receiver.counted);
        let burst_s = cpu.map_or(0.0, |cpu| {
            cpu.cycles_per_burst.at(extent) / (mode.cpu_mhz * 1e6)
        });
        let burst_j = platform
            .core_power_w(mode, extent)
            .map_or(0.0, |(core_w, figure)| {
                burst_s * core_w * scale(figure.boundary)
            });
        let sleep = platform.suspend.as_ref().map(|suspend| Sleep {
            power_w: suspend.power_w.at(extent),
            awake_s: suspend.transition_ms.at(extent) * 1e-3 + on_s + burst_s + per_estimate.time_s,
        });
        Ok(Some(Self {
            per_estimate_j: per_estimate.energy_j * scale(per_estimate.boundary),
            per_listening_j: radio_j + burst_j,
            on_time_s: on_s,
            idle_w: idle.map_or(0.0, |figure| figure.at(extent)),
            sleep,
            boundary,
            provenance: per_estimate.provenance,
        }))
    }

    /// Returns the energy of the reception of a burst in units of one estimate; `None` if an
    /// estimate has no energy.
    pub fn listening_in_aoa_estimates(&self) -> Option<f64> {
        (self.per_estimate_j > 0.0).then(|| self.per_listening_j / self.per_estimate_j)
    }

    /// Returns the energy of a run from its numbers of estimates and received bursts, and its
    /// duration.
    pub fn run_energy(
        &self,
        aoa_estimates: usize,
        bursts_received: usize,
        duration_s: f64,
    ) -> Energy {
        let idle_j = match self.sleep {
            Some(sleep) if self.idle_w > 0.0 => {
                // Bursts without time for a suspend keep the board awake.
                let awake_s = (bursts_received as f64 * sleep.awake_s).min(duration_s);
                awake_s * self.idle_w + (duration_s - awake_s) * sleep.power_w
            }
            _ => duration_s * self.idle_w,
        };
        Energy {
            aoa_estimates_j: aoa_estimates as f64 * self.per_estimate_j,
            listening_j: bursts_received as f64 * self.per_listening_j,
            idle_j,
        }
    }
}

/// Cost of one estimate: the measured value of the power mode, otherwise the cycles of the method
/// at the mode's clock frequency.
struct CostPerEstimate {
    energy_j: f64,
    time_s: f64,
    boundary: Boundary,
    provenance: Provenance,
}

impl CostPerEstimate {
    fn new(
        vehicle: &Vehicle,
        platform: &Platform,
        mode: &PowerMode,
        extent: Extent,
    ) -> Option<Self> {
        let method = &vehicle.estimator.method;
        let cpu = platform.cpu.as_ref();
        let cycles = cpu.and_then(|cpu| cpu.cycles_per_execution.get(method));
        let time_s = cycles.map_or(0.0, |cycles| cycles.at(extent) / (mode.cpu_mhz * 1e6));
        if let Some(stated) = mode.energy_per_execution_j.get(method) {
            return Some(Self {
                energy_j: Figure::at(stated, extent),
                time_s,
                boundary: stated.boundary,
                provenance: stated.provenance,
            });
        }
        let projected = cycles?.provenance == Provenance::Projected;
        let per_estimate = Self::of_time(time_s, platform, mode, extent)?;
        Some(if projected {
            Self {
                provenance: Provenance::Projected,
                ..per_estimate
            }
        } else {
            per_estimate
        })
    }

    /// Returns the cost of a duration on a busy core; `None` if the platform has no power of a busy
    /// core.
    fn of_time(time_s: f64, platform: &Platform, mode: &PowerMode, extent: Extent) -> Option<Self> {
        let (core_w, figure) = platform.core_power_w(mode, extent)?;
        Some(Self {
            energy_j: time_s * core_w,
            time_s,
            boundary: figure.boundary,
            provenance: figure.provenance,
        })
    }
}

#[cfg(test)]
mod tests {
    use toml::Value;

    use super::*;
    use crate::settings::{Shipped, TomlFile};

    fn vehicle() -> Vehicle {
        Vehicle::from_library("paper", &Shipped).unwrap()
    }

    fn platform(name: &str) -> Platform {
        Platform::from_library(name, &Shipped).unwrap()
    }

    fn model(platform: &Platform, extent: Extent) -> EnergyModel {
        EnergyModel::new(&vehicle(), platform, extent)
            .unwrap()
            .unwrap()
    }

    #[test]
    fn the_energy_of_mode_0_equals_that_of_the_paper() {
        let model = model(&platform("jetson-agx-xavier"), Extent::Value);
        let energy = model.run_energy(1005, 4018, 80.33);
        assert!(
            (energy.total_j() / 627.22 - 1.0).abs() < 0.005,
            "{energy:?}"
        );
        assert_eq!((energy.listening_j, energy.idle_j), (0.0, 0.0));
        assert_eq!(model.boundary, Boundary::Unstated);
    }

    #[test]
    fn the_receiver_energy_is_counted_if_configured() {
        let counted = platform("jetson-agx-xavier")
            .with_overrides([("receiver.counted", Value::Boolean(true))], &Shipped)
            .unwrap();
        let energy = model(&counted, Extent::Value).run_energy(0, 100, 10.0);
        let receiver = &counted.receiver;
        let on_ms = BURST_MS + receiver.settling_ms.as_ref().unwrap().value;
        let radio_j = 100.0 * on_ms * 1e-3 * receiver.power_w.as_ref().unwrap().value;
        assert!((energy.listening_j - radio_j).abs() < 1e-9, "{energy:?}");
        assert_eq!(energy.idle_j, 0.0);
    }

    #[test]
    fn the_idle_board_is_not_counted_twice() {
        let twice = platform("jetson-agx-xavier")
            .with_overrides([("idle.counted", Value::Boolean(true))], &Shipped)
            .unwrap();
        let error = EnergyModel::new(&vehicle(), &twice, Extent::Value).unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains("idle.counted") && message.contains("unstated"),
            "{message}"
        );
    }

    const CONTROLLED: &str = r#"
        name = "round figures"
        [idle]
        counted = true
        power_w = { value = 4.0, provenance = "assumed", source = "test", boundary = "soc-rails" }
        [receiver]
        counted = true
        settling_ms = { value = 5.0, low = 1.0, high = 15.0, provenance = "assumed", source = "test" }
        power_w = { value = 1.0, low = 0.5, high = 2.0, provenance = "assumed", source = "test", boundary = "marginal" }
        [cpu]
        cycles_per_burst = { value = 2e6, provenance = "assumed", source = "test" }
        cycles_per_execution.music = { value = 4e6, provenance = "assumed", source = "test" }
        [cpu.core]
        reference_mhz = 1000.0
        power_w = { value = 0.5, provenance = "assumed", source = "test", boundary = "marginal" }
        exponent = { value = 3.0, provenance = "assumed", source = "test" }
        [[modes]]
        mode = 0
        name = "fast"
        cpu_mhz = 2000.0
        cores = 4
    "#;

    #[test]
    fn time_and_energy_follow_from_cycles() {
        let platform = Platform::from_toml(CONTROLLED, "test", &Shipped).unwrap();
        let model = model(&platform, Extent::Value);
        let energy = model.run_energy(10, 100, 10.0);
        // The core power is 0.5 W · 2³ = 4 W. An estimate takes 2 ms of it; a burst takes 1 ms of
        // it, and 10 ms of the receiver's 1 W.
        assert!(
            (energy.aoa_estimates_j - 10.0 * 8e-3).abs() < 1e-12,
            "{energy:?}"
        );
        assert!(
            (energy.listening_j - 100.0 * 14e-3).abs() < 1e-12,
            "{energy:?}"
        );
        assert!((energy.idle_j - 40.0).abs() < 1e-12, "{energy:?}");
        assert_eq!(model.boundary, Boundary::SocRails);
        assert!((platform.base_wake_up_s(&vehicle()).unwrap() - 3e-3).abs() < 1e-12);
    }

    #[test]
    fn a_custom_estimator_has_the_energy_that_it_specifies() {
        let platform = Platform::from_toml(CONTROLLED, "test", &Shipped).unwrap();
        let aoa_estimates_j = |cost| {
            let model = EnergyModel::with_cost(cost, &vehicle(), &platform, Extent::Value);
            let model = model.unwrap();
            model.map(|model| model.run_energy(10, 100, 10.0).aoa_estimates_j)
        };
        let close = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-12;
        assert!(close(aoa_estimates_j(EstimateCost::EnergyJ(0.3)), 3.0));
        // The power of a core is 4 W.
        assert!(close(aoa_estimates_j(EstimateCost::TimeS(0.01)), 0.4));
        assert_eq!(aoa_estimates_j(EstimateCost::Unknown), None);
    }

    #[test]
    fn ranges_contain_the_value() {
        let platform = Platform::from_toml(CONTROLLED, "test", &Shipped).unwrap();
        let total_j = |extent| {
            model(&platform, extent)
                .run_energy(10, 100, 10.0)
                .listening_j
        };
        assert!((total_j(Extent::Low) - 100.0 * (3e-3 + 4e-3)).abs() < 1e-12);
        assert!((total_j(Extent::High) - 100.0 * (40e-3 + 4e-3)).abs() < 1e-12);
    }

    #[test]
    fn wall_power_includes_conversion_losses() {
        let text = CONTROLLED.replace("soc-rails", "wall");
        let supplied = format!(
            "supply_efficiency = {{ value = 0.8, provenance = \"assumed\", source = \"test\" }}\n{text}"
        );
        let platform = Platform::from_toml(&supplied, "test", &Shipped).unwrap();
        let energy = model(&platform, Extent::Value).run_energy(10, 100, 10.0);
        assert!(
            (energy.aoa_estimates_j - 10.0 * 8e-3 / 0.8).abs() < 1e-12,
            "{energy:?}"
        );
        assert!((energy.idle_j - 40.0).abs() < 1e-12, "{energy:?}");
    }

    #[test]
    fn the_board_sleeps_between_distant_wake_ups() {
        let text = format!(
            "{CONTROLLED}\n[suspend]\n\
             power_w = {{ value = 0.5, provenance = \"assumed\", source = \"test\", boundary = \"soc-rails\" }}\n\
             transition_ms = {{ value = 87.0, provenance = \"assumed\", source = \"test\" }}\n"
        );
        let platform = Platform::from_toml(&text, "test", &Shipped).unwrap();
        let model = model(&platform, Extent::Value);
        // Awake time per burst: 87 + 10 + 1 + 2 = 100 ms.
        let energy = model.run_energy(10, 10, 10.0);
        assert!(
            (energy.idle_j - (4.0 + 9.0 * 0.5)).abs() < 1e-9,
            "{energy:?}"
        );
        let busy = model.run_energy(500, 500, 10.0);
        assert!((busy.idle_j - 40.0).abs() < 1e-9, "{busy:?}");
    }
}
