//! Power of the onboard computer's parts: board, receiver, cores, and power modes.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::figure::{Extent, Figure, Quantity};
use super::receiver::EstimatorMethod;

/// `[idle]`: power of the idle board.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IdleSettings {
    /// Whether idle power is part of a run's energy.
    pub counted: bool,
    /// Idle power in watts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_w: Option<Figure>,
}

/// `[receiver]`: power of the receiver.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverPower {
    /// Whether the receiver's power is part of a run's energy.
    pub counted: bool,
    /// Receiver on-time before a burst of 5 ms, until oscillator and gain have settled, in ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_ms: Option<Quantity>,
    /// Power of the receiver in watts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_w: Option<Figure>,
}

/// `[cpu]`: an estimate takes a number of cycles at the mode's clock frequency, at the power of one
/// busy core.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CpuSettings {
    /// Cycles of one estimate, for each method.
    #[serde(default)]
    pub cycles_per_execution: BTreeMap<EstimatorMethod, Quantity>,
    /// Cycles for the reception of one SSB burst, with or without an angle estimate.
    pub cycles_per_burst: Quantity,
    /// Power of a busy core, for modes without a value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub core: Option<CorePower>,
}

/// `[cpu.core]`: power of a busy core, `P·(f / f_ref)^n`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CorePower {
    /// Power of one busy core above idle, at `reference_mhz`, in watts.
    pub power_w: Figure,
    /// Clock frequency of `power_w`, in MHz.
    #[schemars(range(min = 1.0, max = 1e5))]
    pub reference_mhz: f64,
    /// Exponent n of the clock frequency: 1 at constant voltage, 3 if the voltage scales with the
    /// clock.
    pub exponent: Quantity,
}

impl CorePower {
    /// Returns the power of a busy core at a clock frequency, in watts.
    pub(super) fn at(&self, cpu_mhz: f64, extent: Extent) -> f64 {
        let clock = cpu_mhz / self.reference_mhz;
        // Below the reference clock, the larger exponent gives the smaller power.
        let end = if clock < 1.0 {
            extent.opposite()
        } else {
            extent
        };
        self.power_w.at(extent) * clock.powf(self.exponent.at(end))
    }
}

/// `[suspend]`: the board suspends if the time to the next received burst exceeds the transition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuspendSettings {
    /// Power in the suspend state, in watts.
    pub power_w: Figure,
    /// Time to suspend and resume, at idle power, in ms.
    pub transition_ms: Quantity,
}

/// `[[modes]]`: a power mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerMode {
    /// Number of the power mode.
    pub mode: u32,
    /// Name of the power mode in the manufacturer's configuration.
    pub name: String,
    /// CPU frequency in MHz.
    #[schemars(range(min = 1.0, max = 1e5))]
    pub cpu_mhz: f64,
    /// Number of CPU cores online.
    #[schemars(range(min = 1, max = 4096))]
    pub cores: u32,
    /// Idle power of the board in this mode, in watts. Default: that of the platform.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub idle_power_w: Option<Figure>,
    /// Power of one busy core above idle, in watts. Default: that of `cpu.core` at this clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub core_power_w: Option<Figure>,
    /// Minimum time between two estimates in ms, for each method. Default: cycles divided by the
    /// clock frequency.
    #[serde(default)]
    #[schemars(inner(range(min = 1e-3, max = 3.6e6)))]
    pub base_wake_up_ms: BTreeMap<EstimatorMethod, f64>,
    /// Energy of one estimate in joules, for each method. Default: duration times the power of a
    /// busy core.
    #[serde(default)]
    pub energy_per_execution_j: BTreeMap<EstimatorMethod, Figure>,
    /// Power of the board with all cores busy, in watts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_load_power_w: Option<Figure>,
}
