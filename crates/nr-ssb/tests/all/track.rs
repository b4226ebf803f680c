//! Tracking a known cell: timing, frequency, beams, despread pilots, loss and reacquisition.

use crate::air::{self, slices};
use nr_ssb::search::{DetectedSsb, SearchConfig, SearchError, Searcher};
use nr_ssb::track::{TrackError, Tracker};
use nr_ssb::{Complex32, Lmax, SubcarrierSpacing};

const SPACING: SubcarrierSpacing = SubcarrierSpacing::Khz30;
const HALF_FRAME: usize = 38_400;

/// Creates a cell with two beams at Lmax 8, received by four antennas at this SNR.
fn scene(seed: u64, snr_db: f64) -> (air::Cell, SearchConfig, Vec<Vec<Complex32>>) {
    let mut cell = air::Cell::random(&mut air::rng(seed), SPACING, 4);
    cell.lmax = Lmax::L8;
    cell.ssb_freq_hz = 3.6e9;
    cell.ssb_indices = vec![1, 6];
    cell.delay = 100.3;
    let config = SearchConfig {
        ssb_freq_hz: Some(cell.ssb_freq_hz),
        ..SearchConfig::new(SPACING, 4)
    };
    let samples = received(&cell, snr_db, seed);
    (cell, config, samples)
}

fn received(cell: &air::Cell, snr_db: f64, seed: u64) -> Vec<Vec<Complex32>> {
    let mut samples = air::silence(4, HALF_FRAME);
    cell.add_to(&mut samples);
    air::add_noise(&mut samples, snr_db, &mut air::rng(seed + 7777));
    samples
}

fn first(config: &SearchConfig, samples: &[Vec<Complex32>]) -> DetectedSsb {
    let mut searcher = Searcher::new(config.clone()).unwrap();
    searcher.search(&air::slices(samples)).unwrap()[0].clone()
}

#[test]
fn beams_timing_frequency_and_gains_are_followed() {
    for seed in 0..8 {
        let (mut cell, config, samples) = scene(seed, 10.0);
        let mut tracker = Tracker::new(&config, &first(&config, &samples)).unwrap();
        for period in 1..6 {
            // A clock error of 2 ppm and a drifting oscillator.
            cell.delay += 0.3;
            cell.cfo_hz += 20.0;
            let samples = received(&cell, 10.0, 100 * seed + period);
            for index in [1, 6] {
                let start = cell.ssb_start(index);
                let tracked = tracker
                    .track(&slices(&samples), 0.0, start.round() + 0.2, period == 5)
                    .unwrap()
                    .unwrap();
                assert_eq!((tracked.pci.get(), tracked.ssb_index), (cell.pci, index));
                assert!(
                    (tracked.sample_start - start).abs() < 0.05,
                    "{}",
                    tracked.sample_start
                );
                assert!(
                    (tracked.cfo_hz - cell.cfo_hz).abs() < 150.0,
                    "{}",
                    tracked.cfo_hz
                );
                assert!((tracked.snr_db - 10.0).abs() < 1.0, "{}", tracked.snr_db);
                assert_eq!(tracked.payload.is_some(), period == 5);
                let pilots = if period == 5 {
                    [127, 240, 223, 240]
                } else {
                    [127, 60, 151, 60]
                };
                assert_eq!(tracked.pilots, pilots);
                // Each block is the antennas' gains times one common number.
                for block in &tracked.blocks {
                    for (value, gain) in block.iter().zip(&cell.gains) {
                        let expected = gain / cell.gains[0];
                        let ratio = value / block[0];
                        let error = (ratio.re - f64::from(expected.re))
                            .hypot(ratio.im - f64::from(expected.im));
                        assert!(error < 0.25, "{error}");
                    }
                }
            }
        }
    }
}

/// The mean of |block|² over many SSBs is the pilot energy at the SNR plus the reported noise
/// variance.
#[test]
fn noise_variance_and_blocks_keep_the_scale_of_a_resource_element() {
    let (cell, config, samples) = scene(50, 0.0);
    let mut tracker = Tracker::new(&config, &first(&config, &samples)).unwrap();
    let (mut signal, mut noise, mut count) = (0.0, 0.0, 0.0);
    for period in 0..50 {
        let samples = received(&cell, 0.0, 500 + period);
        let start = cell.ssb_start(6);
        let tracked = tracker
            .track(&slices(&samples), 0.0, start, false)
            .unwrap()
            .unwrap();
        signal += tracked.blocks[0]
            .iter()
            .map(num_complex::Complex64::norm_sqr)
            .sum::<f64>()
            / 4.0;
        noise += tracked.noise_variance.iter().sum::<f64>() / 4.0;
        count += 1.0;
    }
    // Unit gain and 0 dB: a block has energy 127 + 1, a resource element noise 1.
    assert!((noise / count - 1.0).abs() < 0.05, "{}", noise / count);
    assert!(
        (signal / count / 128.0 - 1.0).abs() < 0.05,
        "{}",
        signal / count
    );
}

#[test]
fn a_moved_cell_is_tracked_and_a_lost_one_is_reported() {
    let (mut cell, config, samples) = scene(60, 5.0);
    let mut tracker = Tracker::new(&config, &first(&config, &samples)).unwrap();
    let expected = cell.ssb_start(1);
    cell.delay += 400.0;
    let moved = received(&cell, 5.0, 61);
    let missed = tracker.track(&slices(&moved), 0.0, expected, false);
    assert_eq!((missed, tracker.misses()), (Ok(None), 1));
    tracker.found(&first(&config, &moved), 153_600.0);
    assert_eq!(tracker.misses(), 0);
    let tracked = tracker
        .track(&slices(&moved), 0.0, tracker.expected_start(0.0), false)
        .unwrap()
        .unwrap();
    assert!((tracked.sample_start - cell.ssb_start(tracked.ssb_index)).abs() < 0.1);

    let mut noise = air::silence(4, HALF_FRAME);
    air::add_noise(&mut noise, 5.0, &mut air::rng(62));
    for misses in 1..4 {
        assert_eq!(
            tracker.track(&slices(&noise), 0.0, expected, false),
            Ok(None)
        );
        assert_eq!(tracker.misses(), misses);
    }
    tracker
        .track(&slices(&moved), 0.0, cell.ssb_start(1), false)
        .unwrap()
        .unwrap();
    assert_eq!(tracker.misses(), 0);
}

#[test]
fn invalid_windows_and_settings_are_rejected() {
    let (cell, config, samples) = scene(70, 5.0);
    let found = first(&config, &samples);
    let mut tracker = Tracker::new(&config, &found).unwrap();
    assert!(matches!(
        tracker.track(&slices(&samples)[..2], 0.0, 0.0, false),
        Err(TrackError::Search(SearchError::AntennaCount {
            given: 2,
            expected: 4
        }))
    ));
    let start = cell.ssb_start(1);
    for (window_start, expected) in [(start + 100.0, start), (0.0, 1e9), (0.0, f64::NAN)] {
        let result = tracker.track(&slices(&samples), window_start, expected, false);
        assert!(
            matches!(result, Err(TrackError::Window { .. })),
            "{result:?}"
        );
    }
    let short = samples[0][..500].to_vec();
    let uneven = [&short[..], &samples[1], &samples[2], &samples[3]];
    assert!(tracker.track(&uneven, 0.0, start, false).is_err());
    let broken = vec![vec![Complex32::new(f32::NAN, 0.0); HALF_FRAME]; 4];
    assert_eq!(tracker.track(&slices(&broken), 0.0, start, false), Ok(None));
}
