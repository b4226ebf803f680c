//! Search of 20 ms and tracking of one SSB, four antennas, one thread.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "this is a test")]

#[path = "../tests/air/mod.rs"]
mod air;

use nr_ssb::SubcarrierSpacing;
use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::track::Tracker;

fn main() {
    divan::main();
}

/// 20 ms of a cell at 0 dB on four antennas, at 3.84 Msps.
fn scene() -> (SearchConfig, Vec<Vec<nr_ssb::Complex32>>) {
    let mut rng = air::rng(1);
    let cell = air::Cell::random(&mut rng, SubcarrierSpacing::Khz15, 4);
    let mut samples = air::silence(4, 76_800);
    cell.add_to(&mut samples);
    air::add_noise(&mut samples, 0.0, &mut rng);
    let config = SearchConfig {
        ssb_freq_hz: Some(cell.ssb_freq_hz),
        ..SearchConfig::new(SubcarrierSpacing::Khz15, 4)
    };
    (config, samples)
}

#[divan::bench]
fn search_20_ms_of_4_antennas(bencher: divan::Bencher) {
    let (config, samples) = scene();
    let mut searcher = Searcher::new(config).unwrap();
    let slices = air::slices(&samples);
    bencher.bench_local(|| searcher.search(divan::black_box(&slices)).unwrap().len());
}

#[divan::bench(args = [false, true])]
fn track_one_ssb_of_4_antennas(bencher: divan::Bencher, decode_pbch: bool) {
    let (config, samples) = scene();
    let mut searcher = Searcher::new(config.clone()).unwrap();
    let slices = air::slices(&samples);
    let cell = searcher.search(&slices).unwrap()[0].clone();
    let mut tracker = Tracker::<4>::new(&config, &cell).unwrap();
    let antennas = std::array::from_fn(|antenna| slices[antenna]);
    let start = cell.sample_start;
    bencher.bench_local(|| {
        tracker
            .track(divan::black_box(&antennas), 0.0, start, decode_pbch)
            .unwrap()
            .is_some()
    });
}

/// What the four symbols of four antennas cost in bare transforms: the machine's yardstick.
#[divan::bench]
fn yardstick_16_transforms_of_256(bencher: divan::Bencher) {
    let fft = rustfft::FftPlanner::new().plan_fft_forward(256);
    let mut scratch = vec![nr_ssb::Complex32::ZERO; fft.get_inplace_scratch_len()];
    let mut buffer = vec![nr_ssb::Complex32::ZERO; 256];
    bencher.bench_local(|| {
        for _ in 0..16 {
            fft.process_with_scratch(divan::black_box(&mut buffer), &mut scratch);
        }
    });
}
