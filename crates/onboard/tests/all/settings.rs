//! Sites and vehicles as files: `extends`, overrides, and rejected values.

use onboard::receive::ReceiverConfig;
use onboard::settings::{
    Check, EstimatorMethod, Library, LocalizerSettings, NamedText, Pilots, SettingsError, Shipped,
    Site, TomlFile, UncertaintySettings, Vehicle, WakeUpSettings, check_together,
};

/// Files in memory, in addition to the shipped ones.
pub struct Shelf(pub &'static [(&'static str, &'static str)]);

impl Library for Shelf {
    fn text(
        &self,
        what: &'static str,
        shipped: &[(&'static str, &'static str)],
        name: &str,
        referrer: &str,
    ) -> Result<NamedText, SettingsError> {
        match self.0.iter().find(|it| it.0 == name) {
            Some((name, text)) => Ok(NamedText {
                origin: (*name).to_owned(),
                text: (*text).to_owned(),
            }),
            None => Shipped.text(what, shipped, name, referrer),
        }
    }

    fn points_m(&self, _: &str, _: &str) -> Result<Vec<[f64; 2]>, SettingsError> {
        Ok(vec![[0.0, 0.0], [80.0, 0.0], [80.0, 50.0]])
    }
}

const EMPTY: Shelf = Shelf(&[]);

fn vehicle(text: &str) -> Result<Vehicle, SettingsError> {
    Vehicle::from_toml(text, "vehicle.toml", &EMPTY)
}

fn site(text: &str) -> Result<Site, SettingsError> {
    Site::from_toml(text, "site.toml", &EMPTY)
}

/// Returns the file, the key and the allowed values of the error.
fn refusal<T>(outcome: Result<T, SettingsError>) -> (String, String, String) {
    let error = outcome.map(drop).unwrap_err();
    let message = error.to_string();
    match error {
        SettingsError::Value { file, key, .. }
        | SettingsError::UnknownKey { file, key, .. }
        | SettingsError::Shape { file, key, .. } => (file, key, message),
        other => panic!("{other}"),
    }
}

#[test]
fn a_file_extends_another_and_overrides_its_keys() {
    let carrier = Vehicle::from_library("carrier", &Shipped).unwrap();
    let mine = vehicle("extends = 'carrier'\nname = 'mine'\nodometer.scale = 1.01").unwrap();
    assert_eq!((mine.name.as_str(), mine.odometer.scale), ("mine", 1.01));
    // The other keys of a table are those of the extended file.
    assert_eq!(mine.odometer.scale_std, carrier.odometer.scale_std);
    let mut again = mine.clone();
    again.name.clone_from(&carrier.name);
    again.odometer.scale = 1.0;
    assert_eq!(again, carrier);
    // The written file does not depend on other files.
    assert!(!mine.to_toml().contains("extends ="));
    assert_eq!(vehicle(&mine.to_toml()).unwrap(), mine);
    // A list is replaced as a whole.
    let moved = "extends = 'trip-2'\n[[radio_heads]]\nposition_m = [10.0, 50.0, 8.0]";
    assert_eq!(site(moved).unwrap().radio_heads.len(), 1);
}

#[test]
fn chains_of_extends_are_resolved_and_loops_rejected() {
    let shelf = Shelf(&[
        ("a", "extends = 'b'\nname = 'a'\nodometer.scale = 1.02"),
        (
            "b",
            "extends = 'tugger'\nodometer = { scale = 1.01, scale_std = 0.2 }",
        ),
        ("loop", "extends = 'pool'"),
        ("pool", "extends = 'loop'"),
        ("wrong", "extends = 'b'\nodometer.skale = 1.0"),
    ]);
    let a = Vehicle::from_library("a", &shelf).unwrap();
    assert_eq!((a.odometer.scale, a.odometer.scale_std), (1.02, 0.2));
    assert!(matches!(a.wake_up, Some(WakeUpSettings::Uncertainty(_))));

    let (file, key, message) = refusal(Vehicle::from_library("loop", &shelf));
    assert_eq!((file.as_str(), key.as_str()), ("loop", "extends"));
    assert!(message.contains("at most 8 files"), "{message}");
    let (file, key, _) = refusal(Vehicle::from_library("wrong", &shelf));
    assert_eq!((file.as_str(), key.as_str()), ("wrong", "odometer.skale"));
    let (_, key, message) = refusal(vehicle("extends = 7"));
    assert!(key == "extends" && message.contains("the name of a file"));
    let message = vehicle("extends = 'carier'").unwrap_err().to_string();
    assert!(message.contains("did you mean `carrier`?"), "{message}");
    // A site file cannot extend a vehicle file.
    let message = site("extends = 'carrier'").unwrap_err().to_string();
    assert!(message.contains("no site `carrier`"), "{message}");
}

#[test]
fn a_changed_tag_removes_the_keys_of_the_previous_variant() {
    let fixed =
        vehicle("extends = 'tugger'\n[wake_up]\npolicy = 'fixed'\ninterval_ms = 40").unwrap();
    let Some(WakeUpSettings::Fixed(settings)) = fixed.wake_up else {
        panic!("{:?}", fixed.wake_up)
    };
    assert_eq!(settings.interval_ms, Some(40.0));
    // The keys remain if the kind is equal.
    let tight =
        vehicle("extends = 'tugger'\nwake_up = { policy = 'uncertainty', target_error_m = 0.1 }");
    let Some(WakeUpSettings::Uncertainty(settings)) = tight.unwrap().wake_up else {
        panic!("the policy is uncertainty")
    };
    assert_eq!(
        (settings.target_error_m, settings.min_variance_reduction_m2),
        (0.1, 1.5e-4)
    );
    // The keys also remain if the table contains no kind.
    let text = "extends = 'paper'\nwake_up.snr_set_point = { kind = 'absolute', snr_db = 5.0 }";
    assert!(matches!(
        vehicle(text).unwrap().wake_up,
        Some(WakeUpSettings::Gated(_))
    ));
    let tracker = "extends = 'paper'\nlocalizer.kind = 'tracker'";
    let tracker = vehicle(tracker).unwrap().localizer;
    assert!(matches!(tracker, LocalizerSettings::Tracker(_)));
}

#[test]
fn entries_of_a_list_are_overridden_by_name_or_all_at_once() {
    let yard = Site::from_library("yard", &Shipped).unwrap();
    let surveyed = site(
        "extends = 'yard'\n[radio_heads]\nall = { position_std_m = 0.1, eirp_dbm = 3.0 }\n\
         gate.eirp_dbm = 20.0",
    )
    .unwrap();
    assert_eq!(surveyed.radio_heads.len(), yard.radio_heads.len());
    for (head, shipped) in surveyed.radio_heads.iter().zip(&yard.radio_heads) {
        assert_eq!(head.position_m, shipped.position_m);
        assert_eq!(head.position_std_m, 0.1);
        let eirp_dbm = if head.name == "gate" { 20.0 } else { 3.0 };
        assert_eq!(head.eirp_dbm, eirp_dbm);
    }
    let (_, key, message) = refusal(site("extends = 'yard'\nradio_heads.gaet.eirp_dbm = 3.0"));
    assert_eq!(key, "radio_heads.gaet");
    assert!(
        message.contains("named gate, hall, dock, store, or all"),
        "{message}"
    );
    let (_, key, message) = refusal(site("extends = 'yard'\nradio_heads.gate = 3.0"));
    assert_eq!(key, "radio_heads.gate");
    assert!(message.contains("a table of the entry's keys"), "{message}");
}

#[test]
fn overrides_are_given_by_path_and_checked_like_a_file() {
    let yard = Site::from_library("yard", &Shipped).unwrap();
    let louder = yard
        .with_overrides([("radio_heads[2].eirp_dbm", 20.into())], &Shipped)
        .unwrap();
    assert_eq!(louder.radio_heads[2].eirp_dbm, 20.0);
    for (path, key, allowed) in [
        (
            "radio_heads[2].eirp_dbm",
            "radio_heads[2].eirp_dbm",
            "between -150 and 120",
        ),
        (
            "radio_heads[9].eirp_dbm",
            "radio_heads[9].eirp_dbm",
            "nothing at this path",
        ),
        ("rician_kdb", "rician_kdb", "did you mean `rician_k_db`?"),
        ("carrier_mhz", "carrier_mhz", "between 100 and 100000"),
        (
            "ssb.period_ms",
            "ssb.period_ms",
            "one of 5, 10, 20, 40, 80, 160",
        ),
    ] {
        let outcome = yard.with_overrides([(path, 999_999.into())], &Shipped);
        let (file, rejected_key, message) = refusal(outcome);
        assert_eq!(
            (file.as_str(), rejected_key.as_str()),
            ("yard with overrides", key)
        );
        assert!(message.contains(allowed), "{message}");
    }
}

#[test]
fn a_site_without_a_road_is_valid() {
    let roaming = "name = 'hall'\nradio_heads = [{ position_m = [9.0, 9.0, 6.0] }]";
    let hall = site(roaming).unwrap();
    assert_eq!(hall.build_road().unwrap(), None);
    let file = "road.file = 'road.csv'";
    let with_road = site(&format!("{roaming}\n{file}")).unwrap();
    // Points of another file are copied, so that the written file is complete.
    let road = with_road.build_road().unwrap().unwrap();
    // The smooth road is longer than one with an arc of 5 m, and shorter than the polyline.
    let length_m = road.length_m();
    let with_arc_m = 130.0 - 20.0 + 5.0 * std::f64::consts::PI;
    assert!((with_arc_m - 0.01..130.0).contains(&length_m), "{length_m}");
    assert_eq!(site(&with_road.to_toml()).unwrap(), with_road);
    let outcome = Site::from_toml(&format!("{roaming}\n{file}"), "site.toml", &Shipped);
    let (_, key, message) = refusal(outcome);
    assert!(
        key == "road.file" && message.contains("polyline_m"),
        "{message}"
    );

    // Without a road, a vehicle needs a known start, or a sufficient number of radio heads for a
    // search.
    let mut carrier = Vehicle::from_library("carrier", &Shipped).unwrap();
    let check = Check { file: "both" };
    check_together(&hall, &carrier, check).unwrap();
    carrier.start.known = false;
    let (_, key, message) = refusal(check_together(&hall, &carrier, check));
    assert_eq!(key, "vehicle.start.known");
    assert!(message.contains("elsewhere three"), "{message}");
    let heads = "radio_heads = [{ pci = 1, position_m = [0.0, 0.0, 6.0] }, { pci = 2, position_m = [9.0, 0.0, 6.0] }, \
                 { pci = 3, position_m = [0.0, 9.0, 6.0] }]";
    let three = site(&format!("name = 'hall'\n{heads}")).unwrap();
    check_together(&three, &carrier, check).unwrap();
}

#[test]
fn site_files_are_checked() {
    let head = |pci: u16, x: f64| {
        format!("[[radio_heads]]\nposition_m = [{x:.1}, 80.0, 0.0]\npci = {pci}\n")
    };
    let good = format!("name = 'plant'\n{}{}", head(1, 0.0), head(2, 50.0));
    assert_eq!(site(&good).unwrap().radio_heads.len(), 2);
    for (text, expected) in [
        (
            format!("name = 'plant'\n{}{}", head(1, 0.0), head(2, 0.0)),
            "radio_heads[1].position_m",
        ),
        (
            format!("name = 'plant'\n{}{}", head(1, 0.0), head(1, 50.0)),
            "radio_heads[1].pci",
        ),
        ("name = 'plant'\nradio_heads = []".to_owned(), "radio_heads"),
        (good.replace("'plant'", "' '"), "name"),
        (good.replace("name = 'plant'\n", ""), "name"),
        (format!("rician_k = 7\n{good}"), "rician_k"),
    ] {
        let (file, key, _) = refusal(site(&text));
        assert_eq!((file.as_str(), key.as_str()), ("site.toml", expected));
    }
}

#[test]
fn vehicle_files_are_checked() {
    for (text, expected) in [
        (
            "channel_gains = [[1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]",
            "array.channel_gains[1]",
        ),
        ("channel_gains = [[1.0, 0.0]]", "array.channel_gains"),
        ("elements = 17", "array.elements"),
        ("elements = 2.5", "array.elements"),
        ("position_m = [1.0, 2.0]", "array.position_m"),
        ("mounting_deg = 3", "array.mounting_deg"),
    ] {
        let (file, key, message) = refusal(vehicle(&format!("name = 'mine'\n[array]\n{text}")));
        assert_eq!(
            (file.as_str(), key.as_str()),
            ("vehicle.toml", expected),
            "{message}"
        );
    }
    for (text, expected) in [
        (
            "localizer.kind = 'dead-reckoning'\nintegrity = {}",
            "integrity",
        ),
        (
            "localizer.kind = 'dead-reckoning'\nwake_up.policy = 'uncertainty'",
            "wake_up.policy",
        ),
        (
            "localizer.kind = 'dead-reckoning'\nstart.known = false",
            "start.known",
        ),
        (
            "start = { known = false, pose = { x_m = 1.0 } }",
            "start.known",
        ),
        (
            "receiver.pilots = 'pss'\nestimator.method = 'esprit'",
            "estimator.method",
        ),
    ] {
        let (_, key, message) = refusal(vehicle(&format!("name = 'mine'\n{text}")));
        assert_eq!(key, expected, "{message}");
    }
}

#[test]
fn a_vehicle_receives_only_the_radio_heads_on_its_list() {
    let trip = Site::from_library("trip-2", &Shipped).unwrap();
    let with = |list: &str| {
        let list = format!("extends = 'carrier'\nreceiver.pci_allow_list = {list}");
        vehicle(&list).unwrap()
    };
    let check = Check { file: "both" };
    let listening = with("[2]");
    check_together(&trip, &listening, check).unwrap();
    assert_eq!(ReceiverConfig::new(&trip, &listening).cells, Some(vec![2]));
    for (list, expected) in [("[3]", "[0]"), ("[1, 7]", "[1]"), ("[]", "")] {
        let (_, key, _) = refusal(check_together(&trip, &with(list), check));
        assert_eq!(key, format!("vehicle.receiver.pci_allow_list{expected}"));
    }
    // With one of two radio heads, several positions are possible.
    let mut lost = with("[2]");
    lost.start.known = false;
    let (_, key, message) = refusal(check_together(&trip, &lost, check));
    assert_eq!(key, "vehicle.start.known");
    assert!(message.contains("two radio heads"), "{message}");
}

#[test]
fn default_vehicle_settings_are_valid() {
    let plain = vehicle("name = 'plain'").unwrap();
    assert_eq!(plain.receiver.pilots, Pilots::Ssb);
    assert_eq!(plain.estimator.method, EstimatorMethod::MaximumLikelihood);
    assert!(plain.follows_road() && plain.start.known);
    assert!(plain.start.position_std_m > 0.0 && plain.start.heading_std_rad > 0.0);
    assert!(plain.integrity_monitor().is_some());
    let by_error = WakeUpSettings::Uncertainty(UncertaintySettings::default());
    assert_eq!(plain.wake_up_policy(), by_error);
    let trusting = vehicle("name = 'plain'\nintegrity.enabled = false").unwrap();
    assert!(trusting.integrity_monitor().is_none());
    // Dead reckoning has no covariance, as integrity monitoring and uncertainty-driven wake-up
    // require.
    let text = "name = 'plain'\nlocalizer.kind = 'dead-reckoning'";
    for off in ["", "\nintegrity.enabled = false"] {
        let reckons = vehicle(&format!("{text}{off}")).unwrap();
        assert!(reckons.integrity_monitor().is_none());
        assert_eq!(reckons.wake_up_policy(), WakeUpSettings::EVERY_SSB);
    }
    for name in Vehicle::names() {
        let shipped = Vehicle::from_library(name, &Shipped).unwrap();
        assert_eq!(vehicle(&shipped.to_toml()).unwrap(), shipped);
    }
    for name in Site::names() {
        let shipped = Site::from_library(name, &Shipped).unwrap();
        assert_eq!(site(&shipped.to_toml()).unwrap(), shipped);
    }
}
