//! Measurement traces reproduce drives bit by bit.

use onboard::settings::{EstimatorMethod, TomlFile};
use recording::Files;
use simulate::scenario::Scenario;
use simulate::{CampaignOptions, MeasurementTraces, Simulation};
use toml::Value;

const RUNS: usize = 3;

fn simulation(name: &str, overrides: &[(&str, Value)]) -> Simulation {
    let scenario = Scenario::from_library(name, &Files).unwrap();
    let overrides = overrides.iter().cloned();
    Simulation::on_its_platform(&scenario.with_overrides(overrides, &Files).unwrap()).unwrap()
}

fn options() -> CampaignOptions<'static> {
    CampaignOptions {
        seed: 5,
        first_run: 2,
        runs: RUNS,
        keep_records: true,
        errors_every: Some(5),
        ..CampaignOptions::default()
    }
}

fn record(simulation: &Simulation, methods: &[EstimatorMethod]) -> MeasurementTraces {
    let traces = MeasurementTraces::record(simulation, methods, &options()).unwrap();
    traces.expect("it is independent of listening")
}

#[test]
fn every_policy_and_method_gives_the_record_of_its_own_drive() {
    let methods = [EstimatorMethod::Music, EstimatorMethod::Esprit];
    let traces = record(&simulation("paper", &[]), &methods);
    let tracker = ("vehicle.localizer.kind", Value::from("tracker"));
    let policy = |name: &str| ("vehicle.wake_up.policy", Value::from(name));
    let esprit = ("vehicle.estimator.method", Value::from("esprit"));
    let bound = ("vehicle.wake_up.target_error_m", Value::from(0.3));
    let asleep = ("vehicle.wake_up.sensing", Value::from("wake-up"));
    for changes in [
        &[][..],
        &[policy("fixed"), esprit],
        &[policy("pid"), asleep],
        &[tracker, policy("uncertainty"), bound],
    ] {
        let simulation = simulation("paper", changes);
        assert!(traces.serve(&simulation), "{changes:?}");
        let own = simulation.campaign(&options()).unwrap();
        assert!(own.runs.iter().all(|run| run.aoa_estimates > 5));
        assert_eq!(traces.campaign(&simulation, &options()).unwrap(), own);
    }
}

#[test]
fn traces_support_several_radio_heads_and_faults() {
    let overrides = [("vehicle.receiver.snr_noise_db", Value::from(0.0))];
    let whole = simulation("nlos-and-faults", &overrides);
    let methods = [EstimatorMethod::MaximumLikelihood];
    // An antenna fault is detected from the receive channels, which a trace does not contain.
    assert!(
        MeasurementTraces::record(&whole, &methods, &options())
            .unwrap()
            .is_none()
    );
    let mut scenario = whole.scenario().clone();
    scenario.faults.retain(|it| !it.what.is_of_channels());
    assert!(scenario.faults.len() >= 2);
    let simulation = Simulation::on_its_platform(&scenario).unwrap();
    let traces = record(&simulation, &[EstimatorMethod::MaximumLikelihood]);
    let own = simulation.campaign(&options()).unwrap();
    assert_eq!(traces.campaign(&simulation, &options()).unwrap(), own);
}

#[test]
fn traces_are_invalid_for_another_environment() {
    let traces = record(&simulation("paper", &[]), &[EstimatorMethod::Music]);
    for (key, value) in [
        ("site.rician_k_db", Value::from(7.0)),
        ("site.radio_heads[0].eirp_dbm", Value::from(0.0)),
        ("channel.scatter", Value::from("rays")),
        ("vehicle.receiver.snapshots", Value::from(10)),
        ("vehicle.odometer.scale", Value::from(1.01)),
        ("truth.vehicle.array.mounting_rad", Value::from(0.1)),
        ("motion.start_at_m", Value::from(10.0)),
        ("vehicle.estimator.method", Value::from("esprit")),
    ] {
        let other = simulation("paper", &[(key, value)]);
        assert!(!traces.serve(&other), "{key}");
    }
    // The nominal transmit power may differ if the true power is equal.
    let nominal = [
        ("site.radio_heads[0].eirp_dbm", Value::from(-10.0)),
        (
            "truth.site.radio_heads.roadside.eirp_dbm",
            Value::from(-17.3),
        ),
    ];
    assert!(traces.serve(&simulation("paper", &nominal)));
}

#[test]
fn receptions_that_depend_on_each_other_have_no_traces() {
    for (key, value) in [
        ("ssb_latency_ms", Value::from(30.0)),
        ("vehicle.receiver.snr_noise_db", Value::from(1.0)),
    ] {
        let simulation = simulation("paper", &[(key, value)]);
        let traces = MeasurementTraces::record(&simulation, &[EstimatorMethod::Music], &options());
        assert!(traces.unwrap().is_none(), "{key}");
    }
}
