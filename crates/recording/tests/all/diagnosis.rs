//! An error in the files of a drive is diagnosed, and a correct drive has no diagnosis. The example
//! `misconfigured_drives` measures the rates over many drives.

#[path = "../../examples/misconfigured_drives/misconfiguration.rs"]
mod misconfiguration;
#[path = "../../examples/misconfigured_drives/simulator.rs"]
mod simulator;

use misconfiguration::{MISCONFIGURATIONS, misconfigured};
use simulator::{Kind, drive};

/// Asserts that an error of a drive is diagnosed, and nothing else.
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
fn correct_drives_have_no_diagnosis() {
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
fn a_moved_radio_head_is_diagnosed_with_its_position() {
    is_named("one head 10 m off", Kind::OnRoad, 41);
    is_named("one head 10 m off", Kind::Robot, 42);
    is_named("x and y of one head", Kind::WithoutRoad, 43);
}

#[test]
fn exchanged_radio_heads_are_diagnosed() {
    is_named("PCIs exchanged", Kind::OnRoad, 51);
    is_named("PCIs exchanged", Kind::Robot, 52);
}

#[test]
fn a_wrong_yaw_rate_is_diagnosed() {
    is_named("yaw rate zero", Kind::OnRoad, 61);
    is_named("yaw rate missing", Kind::OnRoad, 63);
    is_named("yaw rate in degrees", Kind::OnRoad, 66);
}

#[test]
fn a_harmless_error_does_not_make_a_drive_unreliable() {
    let number = MISCONFIGURATIONS
        .iter()
        .position(|(name, _)| *name == "one head 10 m off")
        .unwrap();
    let located = |kind, seed| {
        let right = drive(kind, seed, true);
        let (wrong, _) = misconfigured(&right, number, seed).unwrap();
        let located = wrong.locate();
        (wrong.rms_error_m(&located), located)
    };
    for seed in [103, 104] {
        let (rms_m, located) = located(Kind::OnRoad, seed);
        assert!(rms_m < 0.3, "{rms_m}");
        assert!(!located.diagnoses.is_empty());
        assert_eq!(located.suspicions().count(), 0, "{:?}", located.diagnoses);
    }
    // Without a road, the other radio heads do not replace the wrong one.
    let (rms_m, located) = located(Kind::WithoutRoad, 100);
    assert!(rms_m > 1.0, "{rms_m}");
    assert!(located.suspicions().count() > 0, "{:?}", located.diagnoses);
}
