//! Accuracy of the search's estimates, and errors for invalid input.

use crate::air;
use std::f64::consts::TAU;

use nr_ssb::front_end::{FrontEnd, FrontEndError};
use nr_ssb::search::{SearchConfig, SearchError, Searcher};
use nr_ssb::{Complex32, SubcarrierSpacing};
use proptest::prelude::*;

/// Returns the standard deviation of the frequency from the phase between PSS and SSS, 127 elements
/// each: `1/(2π · 2T √(127 Σ snr))`.
fn phase_bound_hz(spacing: SubcarrierSpacing, antennas: usize, snr_db: f64) -> f64 {
    let symbol_s = 274.0 / spacing.base_rate_hz();
    let snr = antennas as f64 * 10f64.powf(0.1 * snr_db);
    1.0 / (TAU * 2.0 * symbol_s * (127.0 * snr).sqrt())
}

#[test]
fn frequency_offset_reaches_1_2_times_the_phase_bound() {
    const TRIALS: usize = 150;
    let spacing = SubcarrierSpacing::Khz15;
    for (antennas, snr_db) in [(1, 0.0), (1, 10.0), (1, 20.0), (4, 0.0)] {
        let mut searcher = Searcher::new(SearchConfig::new(spacing, antennas)).unwrap();
        let mut squares = 0.0;
        for trial in 0..TRIALS {
            let mut rng = air::rng(trial as u64);
            let mut cell = air::Cell::random(&mut rng, spacing, antennas);
            cell.delay = 100.0 + cell.delay.fract();
            cell.ssb_indices = vec![0];
            let mut samples = air::silence(antennas, 2200);
            cell.add_to(&mut samples);
            air::add_noise(&mut samples, snr_db, &mut rng);
            searcher.tune(Some(cell.ssb_freq_hz)).unwrap();
            let found = searcher.search(&air::slices(&samples)).unwrap();
            let ssb = found.iter().find(|ssb| ssb.pci.get() == cell.pci).unwrap();
            squares += (ssb.cfo_hz - cell.cfo_hz).powi(2);
        }
        let rmse = (squares / TRIALS as f64).sqrt();
        let bound = phase_bound_hz(spacing, antennas, snr_db);
        println!("{antennas} antennas, {snr_db} dB: RMSE {rmse:.2} Hz, bound {bound:.2} Hz");
        // The RMSE of 150 trials has a standard error of 6 %.
        assert!(
            rmse < 1.2 * bound * 1.06,
            "{antennas}, {snr_db} dB: {rmse} of {bound}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_cell_is_decoded_and_measured_exactly(seed: u64, wide: bool, rate in 1_usize..5, offset in -0.5..0.5_f64) {
        let spacing = if wide { SubcarrierSpacing::Khz30 } else { SubcarrierSpacing::Khz15 };
        let mut rng = air::rng(seed);
        let mut cell = air::Cell::random(&mut rng, spacing, 2);
        cell.delay = 50.0 + cell.delay / 10.0;
        let mut samples = air::silence(2, 26_000);
        cell.add_to(&mut samples);
        air::add_noise(&mut samples, 15.0, &mut rng);
        // A recording has a multiple of the base rate, and the SSB is not at its centre.
        let room_hz = 0.5 * spacing.base_rate_hz() * (rate - 1) as f64;
        let offset_hz = offset * 2.0 * room_hz;
        let input_hz = spacing.base_rate_hz() * rate as f64;
        let recorded: Vec<_> =
            samples.iter().map(|x| air::raised(x, rate, offset_hz / input_hz)).collect();
        let mut front_end = FrontEnd::new(input_hz, offset_hz, spacing.hz(), 2).unwrap();
        let base = front_end.process(&air::slices(&recorded)).unwrap();
        prop_assert_eq!(base[0].len(), 26_000);
        let mut searcher = Searcher::new(SearchConfig {
            ssb_freq_hz: Some(cell.ssb_freq_hz),
            ..SearchConfig::new(spacing, 2)
        })
        .unwrap();
        let found = searcher.search(&air::slices(&base)).unwrap();
        prop_assert_eq!(found.len(), 1, "{:?}", found);
        let ssb = &found[0];
        let payload = ssb.payload.unwrap();
        prop_assert_eq!(ssb.pci.get(), cell.pci);
        prop_assert_eq!(payload.sfn(), cell.sfn);
        prop_assert_eq!(payload.half_frame, cell.half_frame);
        prop_assert_eq!(payload.ssb_index, cell.ssb_indices[0]);
        prop_assert_eq!(payload.mib, nr_ssb::Mib { sfn_msb: payload.mib.sfn_msb, ..cell.mib });
        prop_assert!((ssb.sample_start - cell.ssb_start(cell.ssb_indices[0])).abs() < 0.05);
        prop_assert!((ssb.cfo_hz - cell.cfo_hz).abs() < 6.0 * phase_bound_hz(spacing, 2, 15.0));
        for measured in ssb.measurements() {
            prop_assert!((measured.ss_sinr_db - 15.0).abs() < 1.5, "{:?}", measured);
        }
    }
}

/// Sample rates of common receivers, and their ratio to the base rate.
#[test]
fn rates_that_are_no_multiple_are_converted() {
    use SubcarrierSpacing::{Khz15, Khz30};
    for (spacing, rate_hz, up, down) in [
        (Khz30, 11.52e6, 3, 2),
        (Khz15, 5e6, 125, 96),
        (Khz15, 10e6, 125, 48),
        (Khz30, 10e6, 125, 96),
        (Khz15, 20e6, 625, 120),
        (Khz30, 20e6, 125, 48),
        (Khz30, 25e6, 625, 192),
        (Khz30, 50e6, 625, 96),
        (Khz30, 61.44e6, 8, 1),
    ] {
        let mut rng = air::rng(5);
        let mut cell = air::Cell::random(&mut rng, spacing, 1);
        cell.delay = 333.25;
        let mut samples = air::silence(1, 28_800);
        cell.add_to(&mut samples);
        air::add_noise(&mut samples, 15.0, &mut rng);
        let recorded = air::resampled(&samples[0], up, down);
        let mut front_end = FrontEnd::new(rate_hz, 0.0, spacing.hz(), 1).unwrap();
        // Blocks of a stream: no sample is lost or repeated between them.
        let mut base = vec![Vec::new()];
        for block in recorded.chunks(10_007) {
            front_end.push(&[block], &mut base).unwrap();
        }
        front_end.finish(&mut base);
        assert_eq!(base[0].len(), 28_800, "{rate_hz}");
        let mut searcher = Searcher::new(SearchConfig {
            ssb_freq_hz: Some(cell.ssb_freq_hz),
            ..SearchConfig::new(spacing, 1)
        })
        .unwrap();
        let found = searcher.search(&air::slices(&base)).unwrap();
        assert_eq!(found.len(), 1, "{rate_hz}");
        assert_eq!(found[0].payload.unwrap().sfn(), cell.sfn);
        assert!((found[0].snr_db - 15.0).abs() < 1.0, "{}", found[0].snr_db);
        assert!((found[0].sample_start - cell.ssb_start(cell.ssb_indices[0])).abs() < 0.05);
    }
}

#[test]
fn invalid_input_is_reported() {
    let spacing = SubcarrierSpacing::Khz15;
    let rate = |rate_hz| FrontEnd::new(rate_hz, 0.0, 15e3, 1).err();
    for rate_hz in [f64::NAN, f64::INFINITY, -7.68e6, 0.0, 1e300, 5.123_457e6] {
        let error = rate(rate_hz).unwrap();
        assert!(matches!(error, FrontEndError::Rate { .. }), "{rate_hz}");
    }
    for antennas in [0, 17, usize::MAX] {
        let error = FrontEnd::new(7.68e6, 0.0, 15e3, antennas).err();
        assert_eq!(error, Some(FrontEndError::Antennas(antennas)));
    }
    for scs_hz in [0.0, -15e3, f64::NAN, 1e-300] {
        let error = FrontEnd::new(7.68e6, 0.0, scs_hz, 1).err();
        assert!(
            matches!(error, Some(FrontEndError::Rate { .. })),
            "{scs_hz}"
        );
    }
    let wide = FrontEnd::new(3.84e6, 0.0, 30e3, 1).err();
    assert!(matches!(wide, Some(FrontEndError::RateTooLow { .. })));
    let outside = FrontEnd::new(23.04e6, 10e6, 30e3, 1).err();
    assert!(matches!(outside, Some(FrontEndError::OutOfBand { .. })));
    for antennas in [0, 17] {
        let error = Searcher::new(SearchConfig::new(spacing, antennas)).err();
        assert_eq!(error, Some(SearchError::Antennas(antennas)));
    }
    let bad = SearchConfig {
        false_alarm: 0.0,
        ..SearchConfig::new(spacing, 1)
    };
    assert!(matches!(
        Searcher::new(bad).err(),
        Some(SearchError::Setting { .. })
    ));

    let mut searcher = Searcher::new(SearchConfig::new(spacing, 2)).unwrap();
    let samples = vec![Complex32::ZERO; 4000];
    let too_short = SearchError::TooShort {
        samples: 500,
        needed: 1096,
    };
    assert_eq!(
        searcher.search(&[&samples[..500], &samples[..500]]),
        Err(too_short)
    );
    let unequal = SearchError::UnequalLengths {
        first: 4000,
        other: 10,
    };
    assert_eq!(searcher.search(&[&samples, &samples[..10]]), Err(unequal));
    let count = SearchError::AntennaCount {
        given: 1,
        expected: 2,
    };
    assert_eq!(searcher.search(&[&samples]), Err(count));
    assert_eq!(searcher.search(&[&samples, &samples]), Ok(&[][..]));
    assert!(searcher.tune(Some(f64::INFINITY)).is_err());
}

/// Broken channels do not keep the healthy ones from finding the cell.
#[test]
fn cells_are_detected_despite_silent_broken_or_duplicated_channels() {
    let spacing = SubcarrierSpacing::Khz15;
    let mut rng = air::rng(9);
    let cell = air::Cell::random(&mut rng, spacing, 4);
    let mut samples = air::silence(4, 38_400);
    cell.add_to(&mut samples);
    air::add_noise(&mut samples, 5.0, &mut rng);
    samples[1].fill(Complex32::ZERO);
    samples[2]
        .iter_mut()
        .step_by(97)
        .for_each(|x| x.re = f32::NAN);
    samples[3] = samples[0].clone();
    let mut searcher = Searcher::new(SearchConfig {
        ssb_freq_hz: Some(cell.ssb_freq_hz),
        ..SearchConfig::new(spacing, 4)
    })
    .unwrap();
    let found = searcher.search(&air::slices(&samples)).unwrap();
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].pci.get(), cell.pci);
    assert_eq!(found[0].payload.unwrap().sfn(), cell.sfn);
}
