//! Invalid scenarios: the error names the key and the allowed values.

use onboard::settings::{SettingsError, Shipped, TomlFile};
use recording::{Files, load};
use simulate::Simulation;
use simulate::scenario::Scenario;

use crate::common::shipped;

/// Returns the paper's scenario with one line replaced.
fn with_line(line: &str, replacement: &str) -> Result<Scenario, SettingsError> {
    let text = shipped("paper").to_toml();
    assert!(
        text.contains(line),
        "`{line}` is not in the resolved scenario"
    );
    read(&text.replacen(line, replacement, 1))
}

fn read(text: &str) -> Result<Scenario, SettingsError> {
    Scenario::from_toml(text, "plant.toml", &Files)
}

/// Asserts that the error names the file, the key and what is allowed.
fn assert_message(outcome: Result<Scenario, SettingsError>, key: &str, allowed: &str) {
    let message = outcome.unwrap_err().to_string();
    assert!(message.starts_with("plant.toml: "), "{message}");
    assert!(message.contains(&format!("`{key}`")), "{message}");
    assert!(message.contains(allowed), "{message}");
}

#[test]
fn misspelt_keys_get_the_nearest_known_key() {
    let nearest = "did you mean `rician_k_db`?";
    assert_message(
        with_line("rician_k_db =", "rician_kdb ="),
        "site.rician_kdb",
        nearest,
    );
    let nearest = "did you mean `t_max_ms`?";
    assert_message(
        with_line("target_error_m = 1.0", "tmax_ms = 240.0"),
        "vehicle.wake_up.trigger.tmax_ms",
        nearest,
    );
    let nearest = "did you mean `channel`?";
    assert_message(with_line("[channel]", "[chanel]"), "chanel", nearest);
}

#[test]
fn wrong_units_are_unknown_keys() {
    let outcome = with_line("period_ms = 20.0", "period_s = 0.02");
    assert_message(outcome, "site.ssb.period_s", "did you mean `period_ms`?");
    let outcome = with_line("top_speed_kmh = 15.0", "top_speed_mps = 4.2");
    assert_message(
        outcome,
        "vehicle.top_speed_mps",
        "did you mean `top_speed_kmh`?",
    );
}

#[test]
fn wrong_types_are_reported_with_the_expected_type() {
    let outcome = with_line("carrier_mhz = 3500.0", "carrier_mhz = \"3.5 GHz\"");
    assert_message(outcome, "site.carrier_mhz", "expected f64");
    let outcome = with_line("either_direction = false", "either_direction = 0");
    assert_message(
        outcome,
        "vehicle.start.either_direction",
        "expected a boolean",
    );
    let outcome = with_line("method = \"music\"", "method = \"musik\"");
    assert_message(outcome, "vehicle.estimator.method", "did you mean `music`?");
    let outcome = with_line("policy = \"pid\"", "policy = \"pdi\"");
    assert_message(outcome, "vehicle.wake_up.trigger", "did you mean `pid`?");
    let outcome = with_line("offset_db = 3.0", "offset = 3.1");
    assert_message(
        outcome,
        "vehicle.wake_up.snr_set_point.offset",
        "did you mean `offset_db`?",
    );
}

