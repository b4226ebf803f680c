//! Availability, errors and integrity of the monitored localizer by scenario, channel and fault:
//! `cargo run --release -p simulate --example availability_table -- runs seed[,seed] scenario[,…] channel[,…] fault[,…]
//! [key=value …]`.
//!
//! Channels are `nominal`, `K=5` or a model of TR 38.901; faults are those of `access-av
//! design integrity`. `beyond` is the fraction of the `ok` steps whose error exceeds the protection level.
//! `silent` is the longest time in state `ok` with an error that exceeds the alert limit.
//!
//! `clocks=W` adds delays and range rates of the SSBs: the radio heads share an oscillator with a random walk of W ns/√s.
//! Faults of delays start after 20 s: `clock` (100 ns at the vehicle) and `path` (20 m longer at one radio head).
#![allow(clippy::print_stdout, reason = "prints a table")]

use std::error::Error;

use onboard::settings::{Shipped, Site, TomlFile, Vehicle};
use simulate::scenario::Scenario;
use simulate::{Campaign, CampaignOptions, IntegritySummary, Simulation};
use toml::{Table, Value};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Start of a fault that lasts until the end of the run (s).
const FROM_S: f64 = 20.0;

/// Array mounting of the fault `array` (rad): 1°.
const MOUNTING_RAD: f64 = 0.0175;

/// Step of the vehicle's clock in the fault `clock` (ns), and additional delay of a blocked first path (ns): 20 m.
const CLOCK_STEP_NS: f64 = 100.0;
const LONGER_PATH_NS: f64 = 66.7;

/// Array phase of the fault `phase` (rad per element).
const PHASE_RAD: f64 = 0.05;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let list = |number: usize, default: &str| -> Vec<String> {
        let given = arguments.get(number).map_or(default, String::as_str);
        given.split(',').map(str::to_owned).collect()
    };
    let runs: usize = list(0, "3").concat().parse()?;
    let seeds = list(1, "91")
        .iter()
        .map(|it| it.parse())
        .collect::<std::result::Result<Vec<u64>, _>>()?;
    let faults = list(4, "none");
    let keys = arguments.iter().skip(5).map(|it| {
        let (key, value) = it.split_once('=').ok_or("key=value expected")?;
        Ok((key.to_owned(), value_of(value)?))
    });
    let keys = keys.collect::<Result<Vec<_>>>()?;
    println!("{runs} runs, seeds {seeds:?}, {keys:?}");
    println!(
        "scenario          channel  fault      ok %  unavail %  beyond   runs  99 % (m)  95 % (m)  90 % (m)  worst (m)  silent (s)  level/error  RMS (m)"
    );
    for name in list(2, "yard") {
        for channel in list(3, "nominal") {
            for fault in &faults {
                let scenario = with_fault(&name, &channel, fault, &keys)?;
                let mut driven = Vec::new();
                for &seed in &seeds {
                    let options = CampaignOptions {
                        seed,
                        runs,
                        threads: Some(1),
                        ..CampaignOptions::default()
                    };
                    driven.push(Simulation::on_its_platform(&scenario)?.campaign(&options)?);
                }
                print(&name, &channel, fault, &driven);
            }
        }
    }
    Ok(())
}

fn value_of(text: &str) -> Result<Value> {
    let mut table: Table = toml::from_str(&format!("value = {text}"))?;
    Ok(table.remove("value").ok_or("no value")?)
}

