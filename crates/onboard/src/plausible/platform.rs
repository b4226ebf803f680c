//! Plausibility of a platform file.

use super::usual::{Usual, rounded, unusual};
use super::warning::Warning;
use crate::settings::Platform;

const ROWS: &[Usual] = &[
    Usual {
        key: "modes[].cpu_mhz",
        within: [20.0, 10_000.0],
        why: "cores run at 100 MHz to 6 GHz",
        write: |it| format!("specify MHz: {it} GHz are {}", rounded(it * 1000.0)),
    },
    Usual {
        key: "idle.power_w.value",
        within: [0.0, 2000.0],
        why: "above the power of any vehicle's computer",
        write: |it| format!("specify watts: {it} mW are {}", rounded(it / 1000.0)),
    },
    Usual {
        key: "modes[].idle_power_w.value",
        within: [0.0, 2000.0],
        why: "above the power of any vehicle's computer",
        write: |it| format!("specify watts: {it} mW are {}", rounded(it / 1000.0)),
    },
    Usual {
        key: "supply_efficiency.value",
        within: [0.2, 1.0],
        why: "the efficiency of a power supply is between 0.5 and 1",
        write: |it| format!("specify a fraction: {it} % are {}", rounded(it / 100.0)),
    },
];

/// Returns the warnings of a platform.
pub fn of_platform(platform: &Platform) -> Vec<Warning> {
    unusual(platform, ROWS)
}
