//! Keys of settings files that were renamed.

use crate::settings::Shelf;
use onboard::settings::{SettingsError, Shipped, TomlFile, Vehicle};

/// File with an old key.
const OLD: Shelf = Shelf(&[("old", "name = 'old'\nreceiver.lateness_s = 0.01")]);

/// Returns the file, the old key and the new key of the error.
fn refusal(outcome: Result<Vehicle, SettingsError>) -> [String; 3] {
    match outcome.unwrap_err() {
        SettingsError::RenamedKey { file, key, new } => [file, key, new],
        other => panic!("{other}"),
    }
}

fn vehicle(text: &str) -> Result<Vehicle, SettingsError> {
    Vehicle::from_toml(text, "vehicle.toml", &OLD)
}

#[test]
fn old_keys_are_rejected_in_files_base_files_and_overrides() {
    assert_eq!(
        refusal(vehicle("like = 'carrier'")),
        ["vehicle.toml", "like", "extends"]
    );
    let offset = ["receiver.lateness_s", "receiver.angle_time_offset_s"];
    assert_eq!(
        refusal(vehicle("extends = 'old'")),
        ["old", offset[0], offset[1]]
    );
    let carrier = vehicle("extends = 'carrier'").unwrap();
    let due = ("wake_up.due", toml::Value::Table(toml::Table::new()));
    let [_, old, new] = refusal(carrier.with_overrides([due], &Shipped));
    assert_eq!(
        (old.as_str(), new.as_str()),
        ("wake_up.due", "wake_up.trigger")
    );
}