fn with_fault(
    name: &str,
    channel: &str,
    fault: &str,
    keys: &[(String, Value)],
) -> Result<Scenario> {
    let scenario = Scenario::from_library(name, &Shipped)?;
    let (site, vehicle): (&Site, &Vehicle) = (&scenario.site, &scenario.vehicle);
    let mut over = Table::new();
    if let Some(k_db) = channel.strip_prefix("K=") {
        over.insert("truth.site.rician_k_db".into(), k_db.parse::<f64>()?.into());
    } else if channel != "nominal" {
        over.insert(
            "channel".into(),
            value_of(&format!("{{ model = \"{channel}\" }}"))?,
        );
    }
    let (mut keys, mut faultless) = (keys.to_vec(), Vec::new());
    if let Some(at) = keys.iter().position(|(key, _)| key == "clocks") {
        faultless = with_clocks(site, &keys.remove(at).1)?;
    }
    let count = site.radio_heads.len();
    let moved = |which: std::ops::Range<usize>, by_m: [f64; 2]| {
        let heads = site.radio_heads.iter().enumerate();
        let moved = heads
            .filter(|(number, _)| which.contains(number))
            .map(|(_, head)| {
                let [x_m, y_m, z_m] = head.position_m;
                let position_m = vec![x_m + by_m[0], y_m + by_m[1], z_m];
                let mut table = Table::new();
                table.insert("position_m".into(), position_m.into());
                (head.name.clone(), table.into())
            });
        Value::Table(moved.collect())
    };
    let whole = |what: String| {
        value_of(&format!(
            "{{ from_s = {FROM_S:?}, until_s = 1e6, what = {{ {what} }} }}"
        ))
    };
    let hidden = |count: usize| -> Result<Value> {
        let hide = |head| {
            whole(format!(
                "kind = \"non-line-of-sight\", bias_rad = 0.15, radio_head = {head}"
            ))
        };
        Ok(Value::Array((0..count).map(hide).collect::<Result<_>>()?))
    };
    let (odometer, array) = (&vehicle.odometer, &vehicle.array);
    let mut set = |key: &str, value: Value| over.insert(key.into(), value);
    match fault {
        "none" => None,
        "array" => set(
            "truth.vehicle.array.mounting_rad",
            (array.mounting_rad + MOUNTING_RAD).into(),
        ),
        "phase" => set(
            "truth.vehicle.array.phase_rad",
            (array.phase_rad + PHASE_RAD).into(),
        ),
        "noise" => set(
            "truth.vehicle.odometer.noise_m_per_sqrt_m",
            (3.0 * odometer.noise_m_per_sqrt_m).into(),
        ),
        "scale" => set(
            "truth.vehicle.odometer.scale",
            (odometer.scale + 3.0 * odometer.scale_std).into(),
        ),
        "slip" => set(
            "faults",
            Value::Array(vec![whole(
                "kind = \"odometer-slip\", scale = 1.02".into(),
            )?]),
        ),
        "clock" => set(
            "faults",
            Value::Array(vec![whole(format!(
                "kind = \"late-arrival\", by_ns = {CLOCK_STEP_NS:?}"
            ))?]),
        ),
        "path" => set(
            "faults",
            Value::Array(vec![whole(format!(
                "kind = \"late-arrival\", radio_head = {}, by_ns = {LONGER_PATH_NS:?}",
                count / 2
            ))?]),
        ),
        "all" => set("truth.site.radio_heads", moved(0..count, [2.0, 0.0])),
        "two" => set("truth.site.radio_heads", moved(0..2, [2.0, 0.0])),
        "one" => set(
            "truth.site.radio_heads",
            moved(2.min(count - 1)..count.min(3), [3.0, 0.0]),
        ),
        "hidden1" => set("faults", hidden(1)?),
        "hidden3" => set("faults", hidden(3.min(count))?),
        other => return Err(format!("no fault {other}").into()),
    };
    let guard = [("vehicle.integrity.enabled".to_owned(), Value::from(true))];
    let over = over.into_iter().chain(guard).chain(faultless).chain(keys);
    let over: Vec<(String, Value)> = over.collect();
    Ok(scenario.with_overrides(
        over.iter()
            .map(|(key, value)| (key.as_str(), value.clone())),
        &Shipped,
    )?)
}

/// Returns the settings of one-way delays and of radio heads on one oscillator with this random walk (ns/√s).
fn with_clocks(site: &Site, wander_ns_per_sqrt_s: &Value) -> Result<Vec<(String, Value)>> {
    let heads = site.radio_heads.iter().map(|head| {
        let mut head = Table::try_from(head)?;
        head.insert("clock_group".into(), 1.into());
        head.insert("clock_offset_std_ns".into(), 50.0.into());
        head.insert(
            "clock_wander_ns_per_sqrt_s".into(),
            wander_ns_per_sqrt_s.clone(),
        );
        head.insert("clock_frequency_std_ppb".into(), 20.0.into());
        Ok(Value::Table(head))
    });
    let heads = heads.collect::<Result<Vec<_>>>()?;
    Ok(vec![
        ("site.radio_heads".into(), Value::Array(heads)),
        ("vehicle.ranging.kind".into(), "one-way".into()),
    ])
}

fn print(name: &str, channel: &str, fault: &str, driven: &[Campaign]) {
    let runs = || driven.iter().flat_map(|it| &it.integrity);
    let total = IntegritySummary::sum(runs());
    let affected = runs().filter(|run| run.beyond > 0).count();
    let mut errors = simulate::ErrorHistogram::default();
    for campaign in driven {
        errors.merge(&campaign.errors);
    }
    let squares = || {
        let runs = driven.iter().flat_map(|it| &it.runs);
        runs.map(|run| run.rms_error_m * run.rms_error_m)
    };
    let mean_square = squares().sum::<f64>() / squares().count() as f64;
    let share = |count: usize| 100.0 * count as f64 / total.epochs.max(1) as f64;
    let p = |q| errors.quantile_m(q).unwrap_or(f64::NAN);
    println!(
        "{name:17} {channel:8} {fault:8} {:6.1} {:10.2}  {:.1e}  {affected:4}  {:8.2}  {:8.2}  {:8.2}  {:9.2}  {:10.1}  {:11.1}  {:7.3}",
        share(total.ok),
        share(total.unavailable),
        total.risk(),
        p(0.99),
        p(0.95),
        p(0.9),
        total.worst_m,
        total.longest_silence_s,
        total.median_ratio(),
        mean_square.sqrt(),
    );
}
