//! Plant files: targets, prices and the alert limit.

use onboard::plausible::Warning;
use onboard::settings::{Shipped, TomlFile};
use simulate::scenario::Plant;

const BENDS: &str = include_str!("../../../../plants/bends.toml");

fn refused(change: (&str, &str)) -> String {
    let text = BENDS.replace(change.0, change.1);
    assert_ne!(text, BENDS);
    Plant::from_toml(&text, "mine.toml", &Shipped)
        .unwrap_err()
        .to_string()
}

#[test]
fn shipped_plants_are_valid_and_round_trip_through_toml() {
    for name in Plant::names() {
        let plant = Plant::from_library(name, &Shipped).unwrap();
        let again = Plant::from_toml(&plant.to_toml(), "again", &Shipped).unwrap();
        assert_eq!(again, plant);
    }
}

#[test]
fn the_alert_limit_follows_from_the_target_unless_it_is_set() {
    let limit_m = |text: &str| {
        let plant = Plant::from_toml(text, "mine.toml", &Shipped).unwrap();
        plant.vehicle.integrity_monitor().unwrap().alert_limit_m
    };
    assert!((limit_m(BENDS) - 0.6).abs() < 1e-12);
    let own = "vehicle = { extends = \"tugger\", integrity.alert_limit_m = 1.5 }";
    let text = BENDS.replace("vehicle = \"tugger\"", own);
    assert!((limit_m(&text) - 1.5).abs() < 1e-12);
}

#[test]
fn targets_of_places_lie_on_the_road() {
    let with = |target: &str| {
        let text = BENDS.replace("[motion]", &format!("[[targets]]\n{target}\n[motion]"));
        Plant::from_toml(&text, "mine.toml", &Shipped).map_err(|it| it.to_string())
    };
    let plant = with("name = \"gate\"\nat_m = 2.0\ntarget = \"0.1 m 95 %\"").unwrap();
    assert_eq!(plant.targets[0].ends_m(600.0), [0.0, 7.0]);
    let plant = with("from_m = 100.0\nto_m = 150.0\ntarget = \"0.1 m 95 %\"").unwrap();
    assert_eq!(plant.targets[0].ends_m(600.0), [100.0, 150.0]);
    for (target, key) in [
        ("target = \"0.1 m 95 %\"", "targets[0].at_m"),
        ("at_m = 6000.0\ntarget = \"0.1 m 95 %\"", "targets[0].at_m"),
        ("from_m = 10.0\ntarget = \"0.1 m 95 %\"", "targets[0].to_m"),
        (
            "from_m = 20.0\nto_m = 10.0\ntarget = \"0.1 m 95 %\"",
            "targets[0].to_m",
        ),
        (
            "at_m = 5.0\nto_m = 10.0\ntarget = \"0.1 m 95 %\"",
            "targets[0].at_m",
        ),
    ] {
        let message = with(target).unwrap_err();
        assert!(message.contains(key), "{target}: {message}");
    }
}

#[test]
fn cells_are_identified_and_published_prices_converted() {
    let message = refused(("pci = 22\n", ""));
    assert!(message.contains("radio_heads[1].pci"), "{message}");
    let message = refused(("eirp_dbm = 10.0\n", ""));
    assert!(message.contains("radio_heads[0].eirp_dbm"), "{message}");
    let message = refused(("[fleet]", "[prices]\ncurrency = \"SEK\"\n[fleet]"));
    assert!(message.contains("prices.currency_per_usd"), "{message}");
}

#[test]
fn prices_in_another_unit_cause_a_warning() {
    for (price, hint) in [
        ("electricity_per_kwh = 25.0", "25 cents are 0.25"),
        ("grid_g_per_kwh = 0.381", "0.381 kg are 381"),
        ("lidar = 4.0", "4 thousand are 4000"),
    ] {
        let text = BENDS.replace("[fleet]", &format!("[prices]\n{price}\n[fleet]"));
        let plant = Plant::from_toml(&text, "mine.toml", &Shipped).unwrap();
        let warnings = plant.warnings().unwrap();
        let written: Vec<_> = warnings.iter().map(ToString::to_string).collect();
        assert!(
            written.iter().any(|it| it.contains(hint)),
            "{price}: {written:?}"
        );
    }
    for name in Plant::names() {
        let plant = Plant::from_library(name, &Shipped).unwrap();
        let prices = |it: &Warning| it.key.starts_with("prices");
        assert!(!plant.warnings().unwrap().iter().any(prices), "{name}");
    }
}

#[test]
fn invalid_values_are_reported_with_their_key() {
    let message = refused(("trips_per_day = 40", "trips_per_day = 400"));
    assert!(message.contains("fleet.trips_per_day") && message.contains("at most"));
    let message = refused(("0.3 m 99 %", "0.3 99"));
    assert!(
        message.contains("target") && message.contains("0.3 m 99 %"),
        "{message}"
    );
    let message = refused(("[fleet]", "[prices]\nlidar = \"4000 USD\"\n[fleet]"));
    assert!(
        message.contains("prices.lidar") && message.contains("without its unit"),
        "{message}"
    );
    let lidar = "[prices]\nlidar = { low = 5000.0, value = 4000.0, high = 6000.0 }\n[fleet]";
    let message = refused(("[fleet]", lidar));
    assert!(
        message.contains("prices.lidar") && message.contains("must be in ascending order"),
        "{message}"
    );
}