#[test]
fn numbers_must_be_finite_and_in_range() {
    let finite = "finite";
    assert_message(
        with_line("length_m = 300.0", "length_m = nan"),
        "site.road.segments[0].length_m",
        finite,
    );
    assert_message(
        with_line("width_m = 5.0", "width_m = inf"),
        "site.road.width_m",
        finite,
    );
    assert_message(
        with_line("length_m = 300.0", "length_m = -3"),
        "site.road.segments[0].length_m",
        "is -3; it must be between 0.000001 and 100000",
    );
    for (line, bad, key) in [
        ("width_m = 5.0", "width_m = -5.0", "site.road.width_m"),
        (
            "acceleration_mps2 = 0.5",
            "acceleration_mps2 = 0",
            "vehicle.acceleration_mps2",
        ),
        (
            "top_speed_kmh = 15.0",
            "top_speed_kmh = -1",
            "vehicle.top_speed_kmh",
        ),
        ("period_ms = 20.0", "period_ms = 21", "site.ssb.period_ms"),
        ("elements = 4", "elements = 1", "vehicle.array.elements"),
        ("elements = 4", "elements = 17", "vehicle.array.elements"),
        (
            "mounting_rad = 0.0",
            "mounting_rad = 0.0\nmounting_std_rad = -0.01",
            "vehicle.array.mounting_std_rad",
        ),
        (
            "mounting_drift_rad_per_sqrt_m = 0.0",
            "mounting_drift_rad_per_sqrt_m = -1e-4",
            "vehicle.array.mounting_drift_rad_per_sqrt_m",
        ),
        (
            "phase_rad = 0.0",
            "phase_rad = 0.0\nphase_std_rad = -0.1",
            "vehicle.array.phase_std_rad",
        ),
        (
            "phase_drift_rad_per_sqrt_m = 0.0",
            "phase_drift_rad_per_sqrt_m = -1e-3",
            "vehicle.array.phase_drift_rad_per_sqrt_m",
        ),
        (
            "gain_drift_db_per_sqrt_m = 0.0",
            "gain_drift_db_per_sqrt_m = -0.1",
            "vehicle.array.gain_drift_db_per_sqrt_m",
        ),
        (
            "snapshots = 20",
            "snapshots = 65",
            "vehicle.receiver.snapshots",
        ),
        ("pci = 1", "pci = 1008", "site.radio_heads[0].pci"),
        (
            "shadowing_std_db = 3.0",
            "shadowing_std_db = -3",
            "channel.shadowing_std_db",
        ),
        ("rays = 8", "rays = 0", "channel.rays"),
        ("rate_hz = 50.0", "rate_hz = 0", "vehicle.odometer.rate_hz"),
        (
            "heading_std_rad = 0.0",
            "heading_std_rad = -1",
            "vehicle.start.heading_std_rad",
        ),
        (
            "snr_scale_db = 10.0",
            "snr_scale_db = 0",
            "vehicle.wake_up.trigger.snr_scale_db",
        ),
    ] {
        assert_message(with_line(line, bad), key, "must");
    }
    let position = [("vehicle.start.position_std_m", (-1).into())];
    let outcome = shipped("paper").with_overrides(position, &Shipped);
    let message = outcome.unwrap_err().to_string();
    let expected = "`vehicle.start.position_std_m` is -1; it must be between 0 and 10000";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn a_bend_in_an_unsurveyed_segment_is_rejected() {
    assert_message(
        with_line("surveyed = true", "surveyed = false"),
        "site.road.segments[0].turn_rad",
        "an unsurveyed segment must be straight",
    );
    assert_message(
        with_line("surveyed = true", "surveyed = \"no\""),
        "site.road.segments[0].surveyed",
        "expected a boolean",
    );
    assert_message(
        with_line("surveyed = true", "surveyd = false"),
        "site.road.segments[0].surveyd",
        "did you mean `surveyed`?",
    );
    let guess = "site.road.segments = [{ length_m = 60 }, { length_m = 40, surveyed = false }]";
    assert!(read(&format!("{NAMES}{HEAD}{guess}")).is_ok());
}

#[test]
fn contradictions_are_reported_with_both_sides() {
    let bound = "target_error_m = 1.0";
    let outcome = with_line(bound, "base_ms = 250.0\nt_max_ms = 240.0");
    assert_message(outcome, "vehicle.wake_up.trigger.t_max_ms", "base_ms, 250");
    let outcome = with_line(bound, "base_ms = 250.0\ntarget_error_m = 1.0");
    let key = "vehicle.wake_up.trigger.target_error_m";
    assert_message(outcome, key, "t_max of 240.0 ms");
    let outcome = with_line("pilots = \"blind\"", "pilots = \"pss+sss\"");
    assert_message(outcome, "vehicle.estimator.method", "receiver.pilots");
    let outcome = with_line("stops = []", "stops = [{ at_m = 301, dwell_s = 1 }]");
    assert_message(outcome, "motion.stops[0].at_m", "300.0 m");
    let twice = "[site.road]\npolyline_m = [[0, 0], [9, 0]]\nsegments = [{ length_m = 1 }]";
    assert_message(
        read(&format!("{NAMES}{HEAD}{twice}")),
        "site.road",
        "only one of",
    );
}

#[test]
fn base_time_of_the_platform_limits_the_interval() {
    let scenario = with_line("target_error_m = 1.0", "t_max_ms = 60.0").unwrap();
    let simulation = Simulation::on_its_platform(&scenario).map(drop);
    let message = simulation.unwrap_err().to_string();
    assert!(
        message.contains("t_max_ms") && message.contains("80 ms"),
        "{message}"
    );
}

const NAMES: &str = "name = 'plant'\nvehicle = 'carrier'\nsite.name = 'plant'\n";
const HEAD: &str = "site.radio_heads = [{ position_m = [50, 20, 0] }]\n";
const ROAD: &str = "site.road.segments = [{ length_m = 100 }]\n";

fn with_heads(heads: &str) -> Result<Scenario, SettingsError> {
    read(&format!("{NAMES}{ROAD}site.radio_heads = [{heads}]"))
}

#[test]
fn radio_heads_need_distinct_positions_and_names() {
    let apart = "{ position_m = [50, 20, 0] }, { position_m = [50, -20, 0], pci = 1 }";
    assert!(with_heads(apart).is_ok());
    assert_message(with_heads(""), "site.radio_heads", "1 to 1000");
    let on_road = "{ position_m = [50, 2.4, 0] }";
    assert_message(
        with_heads(on_road),
        "site.radio_heads[0].position_m",
        "on the road, 50.0 m along it",
    );
    let together = "{ position_m = [50, 20, 0] }, { position_m = [50, 20, 0], pci = 1 }";
    assert_message(
        with_heads(together),
        "site.radio_heads[1].position_m",
        "same position",
    );
    let namesakes = "{ position_m = [50, 20, 0] }, { position_m = [50, -20, 0] }";
    assert_message(
        with_heads(namesakes),
        "site.radio_heads[1].pci",
        "same pci and ssb_index",
    );
    let in_the_plane = "{ position_m = [50, 20] }";
    assert_message(
        with_heads(in_the_plane),
        "site.radio_heads[0].position_m",
        "an array of length 3",
    );
}

#[test]
fn missing_parts_are_reported() {
    assert_message(
        read(&format!("{NAMES}{HEAD}site.road.width_m = 4.0")),
        "site.road",
        "`segments`, `polyline_m`",
    );
    assert_message(read("name = 'plant'"), "site", "missing");
    assert_message(
        with_heads("{ pci = 3 }"),
        "site.radio_heads[0].position_m",
        "missing",
    );
    let no_file = read(&format!("{NAMES}{HEAD}site.road.file = 'nowhere.csv'"));
    let error = no_file.unwrap_err();
    assert!(
        matches!(&error, SettingsError::Read { file, .. } if file == "nowhere.csv"),
        "{error}"
    );
}

#[test]
fn a_site_without_a_road_requires_a_path() {
    let roaming = format!("{NAMES}{HEAD}");
    assert_message(read(&roaming), "motion.path", "add `motion.path`");
    let path = "motion.path.segments = [{ length_m = 100 }]";
    assert!(read(&format!("{roaming}{path}")).is_ok());
}

#[test]
fn a_vehicle_without_radio_heads_is_rejected() {
    let heads = "{ position_m = [50, 20, 0], pci = 7 }";
    let receives = |list: &str| {
        let names = NAMES.replace("vehicle = 'carrier'\n", "");
        read(&format!(
            "{names}{ROAD}site.radio_heads = [{heads}]\n\
             vehicle = {{ extends = 'carrier', receiver.pci_allow_list = [{list}] }}"
        ))
    };
    assert!(receives("7").is_ok());
    let key = "vehicle.receiver.pci_allow_list";
    assert_message(receives(""), key, "remove it to receive all radio heads");
    assert_message(receives("7, 8"), &format!("{key}[1]"), "must have this pci");
}

#[test]
fn invalid_toml_is_reported_with_its_position() {
    let message = read("name = \n").unwrap_err().to_string();
    assert!(
        message.contains("plant.toml") && message.contains("line 1"),
        "{message}"
    );
}

#[test]
fn unknown_names_are_reported_with_the_shipped_ones() {
    let message = load::<Scenario>("papper").unwrap_err().to_string();
    assert!(message.contains("did you mean `paper`?"), "{message}");
    let message = read("name = 'plant'\nsite = 'yrad'\nvehicle = 'carrier'")
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("site `yrad`") && message.contains("did you mean `yard`?"),
        "{message}"
    );
}

#[test]
fn resolved_scenarios_round_trip_through_toml() {
    for name in Scenario::names() {
        let scenario = shipped(name);
        let again = Scenario::from_toml(&scenario.to_toml(), name, &Shipped);
        assert_eq!(again.unwrap(), scenario);
    }
}

#[test]
fn overriding_a_tag_removes_the_keys_of_the_old_variant() {
    let paper = shipped("paper");
    let changes = [
        ("vehicle.wake_up.interval_ms", 20.into()),
        ("vehicle.wake_up.policy", "fixed".into()),
    ];
    let fixed = paper.with_overrides(changes, &Shipped).unwrap();
    assert!(!fixed.to_toml().contains("t_max_ms"));
    let message = paper
        .with_overrides([("site.radio_heads[4].pci", 1.into())], &Shipped)
        .unwrap_err()
        .to_string();
    assert!(message.contains("site.radio_heads[4].pci"), "{message}");
}
