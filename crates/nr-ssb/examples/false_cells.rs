//! False-alarm rate of the cell search in 20 ms of noise, with one and with four antennas:
//! `cargo run --release --example false_cells -- [searches] [seed]`
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a program"
)]

#[path = "../tests/all/air/mod.rs"]
mod air;
#[path = "../tests/all/noise_only/mod.rs"]
mod noise_only;

use noise_only::{Tally, search_noise, upper_limit};

/// Number of decoder paths, in the list and in its retry, per PBCH and burst set size.
const PATHS: f64 = 8.0 + 32.0;
/// Probability that a path on noise passes: 21 bits of the CRC that the decoder has not used, and
/// one bit of the MIB.
const PASSES: f64 = 1.0 / (1 << 22) as f64;
/// Number of burst set sizes that are tried if none is given.
const SIZES: f64 = 2.0;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let searches = arguments
        .next()
        .map_or(20_000, |n| n.parse().expect("searches"));
    let seed: u64 = arguments.next().map_or(1, |n| n.parse().expect("a seed"));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut all = Tally::default();
    for antennas in [1, 4] {
        let first = (seed << 32) + antennas as u64 * (1 << 31);
        let seeds = first..first + searches / 2;
        let tally = std::thread::scope(|scope| {
            let workers: Vec<_> = (0..threads)
                .map(|i| seeds.clone().skip(i).step_by(threads))
                .map(|seeds| scope.spawn(move || search_noise(antennas, seeds)))
                .collect();
            let mut tally = Tally::default();
            for worker in workers {
                tally.add(worker.join().expect("no panic"));
            }
            tally
        });
        report(&format!("{antennas} antennas"), &tally);
        all.add(tally);
    }
    report("together", &all);
}

fn report(name: &str, tally: &Tally) {
    let per_search = |count: u64| count as f64 / tally.searches as f64;
    println!(
        "{name}: {} false cells ({} with a MIB) in {} searches of 20 ms; at most {:.1e} a search with 95 %",
        tally.false_cells,
        tally.false_mibs,
        tally.searches,
        upper_limit(tally.false_cells, tally.searches),
    );
    println!(
        "    {:.2} PSS candidates and {:.4} PBCH decodings a search; expected false MIBs {:.1e} a search",
        per_search(tally.pss_candidates),
        per_search(tally.pbch_tried),
        per_search(tally.pbch_tried) * SIZES * PATHS * PASSES,
    );
}
