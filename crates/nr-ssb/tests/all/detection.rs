//! Detection and decoding rates of SSBs in noise, and false-alarm rate.

use crate::air;
use crate::noise_only;
use nr_ssb::SubcarrierSpacing;
use nr_ssb::search::{SearchConfig, Searcher};

/// Returns the shares of trials in which the SSB in 20 ms is detected at the correct time, and
/// decoded.
fn rates(antennas: usize, snr_db: f64, trials: u64) -> (f64, f64) {
    let spacing = SubcarrierSpacing::Khz15;
    let mut searcher = Searcher::new(SearchConfig::new(spacing, antennas)).unwrap();
    let (mut found, mut decoded) = (0, 0);
    for trial in 0..trials {
        let mut rng = air::rng(1000 * antennas as u64 + trial);
        let cell = air::Cell::random(&mut rng, spacing, antennas);
        let mut samples = air::silence(antennas, 76_800);
        cell.add_to(&mut samples);
        air::add_noise(&mut samples, snr_db, &mut rng);
        searcher.tune(Some(cell.ssb_freq_hz)).unwrap();
        let start = cell.ssb_start(cell.ssb_indices[0]);
        let cells = searcher.search(&air::slices(&samples)).unwrap();
        let hit = cells
            .iter()
            .find(|ssb| ssb.pci.get() == cell.pci && (ssb.sample_start - start).abs() < 1.0);

        found += u64::from(hit.is_some());
        decoded += u64::from(hit.and_then(|ssb| ssb.payload).is_some_and(|payload| {
            payload.sfn() == cell.sfn && payload.half_frame == cell.half_frame
        }));
    }
    println!("{antennas} antennas, {snr_db} dB: {found} found, {decoded} decoded of {trials}");
    (found as f64 / trials as f64, decoded as f64 / trials as f64)
}

/// Number of trials.
const TRIALS: u64 = 80;
/// Minimum fraction of detections that is consistent with a probability of 0.95 at three sigma.
const FEWEST: f64 = 0.95 - 3.0 * 0.0244;

#[test]
fn one_ssb_in_20_ms_is_found_by_four_antennas_at_minus_10_db() {
    let (found, _) = rates(4, -10.0, TRIALS);
    assert!(found >= FEWEST, "{found}");
}

#[test]
fn one_ssb_in_20_ms_is_decoded_by_four_antennas_at_minus_8_db() {
    let (_, decoded) = rates(4, -8.0, TRIALS);
    assert!(decoded >= FEWEST, "{decoded}");
}

#[test]
fn one_ssb_in_20_ms_is_found_by_one_antenna_at_minus_6_db() {
    let (found, _) = rates(1, -6.0, TRIALS);
    assert!(found >= FEWEST, "{found}");
}

#[test]
fn one_ssb_in_20_ms_is_decoded_by_one_antenna_at_minus_3_db() {
    let (_, decoded) = rates(1, -3.0, TRIALS);
    assert!(decoded >= FEWEST, "{decoded}");
}

/// With a false-alarm probability of 1e-3 per search, 400 searches detect a false cell with a
/// probability of 0.33. A tenfold rate is detected here with a probability of 0.98. The example
/// `false_cells` simulates enough searches to test 1e-3.
#[test]
fn noise_gives_no_detection() {
    let mut all = noise_only::Tally::default();
    for (antennas, searches) in [(1, 300), (4, 100)] {
        all.add(noise_only::search_noise(antennas, 0..searches));
    }
    println!("{all:?}");
    assert_eq!(all.false_cells, 0);
    // Ensure that candidates were examined.
    assert!(all.pss_candidates > 0 && all.pbch_tried > 0);
}

#[test]
fn the_upper_limit_is_that_of_clopper_and_pearson() {
    // No event: 1 − 0.05^(1/n). At most one event in ten has the probability (1 − p)^9 (1 + 9p).
    assert!((noise_only::upper_limit(0, 1000) - (1.0 - 0.05_f64.powf(1e-3))).abs() < 1e-12);
    let p: f64 = noise_only::upper_limit(1, 10);
    assert!(((1.0 - p).powi(9) * (1.0 + 9.0 * p) - 0.05).abs() < 1e-9);
}

#[test]
fn bursts_without_or_with_little_noise_are_detected() {
    for trial in 0..24 {
        let mut rng = air::rng(trial);
        let spacing = [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30][trial as usize % 2];
        let cell = air::Cell::random(&mut rng, spacing, 2);
        let half_frame = cell.half_frame_samples();
        let mut samples = air::silence(2, 76_800);
        for antenna in &mut samples {
            antenna[1_000..1_000 + half_frame.len()].copy_from_slice(&half_frame);
        }
        // Noise-free samples, and less noise than in any receiver.
        if let Some(snr_db) = [None, Some(90.0), Some(60.0), Some(45.0)][trial as usize / 2 % 4] {
            air::add_noise(&mut samples, snr_db, &mut rng);
        }
        let config = SearchConfig {
            ssb_freq_hz: Some(cell.ssb_freq_hz),
            ..SearchConfig::new(spacing, 2)
        };
        let mut searcher = Searcher::new(config).unwrap();
        let found = searcher.search(&air::slices(&samples)).unwrap();
        let [ssb] = found else {
            panic!("trial {trial}: {} SSBs", found.len())
        };
        let decoded = ssb.payload.map(|payload| payload.sfn());
        assert_eq!(
            (ssb.pci.get(), decoded),
            (cell.pci, Some(cell.sfn)),
            "trial {trial}"
        );
    }
}
