//! Drives with one error in their files: fraction of errors that are diagnosed correctly, and false
//! diagnoses of correct drives. With `$ACCESS_AV_DATA`, the recorded drives are included.
//!
//! `cargo run --release -p recording --example misconfigured_drives -- [seeds] [first seed]`;
//! `ONLY="yaw rate zero" KIND="Robot, integrity true" VERBOSE=1` for one row, drive by drive.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::indexing_slicing)]

mod misconfiguration;
mod recorded;
mod simulator;

use misconfiguration::{MISCONFIGURATIONS, misconfigured};
use recording::replay::LocatedDrive;
use simulator::{Drive, Kind, drive};

const KINDS: [Kind; 3] = [Kind::OnRoad, Kind::WithoutRoad, Kind::Robot];

/// Whether a drive ends with exit code 3, by the rule of the command line.
fn is_unreliable(located: &LocatedDrive) -> bool {
    located.is_lost_for_long() || located.suspicions().next().is_some()
}

fn describe(what: &str, drive: &Drive, name: &str) -> (Vec<String>, bool, f64) {
    let located = drive.locate();
    let named: Vec<String> = located.diagnoses.iter().map(|it| it.text.clone()).collect();
    let (unreliable, rms_m) = (is_unreliable(&located), drive.rms_error_m(&located));
    if std::env::var_os("VERBOSE").is_some() {
        println!(
            "{what} {:?} {name}: {rms_m:.2} m, exit 3 {unreliable}, {named:?}",
            drive.kind
        );
        if std::env::var_os("REMARKS").is_some() {
            for remark in &located.remarks {
                println!("      {}", remark.text);
            }
        }
    }
    (named, unreliable, rms_m)
}

/// Results of the drives with one kind of error.
#[derive(Default)]
struct Tally {
    drives: usize,
    named: usize,
    nothing_else: usize,
    exit_3: usize,
    silently_far: usize,
}

/// Locates a group of drives, without an error and with each error.
fn campaign(sound: &[(String, Drive)], only: &str) {
    if only.is_empty() || only == "sound" {
        let (mut accused, mut unreliable, mut errors_m) = (0, 0, Vec::new());
        for (name, drive) in sound {
            let (named, is_unreliable, rms_m) = describe("sound", drive, name);
            accused += usize::from(!named.is_empty());
            unreliable += usize::from(is_unreliable);
            errors_m.push(rms_m);
        }
        errors_m.sort_by(f64::total_cmp);
        println!(
            "  sound: {accused} of {} accused, {unreliable} with exit code 3, RMS {:.2} m in the \
             median, {:.2} m at most",
            sound.len(),
            errors_m[errors_m.len() / 2],
            errors_m[errors_m.len() - 1]
        );
    }
    for (number, (what, _)) in MISCONFIGURATIONS.iter().enumerate() {
        if !only.is_empty() && *what != only {
            continue;
        }
        let mut tally = Tally::default();
        for (seed, (name, drive)) in (0..).zip(sound) {
            let Some((wrong, words)) = misconfigured(drive, number, seed) else {
                continue;
            };
            let (named, is_unreliable, rms_m) = describe(what, &wrong, name);
            let says = |it: &&String| words.iter().all(|word| it.contains(word));
            let right = named.iter().filter(says).count();
            if right == 0 && std::env::var_os("VERBOSE").is_some() {
                println!("    expected {words:?}");
            }
            tally.drives += 1;
            tally.named += usize::from(right > 0);
            tally.nothing_else += usize::from(right > 0 && right == named.len());
            tally.exit_3 += usize::from(is_unreliable);
            tally.silently_far += usize::from(!is_unreliable && rms_m > 1.0);
        }
        if tally.drives > 0 {
            println!(
                "  {what}: {} of {} named, {} and nothing else; exit code 3 {}; more than 1 m off \
                 with exit code 0 {}",
                tally.named, tally.drives, tally.nothing_else, tally.exit_3, tally.silently_far
            );
        }
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = |otherwise: u64| {
        let argument = arguments.next();
        argument.map_or(otherwise, |it| it.parse().unwrap())
    };
    let (seeds, first) = (number(20), number(1));
    let only = std::env::var("ONLY").unwrap_or_default();
    let of_kind = std::env::var("KIND").unwrap_or_default();
    for guarded in [false, true] {
        for kind in KINDS {
            let title = format!("{kind:?}, integrity {guarded}");
            if !title.contains(&of_kind) {
                continue;
            }
            println!("{title}");
            let drives =
                (first..first + seeds).map(|seed| (seed.to_string(), drive(kind, seed, guarded)));
            campaign(&drives.collect::<Vec<_>>(), &only);
        }
        let title = format!("recorded, integrity {guarded}");
        if std::env::var_os("ACCESS_AV_DATA").is_some() && title.contains(&of_kind) {
            println!("{title}");
            campaign(&recorded::drives(guarded), &only);
        }
    }
}
