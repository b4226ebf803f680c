//! DC offset and tones: found, removed and reported; SSBs and channels are then as without them.

use std::f64::consts::TAU;

use crate::air::{Cell, add_noise, phasor, rng, silence, slices};
use nr_ssb::raster::scan;
use nr_ssb::receiver::{Receiver, ReceiverConfig, Window, WindowReceiver};
use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::{Complex32, SubcarrierSpacing, Tone};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const SPACING: SubcarrierSpacing = SubcarrierSpacing::Khz30;

/// Powers of a tone relative to the SSB's.
const ABOVE_SSB_DB: [f64; 5] = [-10.0, 0.0, 10.0, 15.0, 20.0];
/// 240 subcarriers of power one over the 256 samples of an unnormalised transform, squared.
const SSB_POWER: f64 = 240.0 / 65536.0;

/// Adds a tone `above_ssb_db` above an SSB of unit resource elements, with a gain of its own per antenna.
fn add_tone(samples: &mut [Vec<Complex32>], cycles: f64, above_ssb_db: f64, rng: &mut ChaCha8Rng) {
    let amplitude = (10f64.powf(0.1 * above_ssb_db) * SSB_POWER).sqrt();
    for antenna in samples {
        let turn = rng.random_range(0.0..TAU);
        for (n, x) in antenna.iter_mut().enumerate() {
            *x += phasor(turn + TAU * cycles * n as f64) * amplitude as f32;
        }
    }
}

/// A cell with one SSB in 20 ms.
fn scene(seed: u64, antennas: usize, snr_db: f64) -> (Cell, Vec<Vec<Complex32>>, ChaCha8Rng) {
    let mut rng = rng(seed);
    let cell = Cell::random(&mut rng, SPACING, antennas);
    let mut samples = silence(antennas, 153_600);
    cell.add_to(&mut samples);
    add_noise(&mut samples, snr_db, &mut rng);
    (cell, samples, rng)
}

fn is_found(searcher: &mut Searcher, cell: &Cell, samples: &[Vec<Complex32>]) -> bool {
    searcher.tune(Some(cell.ssb_freq_hz)).unwrap();
    let start = cell.ssb_start(cell.ssb_indices[0]);
    let ssbs = searcher.search(&slices(samples)).unwrap();
    ssbs.iter()
        .any(|ssb| ssb.pci.get() == cell.pci && (ssb.sample_start - start).abs() < 1.0)
}

/// DC in every second scene, a tone anywhere in the others.
fn cycles(seed: u64, rng: &mut ChaCha8Rng) -> f64 {
    if seed.is_multiple_of(2) {
        0.0
    } else {
        rng.random_range(-0.5..0.5)
    }
}

#[test]
fn a_search_finds_what_it_finds_without_tones_and_reports_them() {
    for (antennas, snr_db, trials) in [(1, 20.0, 8), (4, -9.0, 4)] {
        let mut searcher = Searcher::new(SearchConfig::new(SPACING, antennas)).unwrap();
        for seed in 0..trials {
            let (cell, clean, mut rng) = scene(seed, antennas, snr_db);
            let found = is_found(&mut searcher, &cell, &clean);
            assert_eq!(searcher.tones().count(), 0);
            for above_ssb_db in ABOVE_SSB_DB {
                let cycles = cycles(seed, &mut rng);
                let mut samples = clean.clone();
                add_tone(&mut samples, cycles, above_ssb_db, &mut rng);
                assert_eq!(
                    is_found(&mut searcher, &cell, &samples),
                    found,
                    "{seed}: {above_ssb_db} dB"
                );
                // A tone 19 dB below the noise does no harm and need not be found.
                if snr_db + above_ssb_db < -10.0 {
                    continue;
                }
                let tones: Vec<Tone> = searcher.tones().collect();
                let [tone] = tones[..] else {
                    panic!("{seed}, {above_ssb_db} dB: {tones:?}");
                };
                let expected_dbfs = above_ssb_db + 10.0 * SSB_POWER.log10();
                let off_hz = tone.frequency_hz - cycles * SPACING.base_rate_hz();
                assert!(off_hz.abs() < 100.0, "{tone:?}");
                assert!((tone.power_dbfs - expected_dbfs).abs() < 0.5, "{tone:?}");
            }
        }
    }
}

