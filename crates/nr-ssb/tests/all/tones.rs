//! DC offset and tones are detected, removed and reported; SSBs and channels equal those without
//! tones.

use std::f64::consts::TAU;

use crate::air::{Cell, add_noise, phasor, raised, receivers, rng, silence, slices};
use nr_ssb::raster::scan;
use nr_ssb::receiver::ReceiverConfig;
use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::{Complex32, SubcarrierSpacing, Tone};
use num_complex::Complex64;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const SPACING: SubcarrierSpacing = SubcarrierSpacing::Khz30;

/// Powers of a tone relative to the SSB's.
const ABOVE_SSB_DB: [f64; 5] = [-10.0, 0.0, 10.0, 15.0, 20.0];
/// Power of an SSB: 240 subcarriers of unit power, divided by the squared length of the transform.
const SSB_POWER: f64 = 240.0 / 65536.0;

/// Adds a tone with a power of `above_ssb_db` relative to an SSB of unit resource elements, and
/// with a random gain for each antenna.
fn add_tone(samples: &mut [Vec<Complex32>], cycles: f64, above_ssb_db: f64, rng: &mut ChaCha8Rng) {
    let amplitude = (10f64.powf(0.1 * above_ssb_db) * SSB_POWER).sqrt();
    for antenna in samples {
        let turn = rng.random_range(0.0..TAU);
        for (n, x) in antenna.iter_mut().enumerate() {
            *x += phasor(turn + TAU * cycles * n as f64) * amplitude as f32;
        }
    }
}

/// Creates a cell with one SSB in 20 ms.
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

/// Returns the frequency: DC in every second scene, otherwise random.
fn cycles(seed: u64, rng: &mut ChaCha8Rng) -> f64 {
    if seed.is_multiple_of(2) {
        0.0
    } else {
        rng.random_range(-0.5..0.5)
    }
}

#[test]
fn a_search_with_tones_equals_one_without_and_reports_them() {
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
                // A tone 19 dB below the noise has no effect and need not be detected.
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

/// Returns the squared error of the phase between two antennas, from all pilots.
fn squared_error(cell: &Cell, gains: [Complex64; 2]) -> f64 {
    let sent = cell.gains[1] * cell.gains[0].conj();
    let sent = Complex64::new(f64::from(sent.re), f64::from(sent.im));
    (gains[1] * gains[0].conj() * sent.conj()).arg().powi(2)
}

#[test]
fn tones_do_not_change_the_phases_between_antennas() {
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
            let mut inspect = |_: &_, received: &nr_ssb::search::ReceivedElements<'_>| {
                let sum = received.channel[0].iter().zip(&received.channel[1]);
                let both: Complex32 = sum.map(|(a, b)| a.conj() * b).sum();
                let both = Complex64::new(f64::from(both.re), f64::from(both.im));
                *square += squared_error(&cell, [1.0.into(), both]);
            };
            let found = searcher.push_with(&slices(&samples), &mut inspect).unwrap();
            assert_eq!(found.len(), 1, "{seed}: {above_ssb_db} dB");
        }
    }
    // All three have equal noise, so that the difference is due to the tone: at most 1.1 times the
    // RMSE without it.
    let [without, weak, strong] = squares.map(f64::sqrt);
    assert!(weak < 1.1 * without, "{weak} {without}");
    assert!(strong < 1.1 * without, "{strong} {without}");
}

/// Creates three periods of a cell at the base rate.
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
    // Noise of 10 dB on 830 elements: 0.011 rad; five standard deviations.
    const MAX_RAD: f64 = 0.055;
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
        let error = |both: Complex64| squared_error(&cell, [1.0.into(), both]).sqrt();

        let mut errors = Vec::new();
        let at_hz = [SPACING.base_rate_hz(), cell.ssb_freq_hz];
        let reported = receivers::stream(config.clone(), at_hz, &samples, &mut |mut beam| {
            let ssb = beam.tracked_ssb();
            let both = ssb.channel[0].iter().zip(&ssb.channel[1]);
            let both: Complex32 = both.map(|(a, b)| a.conj() * b).sum();
            errors.push(error(Complex64::new(both.re.into(), both.im.into())));
        });
        assert_eq!(reported.len(), tones, "stream, {above_ssb_db} dB");
        assert_eq!(errors.len(), 3, "stream, {above_ssb_db} dB");
        assert!(errors.iter().all(|it| *it < MAX_RAD), "{errors:?}");

        let mut errors = Vec::new();
        let first = (cell.delay as usize).saturating_sub(300);
        let reported = receivers::windows(config, (first, 3), &samples, &mut |seen| {
            let blocks = seen.ssb.blocks.iter();
            errors.push(error(blocks.map(|it| it[0].conj() * it[1]).sum()));
        });
        assert_eq!(reported.len(), tones, "window, {above_ssb_db} dB");
        assert_eq!(errors.len(), 3, "window, {above_ssb_db} dB");
        assert!(errors.iter().all(|it| *it < MAX_RAD), "{errors:?}");
    }
}

