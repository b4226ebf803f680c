//! Short runs of the fuzz targets: see `fuzz/README.md`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "this is a test"
)]

#[path = "../../../fuzz/bodies/pbch.rs"]
mod pbch;
#[path = "../../../fuzz/bodies/receiver.rs"]
mod receiver;
#[path = "../../../fuzz/bodies/short_run.rs"]
mod short_run;

#[test]
fn no_likelihood_ratios_make_the_decoder_panic() {
    let seeds: Vec<Vec<u8>> = (0..=255_u8)
        .step_by(5)
        .map(|settings| {
            let ratios =
                (0..40).flat_map(|i: u16| (f32::from(settings) * f32::from(i)).sin().to_le_bytes());
            [settings, settings, 1].into_iter().chain(ratios).collect()
        })
        .collect();
    short_run::run(&seeds, 3000, pbch::run);
}

#[test]
fn no_samples_make_the_receiver_panic() {
    let seeds: Vec<Vec<u8>> = (0..=255_u8)
        .step_by(3)
        .map(|settings| {
            // A weak stretch in the middle of the SSB, and noise-like steps before it.
            let [a, b, c, d] = 0.2_f32.to_le_bytes();
            let weak = [1, 200, 1, 9, a, b, c, d];
            let step = [2, 3, 0, 3, a, b, c, d];
            let head = [settings, settings ^ 0x4D, settings / 3, 120 + settings / 2];
            head.into_iter().chain(weak).chain(step).collect()
        })
        .collect();
    short_run::run(&seeds, 1500, receiver::run);
}
