//! Time to search 20 ms and to track one SSB (four antennas, one thread), and to scan a band (all threads).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "this is a test")]

#[path = "../tests/all/air/mod.rs"]
mod air;

use nr_ssb::SubcarrierSpacing;
use nr_ssb::raster::scan_off_raster;
use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::track::Tracker;

fn main() {
    divan::main();
}

/// Returns 20 ms of a cell at 0 dB on four antennas, at 3.84 Msps.
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
    let mut tracker = Tracker::new(&config, &cell).unwrap();
    let start = cell.sample_start;
    bencher.bench_local(|| {
        tracker
            .track(divan::black_box(&slices), 0.0, start, decode_pbch)
            .unwrap()
            .is_some()
    });
}

/// Measures delay, carrier phase, range rate and power of a tracked SSB.
#[divan::bench]
fn observe_one_ssb_of_4_antennas(bencher: divan::Bencher) {
    let (config, samples) = scene();
    let mut searcher = Searcher::new(config.clone()).unwrap();
    let slices = air::slices(&samples);
    let cell = searcher.search(&slices).unwrap()[0].clone();
    let mut tracker = Tracker::new(&config, &cell).unwrap();
    let tracked = tracker.track(&slices, 0.0, cell.sample_start, false);
    let ssb = tracked.unwrap().unwrap();
    bencher.bench_local(|| tracker.observe(divan::black_box(&ssb)).is_some());
}

/// Searches for a cell off the raster whose parameters are unknown: at 5 dB, on one antenna, in 20
/// ms at 46.08 Msps.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn scan_off_raster_20_ms_at_46_msps(bencher: divan::Bencher) {
    let (spacing, rate_hz, centre_hz) = (SubcarrierSpacing::Khz30, 46.08e6, 3.7e9);
    let mut rng = air::rng(2);
    let mut cell = air::Cell::random(&mut rng, spacing, 1);
    (cell.ssb_freq_hz, cell.ssb_indices) = (3.706e9, vec![1]);
    let mut base = air::silence(1, 153_600);
    cell.add_to(&mut base);
    let mut samples = vec![air::raised(&base[0], 6, 6e6 / rate_hz)];
    // `raised` preserves amplitudes: noise of equal density has a power proportional to the rate.
    air::add_noise(&mut samples, 5.0 - 10.0 * 6_f64.log10(), &mut rng);
    let slices = air::slices(&samples);
    bencher.bench_local(|| {
        let finds = scan_off_raster(divan::black_box(&slices), rate_hz, Some(centre_hz), &[]);
        assert_eq!(finds.unwrap()[0].ssbs[0].pci.get(), cell.pci);
    });
}

/// Measures the speed of the computer as a reference: the transforms of four symbols of four
/// antennas.
#[divan::bench]
fn yardstick_16_transforms_of_256(bencher: divan::Bencher) {
    let fft = nr_ssb::fft::forward(256);
    let mut scratch = vec![nr_ssb::Complex32::ZERO; fft.get_inplace_scratch_len()];
    let mut buffer = vec![nr_ssb::Complex32::ZERO; 256];
    bencher.bench_local(|| {
        for _ in 0..16 {
            fft.process_with_scratch(divan::black_box(&mut buffer), &mut scratch);
        }
    });
}
