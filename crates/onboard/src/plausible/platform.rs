//! What a platform's file says.

use super::usual::{Usual, rounded, unusual};
use super::warning::Warning;
use crate::settings::Platform;

const ROWS: &[Usual] = &[
    Usual {
        key: "modes[].cpu_mhz",
        within: [20.0, 10_000.0],
        why: "cores run at 100 MHz to 6 GHz",
        write: |it| format!("write MHz: {it} GHz are {}", rounded(it * 1000.0)),
    },
    Usual {
        key: "idle.power_w.value",
        within: [0.0, 2000.0],
        why: "no vehicle's computer draws as much",
        write: |it| format!("write watts: {it} mW are {}", rounded(it / 1000.0)),
    },
    Usual {
        key: "modes[].idle_power_w.value",
        within: [0.0, 2000.0],
        why: "no vehicle's computer draws as much",
        write: |it| format!("write watts: {it} mW are {}", rounded(it / 1000.0)),
    },
    Usual {
        key: "supply_efficiency.value",
        within: [0.2, 1.0],
        why: "no supply gives more than it takes, and none wastes as much",
        write: |it| format!("write a share of 1: {it} % are {}", rounded(it / 100.0)),
    },
];

/// What is doubtful of a platform.
pub fn of_platform(platform: &Platform) -> Vec<Warning> {
    unusual(platform, ROWS)
}
