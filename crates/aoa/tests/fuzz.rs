//! Short runs of the fuzz target: see `fuzz/README.md`.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "this is a test")]

#[path = "../../../fuzz/bodies/angles.rs"]
mod angles;
#[path = "../../../fuzz/bodies/short_run.rs"]
mod short_run;

#[test]
fn samples_covariances_and_manifolds_never_cause_a_panic() {
    let seeds: Vec<Vec<u8>> = (0..=255_u8)
        .map(|settings| {
            let value = |i: u32| (f64::from(settings) + f64::from(i * i)).sin();
            let values = (0..40).flat_map(|i| value(i).to_le_bytes());
            [settings, settings / 2, settings / 3]
                .into_iter()
                .chain(values)
                .collect()
        })
        .collect();
    short_run::run(&seeds, 20_000, angles::run);
}