/// Squared error of the phase between two antennas, by all pilots.
fn squared_error(cell: &Cell, gains: [num_complex::Complex64; 2]) -> f64 {
    let sent = cell.gains[1] * cell.gains[0].conj();
    let sent = num_complex::Complex64::new(f64::from(sent.re), f64::from(sent.im));
    (gains[1] * gains[0].conj() * sent.conj()).arg().powi(2)
}

#[test]
fn phases_between_antennas_are_as_without_tones() {
    let mut searcher = Searcher::new(SearchConfig::new(SPACING, 2)).unwrap();
    // Squared errors without a tone, with one of −10 dB and with one of 15 dB.
    let mut squares = [0.0; 3];
    for seed in 0..24 {
        let (mut cell, _, mut rng) = scene(100 + seed, 2, 20.0);
        cell.cfo_hz = 3000.0;
        let mut clean = silence(2, 38_400);
        cell.delay = 400.0;
        cell.add_to(&mut clean);
        add_noise(&mut clean, 20.0, &mut rng);
        searcher.tune(Some(cell.ssb_freq_hz)).unwrap();
        for (square, above_ssb_db) in squares.iter_mut().zip([-300.0, -10.0, 15.0]) {
            let mut samples = clean.clone();
            add_tone(&mut samples, cycles(seed, &mut rng), above_ssb_db, &mut rng);
            searcher.reset();
            let mut look = |_: &_, received: &nr_ssb::search::ReceivedSsb<'_>| {
                let sum = received.channel[0].iter().zip(&received.channel[1]);
                let both: Complex32 = sum.map(|(a, b)| a.conj() * b).sum();
                let both = num_complex::Complex64::new(f64::from(both.re), f64::from(both.im));
                *square += squared_error(&cell, [1.0.into(), both]);
            };
            let found = searcher.push_with(&slices(&samples), &mut look).unwrap();
            assert_eq!(found.len(), 1, "{seed}: {above_ssb_db} dB");
        }
    }
    // All three have equal noise, so that the difference is due to the tone: at most 1.1 times the
    // RMSE without it.
    let [without, weak, strong] = squares.map(f64::sqrt);
    assert!(weak < 1.1 * without, "{weak} {without}");
    assert!(strong < 1.1 * without, "{strong} {without}");
}

/// Three periods of a cell at the base rate.
fn three_periods(seed: u64, above_ssb_db: f64, cycles: f64) -> (Cell, Vec<Vec<Complex32>>) {
    let mut rng = rng(seed);
    let mut cell = Cell::random(&mut rng, SPACING, 2);
    cell.cfo_hz = 3000.0;
    let period = 153_600;
    let mut samples = silence(2, 3 * period);
    for number in 0..3 {
        let burst = Cell {
            delay: cell.delay + (number * period) as f64,
            sfn: (cell.sfn + 2 * number as u16) % 1024,
            ..cell.clone()
        };
        burst.add_to(&mut samples);
    }
    add_noise(&mut samples, 10.0, &mut rng);
    add_tone(&mut samples, cycles, above_ssb_db, &mut rng);
    (cell, samples)
}

