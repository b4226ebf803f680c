//! Elevated radio heads and an array with a lever arm: the tracker models their geometry.

use onboard::settings::{Shipped, TomlFile};
use simulate::scenario::Scenario;
use toml::Value;

use crate::common::{campaign, changed, unguarded, value};
use crate::statistics::{CampaignStatistics, Consistency};

/// Returns a scenario with radio heads at a height of 8 m, and an array 1.2 m above and 0.8 m in
/// front of the odometer's reference point.
fn high() -> Scenario {
    let mut changes: Vec<(String, Value)> = Vec::new();
    for (index, head) in unguarded("paper-real-odometry-4")
        .site
        .radio_heads
        .iter()
        .enumerate()
    {
        let [x_m, y_m, _] = head.position_m;
        let position = value(&format!("[{x_m:?}, {y_m:?}, 8.0]"));
        changes.push((format!("site.radio_heads[{index}].position_m"), position));
    }
    changes.push((
        "vehicle.array.position_m".to_owned(),
        value("[0.8, 0.0, 1.2]"),
    ));
    let changes = changes
        .iter()
        .map(|(key, value)| (key.as_str(), value.clone()));
    changed("paper-real-odometry-4", changes)
}

fn drive(scenario: &Scenario, runs: usize) -> Consistency {
    let found = campaign(scenario, 21, runs).consistency(50);
    println!("{found:?}");
    found
}

#[test]
fn heights_and_lever_arm_are_modelled() {
    let high = high();
    let found = drive(&high, 60);
    assert!((0.8..1.2).contains(&(found.mean_nees / 2.0)), "{found:?}");

    // Equal environment, but a nominal model without heights.
    let (site, vehicle) = (high.site, high.vehicle);
    let heads = site.radio_heads.iter();
    let places = heads.map(|head| format!("{}.position_m = {:?}", head.name, head.position_m));
    let places: Vec<String> = places.collect();
    let truth = format!("{{ radio_heads = {{ {} }} }}", places.join(", "));
    let flat = unguarded("paper-real-odometry-4")
        .with_overrides(
            [
                ("truth.site", value(&truth)),
                (
                    "truth.vehicle.array.position_m",
                    value(&format!("{:?}", vehicle.array.position_m)),
                ),
            ],
            &Shipped,
        )
        .unwrap();
    // The mistake multiplies the NEES by 35, so that few runs suffice.
    let mistaken = drive(&flat, 4);
    assert!(mistaken.mean_nees > 2.0 * found.mean_nees, "{mistaken:?}");
    assert!(mistaken.rms_m > 1.5 * found.rms_m, "{mistaken:?}");
}
