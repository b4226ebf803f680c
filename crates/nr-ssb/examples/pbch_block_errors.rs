//! PBCH block error rate in white noise with an ideally known channel:
//! `cargo run --release --example pbch_block_errors -- [SNR in dB] [blocks] [list sizes…]`
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a program"
)]

#[path = "../tests/all/noisy/mod.rs"]
mod noisy;

use std::time::Instant;

use nr_ssb::pbch::Decoder;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut next = |usual: &str| arguments.next().unwrap_or_else(|| usual.into());
    let snr_db = next("-8").parse().expect("an SNR in dB");
    let blocks = next("20000").parse().expect("a number of blocks");
    let sizes: Vec<usize> = arguments.map(|x| x.parse().expect("a list size")).collect();
    let alone = |size: usize| (format!("list of {size}"), Decoder::new(size).unwrap());
    let mut decoders: Vec<_> = match sizes.as_slice() {
        [] => [1, 8, 32].map(alone).into(),
        sizes => sizes.iter().copied().map(alone).collect(),
    };
    decoders.push(("default (8, then 32)".into(), Decoder::default()));
    for (name, decoder) in &mut decoders {
        let begin = Instant::now();
        let errors = noisy::block_errors(decoder, snr_db, blocks, 1);
        let rate = errors as f64 / blocks as f64;
        let deviation = (rate * (1.0 - rate) / blocks as f64).sqrt();
        let micros = 1e6 * begin.elapsed().as_secs_f64() / blocks as f64;
        println!(
            "{name:20} {snr_db} dB: {errors} errors in {blocks}, {:.3} % ± {:.3} %; \
             {micros:.0} µs a block with coding and noise",
            100.0 * rate,
            100.0 * deviation
        );
    }
}