/// The stream receiver converts samples of a wider band: tones inside and outside the SSB's band.
#[test]
fn a_stream_of_a_wide_band_is_tracked_through_tones() {
    let rate_hz = 2.0 * SPACING.base_rate_hz();
    let offset_hz = 1.44e6;
    // Frequencies from the centre of the recording; DC and 3 MHz are inside the SSB's band.
    let tones_hz = [0.0, 3e6, -6.5e6];
    for above_ssb_db in ABOVE_SSB_DB {
        let (cell, samples) = three_periods(11, -300.0, 0.0);
        let cycles = offset_hz / rate_hz;
        let mut wide: Vec<_> = samples.iter().map(|it| raised(it, 2, cycles)).collect();
        // Noise in the whole band with at most the density in the SSB's band.
        let mut rng = rng(12);
        add_noise(&mut wide, 10.0, &mut rng);
        for hz in tones_hz {
            add_tone(&mut wide, hz / rate_hz, above_ssb_db, &mut rng);
        }
        let config = ReceiverConfig::new(cell.ssb_freq_hz, SPACING, 2);
        let at_hz = [rate_hz, cell.ssb_freq_hz - offset_hz];
        let mut starts = Vec::new();
        let reported = receivers::stream(config, at_hz, &wide, &mut |beam| {
            starts.push(beam.ssb.sample_start);
        });
        let first = cell.ssb_start(cell.ssb_indices[0]);
        assert_eq!(starts.len(), 3, "{above_ssb_db} dB");
        for (number, start) in starts.iter().enumerate() {
            let off = start - first - 153_600.0 * number as f64;
            assert!(off.abs() < 1.0, "{above_ssb_db} dB: {off}");
        }
        for hz in &tones_hz[..2] {
            let is_reported = |tone: &Tone| (tone.frequency_hz + offset_hz - hz).abs() < 200.0;
            assert!(
                reported.iter().any(is_reported),
                "{above_ssb_db} dB: {reported:?}"
            );
        }
    }
}

/// A recording that was resampled to twice its rate has a part of the band without noise.
#[test]
fn a_scan_finds_cells_in_a_band_that_is_empty_in_part() {
    let rate_hz = 2.0 * SPACING.base_rate_hz();
    let offset_hz = 1.44e6;
    for seed in 0..4 {
        let (mut cell, _, mut rng) = scene(1000 + seed, 1, 20.0);
        // Off the synchronization raster.
        cell.ssb_freq_hz = 3.5001e9;
        let mut samples = silence(1, 40_000);
        cell.delay = 1000.0;
        cell.add_to(&mut samples);
        add_noise(&mut samples, 20.0, &mut rng);
        let mut samples = vec![raised(&samples[0], 2, offset_hz / rate_hz)];
        // Every second recording has tones in the empty part and next to the SSB.
        let tones_hz: &[f64] = if seed % 2 == 0 { &[] } else { &[-5.6e6, 0.0] };
        for hz in tones_hz {
            add_tone(&mut samples, hz / rate_hz, 15.0, &mut rng);
        }
        let centre_hz = cell.ssb_freq_hz - offset_hz;
        let finds = scan(&slices(&samples), rate_hz, Some(centre_hz)).unwrap();
        let found: Vec<_> = finds
            .iter()
            .map(|it| (it.point.ssb_freq_hz, it.ssbs[0].pci.get()))
            .collect();
        assert_eq!(found, [(cell.ssb_freq_hz, cell.pci)], "{seed}");
        assert_eq!(
            nr_ssb::tones(&samples, rate_hz).len(),
            tones_hz.len(),
            "{seed}"
        );
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
    // Lengths from one SSB to a quarter of a half frame, without noise and with weak noise.
    let mut searcher = Searcher::new(SearchConfig::new(SPACING, 1)).unwrap();
    for (before, after) in [(16, 16), (100, 1000), (400, 3000), (400, 9000)] {
        for seed in 0..60 {
            let snr_db = if seed % 2 == 0 { 300.0 } else { 20.0 };
            // The delay is an integer number of samples, because interpolation would cause a line
            // at half the sample rate.
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
