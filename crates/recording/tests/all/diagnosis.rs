//! One wrong thing in the files of a drive is named, and nothing where nothing is wrong. The rates,
//! over many drives, are measured by the example `misconfigured_drives`.

#[path = "../../examples/misconfigured_drives/misconfiguration.rs"]
mod misconfiguration;
#[path = "../../examples/misconfigured_drives/simulator.rs"]
mod simulator;

use misconfiguration::{MISCONFIGURATIONS, misconfigured};
use simulator::{Kind, drive};

/// Names a wrong thing of a drive, and nothing else.
fn is_named(what: &str, kind: Kind, seed: u64) {
    let number = MISCONFIGURATIONS
        .iter()
        .position(|(name, _)| *name == what)
        .unwrap();
    let (wrong, words) = misconfigured(&drive(kind, seed, true), number, seed).unwrap();
    let diagnoses = wrong.locate().diagnoses;
    assert_eq!(diagnoses.len(), 1, "{what}: {diagnoses:?}");
    for word in words {
        assert!(
            diagnoses[0].text.contains(&word),
            "{what}: {word} {diagnoses:?}"
        );
    }
}

#[test]
fn nothing_is_named_on_sound_drives() {
    for kind in [Kind::OnRoad, Kind::WithoutRoad, Kind::Robot] {
        for seed in 31..33 {
            let sound = drive(kind, seed, true);
            let located = sound.locate();
            assert_eq!(located.diagnoses, [], "{kind:?} {seed}");
            assert!(!located.is_lost_for_long());
            assert!(sound.rms_error_m(&located) < 1.0);
        }
    }
}

#[test]
fn a_radio_head_elsewhere_is_named_and_told_where_it_stands() {
    is_named("one head 10 m off", Kind::OnRoad, 41);
    is_named("one head 10 m off", Kind::Robot, 42);
    is_named("x and y of one head", Kind::WithoutRoad, 43);
}

#[test]
fn two_that_are_exchanged_are_named() {
    is_named("PCIs exchanged", Kind::OnRoad, 51);
    is_named("PCIs exchanged", Kind::Robot, 52);
}

#[test]
fn a_yaw_rate_that_is_none_is_named() {
    is_named("yaw rate zero", Kind::OnRoad, 61);
    is_named("yaw rate missing", Kind::OnRoad, 63);
    is_named("yaw rate in degrees", Kind::OnRoad, 64);
}

#[test]
fn what_does_no_harm_is_no_reason_to_mistrust_a_drive() {
    let number = MISCONFIGURATIONS
        .iter()
        .position(|(name, _)| *name == "one head 10 m off");
    let (wrong, _) = misconfigured(&drive(Kind::OnRoad, 102, true), number.unwrap(), 102).unwrap();
    let located = wrong.locate();
    let is_far = wrong.rms_error_m(&located) > 1.0;
    assert_eq!(
        located.suspicions().count() > 0,
        is_far,
        "{:?}",
        located.diagnoses
    );
}
