//! Energy of a run, line by line: what was counted and what was not.

use crate::settings::{Boundary, Platform, Provenance, SettingsError, Vehicle};

/// How the energy of a run follows from what happened in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyModel {
    per_execution_j: f64,
    per_listening_j: f64,
    idle_w: f64,
    /// What the energy per execution counts.
    pub boundary: Boundary,
    /// Where the energy per execution comes from.
    pub provenance: Provenance,
}

/// Energy of a run in joules.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Of estimating angles.
    pub executions_j: f64,
    /// Of listening to SSBs; 0 where the platform does not count it.
    pub listening_j: f64,
    /// Of the idle board; 0 where the platform does not count it.
    pub idle_j: f64,
}

impl Energy {
    /// All of it.
    pub fn total_j(&self) -> f64 {
        self.executions_j + self.listening_j + self.idle_j
    }
}

impl EnergyModel {
    /// The energy model of a vehicle's method on its platform and mode; `None` where the platform
    /// has no energy figure for that method.
    ///
    /// # Errors
    /// [`SettingsError`] when the platform has no such mode.
    pub fn new(vehicle: &Vehicle, platform: &Platform) -> Result<Option<Self>, SettingsError> {
        let mode = platform.mode(&vehicle.platform, &vehicle.name)?;
        let (idle, receiver) = (&platform.idle, &platform.receiver);
        let idle_w = idle
            .power_w
            .as_ref()
            .filter(|_| idle.counted)
            .map_or(0.0, |f| f.value);
        let receiver_w = receiver
            .power_w
            .as_ref()
            .filter(|_| receiver.counted)
            .map_or(0.0, |f| f.value);
        Ok(mode
            .energy_per_execution_j
            .get(&vehicle.estimator.method)
            .map(|figure| Self {
                per_execution_j: figure.value,
                per_listening_j: receiver_w * receiver.on_time_ms * 1e-3,
                idle_w,
                boundary: figure.boundary,
                provenance: figure.provenance,
            }))
    }

    /// Energy of a run of so many executions, SSB bursts listened to, and seconds.
    pub fn of_run(&self, executions: usize, listened: usize, duration_s: f64) -> Energy {
        Energy {
            executions_j: executions as f64 * self.per_execution_j,
            listening_j: listened as f64 * self.per_listening_j,
            idle_j: duration_s * self.idle_w,
        }
    }
}

#[cfg(test)]
mod tests {
    use toml::Value;

    use super::*;
    use crate::settings::{Shipped, TomlFile};

    fn paper() -> (Vehicle, Platform) {
        let vehicle = Vehicle::from_library("paper", &Shipped).unwrap();
        let platform = Platform::from_library("jetson-agx-xavier", &Shipped).unwrap();
        (vehicle, platform)
    }

    #[test]
    fn papers_mode_0() {
        let (vehicle, platform) = paper();
        let model = EnergyModel::new(&vehicle, &platform).unwrap().unwrap();
        let energy = model.of_run(1005, 4018, 80.33);
        assert!(
            (energy.total_j() / 627.22 - 1.0).abs() < 0.005,
            "{energy:?}"
        );
        assert_eq!((energy.listening_j, energy.idle_j), (0.0, 0.0));
    }

    #[test]
    fn idle_and_listening_count_when_asked() {
        let (vehicle, platform) = paper();
        let counted = platform
            .with_overrides(
                [
                    ("idle.counted", Value::Boolean(true)),
                    ("receiver.counted", Value::Boolean(true)),
                ],
                &Shipped,
            )
            .unwrap();
        let model = EnergyModel::new(&vehicle, &counted).unwrap().unwrap();
        let energy = model.of_run(0, 100, 10.0);
        assert!((energy.idle_j - 69.7).abs() < 1e-9, "{energy:?}");
        assert!(energy.listening_j > 0.0);
    }
}
