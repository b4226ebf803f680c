//! What the parts of an onboard computer draw: board, receiver, cores, and in which power modes.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::figure::{Extent, Figure, Quantity};
use super::receiver::EstimatorMethod;

/// `[idle]`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IdleSettings {
    /// Whether idle power counts as part of a run's energy.
    pub counted: bool,
    /// Idle power in watts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_w: Option<Figure>,
}

/// `[receiver]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverPower {
    /// Whether the receiver's power counts as part of a run's energy.
    pub counted: bool,
    /// How long it is on for one SSB burst, in ms.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub on_time_ms: f64,
    /// How long it is on before that, until oscillator and gain have settled, in ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_ms: Option<Quantity>,
    /// Its power in watts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_w: Option<Figure>,
}

impl Default for ReceiverPower {
    fn default() -> Self {
        Self {
            counted: false,
            on_time_ms: 5.0,
            settling_ms: None,
            power_w: None,
        }
    }
}

/// `[cpu]`: an execution takes its cycles at the mode's clock, at the power of one busy core.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CpuSettings {
    /// Cycles of one estimate, per method.
    #[serde(default)]
    pub cycles_per_execution: BTreeMap<EstimatorMethod, Quantity>,
    /// Cycles of receiving one SSB burst, whether or not an angle is estimated from it.
    pub cycles_per_burst: Quantity,
    /// Power of a busy core, for modes that do not state it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub core: Option<CorePower>,
}

/// `[cpu.core]`: `P·(f / f_ref)^n`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CorePower {
    /// Power of one busy core above idle, at `reference_mhz`, in watts.
    pub power_w: Figure,
    /// Clock that `power_w` is stated for, in MHz.
    #[schemars(range(min = 1.0, max = 1e5))]
    pub reference_mhz: f64,
    /// Power of the clock that it grows with: 1 at constant voltage, 3 where the voltage follows.
    pub exponent: Quantity,
}

impl CorePower {
    /// Power of a busy core at a clock, in watts.
    pub(super) fn at(&self, cpu_mhz: f64, extent: Extent) -> f64 {
        let clock = cpu_mhz / self.reference_mhz;
        // Below the reference clock, the greater exponent makes for the smaller power.
        let end = if clock < 1.0 {
            extent.opposite()
        } else {
            extent
        };
        self.power_w.at(extent) * clock.powf(self.exponent.at(end))
    }
}

/// `[suspend]`: the board sleeps whenever the next burst that it listens to is far enough.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuspendSettings {
    /// Power asleep in watts.
    pub power_w: Figure,
    /// Time to fall asleep and wake up again, at idle power, in ms.
    pub transition_ms: Quantity,
}

/// `[[modes]]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerMode {
    /// Its number.
    pub mode: u32,
    /// Its name in the maker's configuration.
    pub name: String,
    /// CPU frequency in MHz.
    #[schemars(range(min = 1.0, max = 1e5))]
    pub cpu_mhz: f64,
    /// CPU cores online.
    #[schemars(range(min = 1, max = 4096))]
    pub cores: u32,
    /// Memory clock in MHz; without it, the board's maximum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub memory_mhz: Option<f64>,
    /// CPU frequency in MHz as the paper prints it, where it differs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paper_cpu_mhz: Option<f64>,
    /// Power of the board in this mode whether or not anything is estimated, in watts; without, the
    /// platform's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub idle_power_w: Option<Figure>,
    /// Power of one busy core above idle, in watts; without, that of `cpu.core` at the clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub core_power_w: Option<Figure>,
    /// Shortest time between two estimates in ms, per method; without, the cycles at the clock.
    #[serde(default)]
    #[schemars(inner(range(min = 1e-3, max = 3.6e6)))]
    pub base_wake_up_ms: BTreeMap<EstimatorMethod, f64>,
    /// Energy of one estimate in joules, per method; without, the cycles at a core's power.
    #[serde(default)]
    pub energy_per_execution_j: BTreeMap<EstimatorMethod, Figure>,
    /// Power of the whole board with all cores busy, in watts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_load_power_w: Option<Figure>,
}
