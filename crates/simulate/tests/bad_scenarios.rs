//! Every kind of unusable scenario: which error, which key, and what it says is allowed.
#![allow(clippy::unwrap_used)] // helpers of tests

use access_av::platform::Platform;
use access_av::scenario::{Scenario, ScenarioError};
use access_av::simulate::Simulation;

/// The paper's scenario with one line of it replaced.
fn with_line(line: &str, replacement: &str) -> Result<Scenario, ScenarioError> {
    let text = Scenario::load("paper").unwrap().to_toml();
    assert!(
        text.contains(line),
        "`{line}` is not in the resolved scenario"
    );
    Scenario::from_toml(&text.replacen(line, replacement, 1), "plant.toml")
}

/// Asserts that the error names the file, the key and what is allowed.
fn assert_says(outcome: Result<Scenario, ScenarioError>, key: &str, allowed: &str) {
    let message = outcome.unwrap_err().to_string();
    assert!(message.starts_with("plant.toml: "), "{message}");
    assert!(message.contains(&format!("`{key}`")), "{message}");
    assert!(message.contains(allowed), "{message}");
}

#[test]
fn misspelt_keys_get_the_nearest_known_one() {
    let nearest = "did you mean `rician_k_db`?";
    assert_says(
        with_line("rician_k_db =", "rician_kdb ="),
        "channel.rician_kdb",
        nearest,
    );
    let nearest = "did you mean `t_max_ms`?";
    assert_says(
        with_line("t_max_ms =", "tmax_ms ="),
        "wake_up.tmax_ms",
        nearest,
    );
    let nearest = "did you mean `channel`?";
    assert_says(with_line("[channel]", "[chanel]"), "chanel", nearest);
}

#[test]
fn wrong_units_are_unknown_keys() {
    let outcome = with_line("period_ms = 20.0", "period_s = 0.02");
    assert_says(outcome, "ssb.period_s", "did you mean `period_ms`?");
    let outcome = with_line("top_speed_kmh = 15.0", "top_speed_mps = 4.2");
    assert_says(
        outcome,
        "motion.top_speed_mps",
        "did you mean `top_speed_kmh`?",
    );
}

#[test]
fn wrong_types_say_what_is_expected() {
    let outcome = with_line("carrier_mhz = 3500.0", "carrier_mhz = \"3.5 GHz\"");
    assert_says(outcome, "ssb.carrier_mhz", "expected f64");
    let outcome = with_line("deferral = true", "deferral = 1");
    assert_says(outcome, "wake_up.deferral", "expected a boolean");
    let outcome = with_line("method = \"music\"", "method = \"musik\"");
    assert_says(outcome, "estimator.method", "did you mean `music`?");
    let outcome = with_line("policy = \"pid\"", "policy = \"pdi\"");
    assert_says(outcome, "wake_up.policy", "did you mean `pid`?");
    let outcome = with_line("offset_db = 3.0", "offset = 3.1");
    assert_says(
        outcome,
        "wake_up.snr_set_point.offset",
        "did you mean `offset_db`?",
    );
}

#[test]
fn numbers_must_be_finite_and_in_range() {
    let finite = "finite";
    assert_says(
        with_line("length_m = 300.0", "length_m = nan"),
        "track.segments[0].length_m",
        finite,
    );
    assert_says(
        with_line("width_m = 5.0", "width_m = inf"),
        "track.width_m",
        finite,
    );
    let positive = "must be positive";
    assert_says(
        with_line("length_m = 300.0", "length_m = -3"),
        "track.segments[0].length_m",
        positive,
    );
    for (line, bad, key) in [
        ("width_m = 5.0", "width_m = -5.0", "track.width_m"),
        (
            "acceleration_mps2 = 0.5",
            "acceleration_mps2 = 0",
            "motion.acceleration_mps2",
        ),
        (
            "top_speed_kmh = 15.0",
            "top_speed_kmh = -1",
            "motion.top_speed_kmh",
        ),
        ("period_ms = 20.0", "period_ms = 21", "ssb.period_ms"),
        ("elements = 4", "elements = 3", "array.elements"),
        (
            "mounting_error_std_rad = 0.0",
            "mounting_error_std_rad = -0.01",
            "array.mounting_error_std_rad",
        ),
        (
            "mounting_drift_rad_per_sqrt_m = 0.0",
            "mounting_drift_rad_per_sqrt_m = -1e-4",
            "array.mounting_drift_rad_per_sqrt_m",
        ),
        (
            "phase_error_std_rad = 0.0",
            "phase_error_std_rad = -0.1",
            "array.phase_error_std_rad",
        ),
        (
            "phase_drift_rad_per_sqrt_m = 0.0",
            "phase_drift_rad_per_sqrt_m = -1e-3",
            "array.phase_drift_rad_per_sqrt_m",
        ),
        ("snapshots = 20", "snapshots = 65", "array.snapshots"),
        ("pci = 1", "pci = 1008", "radio_heads[0].pci"),
        (
            "temperature_k = 290.0",
            "temperature_k = 0",
            "receiver.temperature_k",
        ),
        (
            "shadowing_std_db = 3.0",
            "shadowing_std_db = -3",
            "channel.shadowing_std_db",
        ),
        ("rays = 8", "rays = 0", "channel.rays"),
        ("rate_hz = 50.0", "rate_hz = 0", "odometer.rate_hz"),
        (
            "position_std_m = 0.0",
            "position_std_m = -1",
            "start.position_std_m",
        ),
        (
            "snr_scale_db = 10.0",
            "snr_scale_db = 0",
            "wake_up.snr_scale_db",
        ),
    ] {
        assert_says(with_line(line, bad), key, "must");
    }
}