#[test]
fn both_receivers_track_through_tones_and_report_them() {
    for (seed, above_ssb_db, cycles) in [
        (1, -300.0, 0.0),
        (1, -10.0, 0.0),
        (2, 10.0, 0.011),
        (3, 15.0, 0.0),
        (4, 20.0, -0.2),
    ] {
        let (cell, samples) = three_periods(seed, above_ssb_db, cycles);
        let tones = usize::from(above_ssb_db > -100.0);
        let config = ReceiverConfig::new(cell.ssb_freq_hz, SPACING, 2);
        let mut starts = Vec::new();
        let mut receiver =
            Receiver::new(config.clone(), SPACING.base_rate_hz(), cell.ssb_freq_hz).unwrap();
        for from in (0..samples[0].len()).step_by(10_000) {
            let to = samples[0].len().min(from + 10_000);
            let block: Vec<&[Complex32]> = samples.iter().map(|it| &it[from..to]).collect();
            receiver
                .push(&block, &mut |ssb| {
                    let [a, b] = [&ssb.channel[0], &ssb.channel[1]];
                    let both: Complex32 = a.iter().zip(b).map(|(a, b)| a.conj() * b).sum();
                    let both = num_complex::Complex64::new(f64::from(both.re), f64::from(both.im));
                    // Noise of 10 dB on 830 elements: 0.011 rad; five standard deviations.
                    let error = squared_error(&cell, [1.0.into(), both]).sqrt();
                    assert!(error < 0.055, "{above_ssb_db} dB: {error}");
                    starts.push(ssb.sample_start);
                })
                .unwrap();
        }
        assert_eq!(receiver.tones().len(), tones, "{above_ssb_db} dB");
        receiver
            .finish(&mut |ssb| starts.push(ssb.sample_start))
            .unwrap();
        assert_eq!(starts.len(), 3, "stream, {above_ssb_db} dB");

        let mut receiver = WindowReceiver::<2>::new(config).unwrap();
        let mut seen = 0;
        for number in 0..3 {
            // A window of 5 ms around each burst.
            let start = (cell.delay as usize).saturating_sub(300) + number * 153_600;
            let antennas: Vec<&[Complex32]> = samples
                .iter()
                .map(|it| &it[start..start + 40_000])
                .collect();
            let window = Window {
                start: start as i64,
                antennas: &antennas,
            };
            receiver
                .receive(&window, &mut |it| {
                    let gains =
                        |antenna: usize| it.ssb.blocks.iter().map(move |block| block[antenna]);
                    let both = gains(0).zip(gains(1)).map(|(a, b)| a.conj() * b).sum();
                    let error = squared_error(&cell, [1.0.into(), both]).sqrt();
                    assert!(error < 0.055, "{above_ssb_db} dB: {error}");
                    seen += 1;
                })
                .unwrap();
        }
        assert_eq!(seen, 3, "window, {above_ssb_db} dB");
        assert_eq!(receiver.tones().count(), tones, "{above_ssb_db} dB");
    }
}

#[test]
fn a_scan_of_the_band_finds_cells_through_tones() {
    let mut rng = rng(8);
    for (above_ssb_db, offset_hz) in [(15.0, 0.0), (15.0, 700e3)] {
        let mut cell = Cell::random(&mut rng, SPACING, 1);
        // Off the synchronization raster, so that both scans are made.
        cell.ssb_freq_hz = 3.5001e9;
        let mut samples = silence(1, 153_600);
        cell.add_to(&mut samples);
        add_noise(&mut samples, 20.0, &mut rng);
        add_tone(
            &mut samples,
            offset_hz / SPACING.base_rate_hz(),
            above_ssb_db,
            &mut rng,
        );
        let rate_hz = SPACING.base_rate_hz();
        let finds = scan(&slices(&samples), rate_hz, Some(cell.ssb_freq_hz)).unwrap();
        let is_there = finds
            .iter()
            .any(|find| find.ssbs.iter().any(|ssb| ssb.pci.get() == cell.pci));
        assert!(is_there, "{offset_hz} Hz: {finds:?}");
        let tones = nr_ssb::tones(&samples, rate_hz);
        assert_eq!(tones.len(), 1, "{tones:?}");
        assert!(
            (tones[0].frequency_hz - offset_hz).abs() < 100.0,
            "{tones:?}"
        );
    }
}

#[test]
fn windows_of_strong_ssbs_have_no_tones() {
    // From little more than one SSB to a quarter of a half frame, without noise and with little.
    let mut searcher = Searcher::new(SearchConfig::new(SPACING, 1)).unwrap();
    for (before, after) in [(16, 16), (100, 1000), (400, 3000), (400, 9000)] {
        for seed in 0..60 {
            let snr_db = if seed % 2 == 0 { 300.0 } else { 20.0 };
            // A whole number of samples of delay: interpolation would leave a line at half the sample rate.
            let mut rng = rng(1000 + seed);
            let mut cell = Cell::random(&mut rng, SPACING, 1);
            cell.delay = cell.delay.round();
            let mut samples = silence(1, 153_600);
            cell.add_to(&mut samples);
            add_noise(&mut samples, snr_db, &mut rng);
            let at = cell.ssb_start(cell.ssb_indices[0]) as usize;
            let cut = [samples[0][at - before..at + 1096 + after].to_vec()];
            searcher.tune(Some(cell.ssb_freq_hz)).unwrap();
            searcher.search(&slices(&cut)).unwrap();
            let tones: Vec<Tone> = searcher.tones().collect();
            assert!(tones.is_empty(), "{before} {after} {seed}: {tones:?}");
        }
    }
}
