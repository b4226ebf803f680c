//! Implausible prices, emission factors and powers of a plant.

use serde::Serialize;

use onboard::plausible::{Usual, Warning, as_millimetres, rounded, unusual};

/// Returns warnings about implausible figures of `[prices]`.
pub(super) fn of_plant(plant: &impl Serialize, currency: &str) -> Vec<Warning> {
    let mut found = unusual(plant, FACTORS);
    if LIKE_DOLLARS.contains(&currency) {
        found.extend(unusual(plant, PRICES));
    }
    found
}

/// Currencies in which usual prices have the size that [`PRICES`] gives.
const LIKE_DOLLARS: [&str; 5] = ["USD", "EUR", "GBP", "CHF", "CAD"];

/// Usual figures of `[prices]`; money in a currency of about one US dollar.
const PRICES: &[Usual] = &[
    Usual {
        key: "prices.electricity_per_kwh.value",
        within: [0.01, 2.0],
        why: "industrial electricity costs 0.05 to 0.60 a kWh",
        write: |it| {
            if it < 0.01 {
                format!(
                    "write the price of a kWh: {it} a Wh are {} a kWh",
                    rounded(it * 1000.0)
                )
            } else {
                format!(
                    "write the price of a kWh, not in cents: {it} cents are {}, {it} a MWh are {} a kWh",
                    rounded(it / 100.0),
                    rounded(it / 1000.0)
                )
            }
        },
    },
    Usual {
        key: "prices.receiver.value",
        within: [5.0, 50_000.0],
        why: "receivers with four antennas cost 30 to 10,000",
        write: as_money,
    },
    Usual {
        key: "prices.computer.value",
        within: [20.0, 50_000.0],
        why: "onboard computers cost 50 to 5,000",
        write: as_money,
    },
    Usual {
        key: "prices.lidar.value",
        within: [50.0, 200_000.0],
        why: "LiDARs cost 100 to 80,000",
        write: as_money,
    },
    Usual {
        key: "prices.roadside_unit.value",
        within: [100.0, 500_000.0],
        why: "roadside units cost 1,000 to 50,000",
        write: as_money,
    },
    Usual {
        key: "prices.radio_head.value",
        within: [100.0, 500_000.0],
        why: "radio heads with a mast cost 1,000 to 100,000",
        write: as_money,
    },
    Usual {
        key: "prices.uwb_anchor.value",
        within: [10.0, 20_000.0],
        why: "UWB anchors cost 50 to 2,000 with their installation",
        write: as_money,
    },
    Usual {
        key: "prices.uwb_tag.value",
        within: [2.0, 10_000.0],
        why: "UWB tags cost 10 to 500",
        write: as_money,
    },
];

/// Usual figures of `[prices]` that are not money.
const FACTORS: &[Usual] = &[
    Usual {
        key: "prices.grid_g_per_kwh.value",
        within: [5.0, 1500.0],
        why: "electricity emits 10 to 1,000 gCO2e a kWh",
        write: |it| {
            if it < 5.0 {
                format!("write grams a kWh: {it} kg are {}", rounded(it * 1000.0))
            } else {
                format!(
                    "write grams a kWh: {it} g a MWh are {}",
                    rounded(it / 1000.0)
                )
            }
        },
    },
    Usual {
        key: "prices.uwb_anchor_spacing_m.value",
        within: [2.0, 200.0],
        why: "UWB anchors stand 5 to 50 m apart",
        write: as_millimetres,
    },
];

fn as_money(value: f64) -> String {
    format!(
        "write whole units of the currency: {value} thousand are {}, {value} cents are {}",
        rounded(value * 1000.0),
        rounded(value / 100.0)
    )
}