#[test]
fn a_guess_of_the_road_is_straight() {
    assert_says(
        with_line("surveyed = true", "surveyed = false"),
        "track.segments[0].turn_rad",
        "a guess must be straight",
    );
    assert_says(
        with_line("surveyed = true", "surveyed = \"no\""),
        "track.segments[0].surveyed",
        "expected a boolean",
    );
    assert_says(
        with_line("surveyed = true", "surveyd = false"),
        "track.segments[0].surveyd",
        "did you mean `surveyed`?",
    );
    assert!(
        Scenario::from_toml(
            "name = 'plant'\nradio_heads = [{ position_m = [50, 20] }]\n\
         track.segments = [{ length_m = 60 }, { length_m = 40, surveyed = false }]",
            "plant.toml"
        )
        .is_ok()
    );
}

#[test]
fn contradictions_name_both_sides() {
    let outcome = with_line("t_max_ms = 240.0", "base_ms = 250.0\nt_max_ms = 240.0");
    assert_says(outcome, "wake_up.t_max_ms", "wake_up.base_ms, 250");
    let outcome = with_line("pilots = \"blind\"", "pilots = \"pss+sss\"");
    assert_says(outcome, "estimator.method", "receiver.pilots");
    let outcome = with_line("stops = []", "stops = [{ at_m = 301, dwell_s = 1 }]");
    assert_says(outcome, "motion.stops[0].at_m", "300.0 m");
    let twice = "name = 'plant'\nradio_heads = [{ position_m = [9, 9] }]\n[track]\n\
        polyline_m = [[0, 0], [9, 0]]\nsegments = [{ length_m = 1 }]";
    assert_says(
        Scenario::from_toml(twice, "plant.toml"),
        "track",
        "only one of",
    );
}

#[test]
fn base_time_of_the_platform_counts_too() {
    let scenario = with_line("t_max_ms = 240.0", "t_max_ms = 60.0").unwrap();
    let platform = Platform::load("jetson-agx-xavier").unwrap();
    let message = Simulation::new(scenario, platform).unwrap_err().to_string();
    assert!(
        message.contains("wake_up.t_max_ms") && message.contains("80 ms"),
        "{message}"
    );
}

const ROAD: &str = "name = 'plant'\ntrack.segments = [{ length_m = 100 }]\n";

fn with_heads(heads: &str) -> Result<Scenario, ScenarioError> {
    Scenario::from_toml(&format!("{ROAD}radio_heads = [{heads}]"), "plant.toml")
}

#[test]
fn radio_heads_have_their_own_place_and_name() {
    let apart = "{ position_m = [50, 20] }, { position_m = [50, -20], pci = 1 }";
    assert!(with_heads(apart).is_ok());
    assert_says(with_heads(""), "radio_heads", "at least one");
    let on_track = "{ position_m = [50, 2.4] }";
    assert_says(
        with_heads(on_track),
        "radio_heads[0].position_m",
        "on the track, 50.0 m along it",
    );
    let together = "{ position_m = [50, 20] }, { position_m = [50, 20], pci = 1 }";
    assert_says(
        with_heads(together),
        "radio_heads[1].position_m",
        "same place",
    );
    let namesakes = "{ position_m = [50, 20] }, { position_m = [50, -20] }";
    assert_says(
        with_heads(namesakes),
        "radio_heads[1].pci",
        "same pci and ssb_index",
    );
}

#[test]
fn missing_parts_are_named() {
    let no_road = "name = 'plant'\ntrack.width_m = 4.0\nradio_heads = [{ position_m = [9, 9] }]";
    assert_says(
        Scenario::from_toml(no_road, "plant.toml"),
        "track",
        "`segments`, `polyline_m`",
    );
    assert_says(
        Scenario::from_toml("name = 'plant'", "plant.toml"),
        "track",
        "missing",
    );
    assert_says(
        with_heads("{ pci = 3 }"),
        "radio_heads[0].position_m",
        "missing",
    );
    let no_file =
        "name = 'plant'\ntrack.file = 'nowhere.csv'\nradio_heads = [{ position_m = [9, 9] }]";
    let error = Scenario::from_toml(no_file, "plant.toml").unwrap_err();
    assert!(
        matches!(&error, ScenarioError::Read { file, .. } if file == "nowhere.csv"),
        "{error}"
    );
}

#[test]
fn broken_toml_says_where() {
    let message = Scenario::from_toml("name = \n", "plant.toml")
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("plant.toml") && message.contains("line 1"),
        "{message}"
    );
}

#[test]
fn unknown_names_list_the_shipped_ones() {
    let message = Scenario::load("papper").unwrap_err().to_string();
    assert!(message.contains("did you mean `paper`?"), "{message}");
}

#[test]
fn resolved_scenarios_read_back_the_same() {
    for name in Scenario::names() {
        let scenario = Scenario::load(name).unwrap();
        assert_eq!(
            Scenario::from_toml(&scenario.to_toml(), name).unwrap(),
            scenario
        );
    }
}

#[test]
fn overriding_a_tag_drops_the_old_variants_keys() {
    let paper = Scenario::load("paper").unwrap();
    let fixed = paper
        .with_overrides([
            ("wake_up.interval_ms", 20.into()),
            ("wake_up.policy", "fixed".into()),
        ])
        .unwrap();
    assert!(!fixed.to_toml().contains("t_max_ms"));
    let message = paper
        .with_overrides([("radio_heads[4].pci", 1.into())])
        .unwrap_err()
        .to_string();
    assert!(message.contains("radio_heads[4].pci"), "{message}");
}
