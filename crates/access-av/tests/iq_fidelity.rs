//! `fidelity = "iq"` agrees with `fidelity = "snapshots"`, and its receiver keeps the cells.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "this is a test")]

use std::f64::consts::TAU;

use access_av::geometry::{Point, wrap_angle};
use access_av::onboard::Custom;
use access_av::platform::Platform;
use access_av::scenario::Scenario;
use access_av::simulate::{RunRecord, Simulation};
use toml::Value;

/// The paper's drive, 120 m of it, with known pilots, an angle at every SSB.
fn scenario(fidelity: &str, k_db: f64, more: &[(&'static str, Value)]) -> Scenario {
    let segments: Value =
        toml::from_str::<toml::Table>("s = [{ length_m = 120.0, turn_rad = 0.1 }]").unwrap()["s"]
            .clone();
    let mut overrides = vec![
        ("fidelity", Value::from(fidelity)),
        ("receiver.pilots", Value::from("ssb")),
        ("estimator.method", Value::from("maximum-likelihood")),
        ("wake_up.policy", Value::from("fixed")),
        ("wake_up.interval_ms", Value::from(1.0)),
        ("channel.rician_k_db", Value::from(k_db)),
        ("channel.shadowing_std_db", Value::from(0.0)),
        ("track.segments", segments),
    ];
    overrides.extend(more.iter().cloned());
    Scenario::load("paper")
        .unwrap()
        .with_overrides(overrides)
        .unwrap()
}

fn drive(scenario: &Scenario, run: u64) -> RunRecord {
    let platform = Platform::load("jetson-agx-xavier").unwrap();
    let simulation = Simulation::new(scenario.clone(), platform).unwrap();
    simulation.run(3, run, Custom::default()).unwrap()
}

/// Errors of the electrical angle over their standard deviations, one per SSB.
fn errors(scenario: &Scenario, record: &RunRecord) -> Vec<f64> {
    let head = Point::from(scenario.radio_heads[0].position_m);
    let mut errors = Vec::new();
    for execution in &record.executions {
        let measured = execution.measured.unwrap();
        let step = (measured.time_s / scenario.ssb.period_s() + 1e-6).floor() as usize;
        let truth = record.steps[step].truth;
        let angle_rad = truth.point().bearing_rad(head) - truth.heading_rad;
        let phase_rad = TAU * scenario.array.spacing_wavelengths * angle_rad.cos();
        errors.push(wrap_angle(measured.phase_rad - phase_rad) / measured.phase_sigma_rad);
    }
    errors
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64
}

#[test]
fn noise_makes_the_same_angle_errors_in_samples_and_in_snapshots() {
    // Noise only: every SSB is independent.
    let by = |fidelity| {
        let scenario = scenario(fidelity, 60.0, &[]);
        let record = drive(&scenario, 1);
        assert_eq!(record.executions.len(), record.steps.len(), "{fidelity}");
        errors(&scenario, &record)
    };
    let (snapshots, iq) = (by("snapshots"), by("iq"));
    let ratio = mean_square(&iq) / mean_square(&snapshots);
    // The variance of n Gaussian errors has a relative deviation of √(2/n); four of the ratio's.
    let bound = 4.0 * (4.0 / iq.len() as f64).sqrt();
    println!("{} SSBs, variance ratio {ratio:.3} ± {bound:.3}", iq.len());
    assert!((ratio - 1.0).abs() < bound, "{ratio}");
    // And each knows its own deviation.
    for squares in [mean_square(&snapshots), mean_square(&iq)] {
        assert!((squares - 1.0).abs() < 0.05 + bound, "{squares}");
    }
}

#[test]
fn scatter_makes_the_same_angle_errors_in_samples_and_in_snapshots() {
    // Scatter of 10 dB, the same in both by its random streams: SSB by SSB the errors are alike.
    let strong = [("radio_heads[0].tx_power_dbm", Value::from(10.0))];
    let of = |fidelity| {
        let scenario = scenario(fidelity, 10.0, &strong);
        let record = drive(&scenario, 2);
        let sigma: Vec<f64> = record
            .executions
            .iter()
            .map(|it| it.measured.unwrap().phase_sigma_rad)
            .collect();
        let errors = errors(&scenario, &record);
        errors
            .iter()
            .zip(sigma)
            .map(|(error, sigma)| error * sigma)
            .collect::<Vec<f64>>()
    };
    let (snapshots, iq) = (of("snapshots"), of("iq"));
    let difference: Vec<f64> = snapshots
        .iter()
        .zip(&iq)
        .map(|(a, b)| wrap_angle(a - b))
        .collect();
    let ratio = mean_square(&iq) / mean_square(&snapshots);
    println!(
        "variance ratio {ratio:.3}, difference {:.4}",
        mean_square(&difference).sqrt()
    );
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
    // An SSB is not an instant: the vehicle moves on by a hundredth of a wavelength during it.
    assert!(mean_square(&difference) < 0.02 * mean_square(&snapshots));
}

#[test]
fn several_cells_blind_snapshots_and_bad_hardware_are_survived() {
    let second = toml::from_str::<toml::Table>(
        "[[radio_heads]]\nposition_m = [205.0, 100.0]\npci = 1\ntx_power_dbm = 0.0\n\
         [[radio_heads]]\nposition_m = [40.0, -60.0]\npci = 400\nssb_index = 3\ntx_power_dbm = 0.0\n",
    )
    .unwrap()["radio_heads"]
        .clone();
    let more = [
        ("radio_heads", second),
        ("receiver.pilots", Value::from("blind")),
        ("estimator.method", Value::from("root-music")),
        ("ssb.subcarrier_spacing_khz", Value::from(30.0)),
        ("iq.oscillator_ppm", Value::from(1.0)),
        ("iq.adc_bits", Value::from(4)),
        ("iq.adc_headroom_db", Value::from(6.0)),
    ];
    let scenario = scenario("iq", 30.0, &more);
    let record = drive(&scenario, 4);
    for pci in [1, 400] {
        let heard = record
            .executions
            .iter()
            .filter(|it| it.ssb.pci == pci)
            .count();
        assert!(
            heard * 100 > record.steps.len() * 99,
            "{pci}: {heard} of {}",
            record.steps.len()
        );
    }
}

#[test]
fn samples_repeat_to_the_last_bit_and_differ_by_run() {
    let scenario = scenario("iq", 20.0, &[]);
    let (a, b, c) = (
        drive(&scenario, 1),
        drive(&scenario, 1),
        drive(&scenario, 2),
    );
    assert_eq!(a, b);
    assert_ne!(a.executions, c.executions);
}

#[test]
fn what_cannot_be_sent_as_samples_is_refused() {
    let scenario = Scenario::load("paper").unwrap();
    for (key, value) in [
        ("ssb.subcarrier_spacing_khz", Value::from(120.0)),
        ("radio_heads[0].ssb_index", Value::from(8)),
        ("iq.adc_bits", Value::from(0)),
        ("iq.oscillator_ppm", Value::from(3.0)),
    ] {
        let overrides = [("fidelity", Value::from("iq")), (key, value)];
        let error = scenario.with_overrides(overrides).unwrap_err();
        assert!(error.to_string().contains(key), "{error}");
    }
}
