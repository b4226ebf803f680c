//! Burst set size and SSB index: Lmax 4, 8 and 64.

use crate::air::{Cell, add_noise, raised, rng, silence, slices};
use nr_ssb::raster::scan_raster;
use nr_ssb::search::{DetectedSsb, SearchConfig, Searcher};
use nr_ssb::track::Tracker;
use nr_ssb::{Lmax, SubcarrierSpacing};

const ANTENNAS: usize = 2;

fn found(cell: &Cell, ssb_freq_hz: Option<f64>, snr_db: f64) -> Vec<DetectedSsb> {
    let samples = (cell.delay + 6e-3 * cell.spacing.base_rate_hz()) as usize;
    let mut antennas = silence(ANTENNAS, samples);
    cell.add_to(&mut antennas);
    add_noise(&mut antennas, snr_db, &mut rng(1));
    let config = SearchConfig {
        ssb_freq_hz,
        ..SearchConfig::new(cell.spacing, ANTENNAS)
    };
    let mut searcher = Searcher::new(config).unwrap();
    searcher.search(&slices(&antennas)).unwrap().to_vec()
}

/// Build, search, decode and track at 120 and 240 kHz.
#[test]
fn sixty_four_beams_of_frequency_range_2_are_received() {
    for spacing in [SubcarrierSpacing::Khz120, SubcarrierSpacing::Khz240] {
        let mut cell = Cell::random(&mut rng(7), spacing, ANTENNAS);
        cell.ssb_indices = vec![3, 11, 40, 63];
        let ssbs = found(&cell, Some(cell.ssb_freq_hz), 0.0);
        let indices: Vec<u8> = ssbs.iter().map(|ssb| ssb.ssb_index).collect();
        assert_eq!(indices, cell.ssb_indices, "{spacing:?}");
        for ssb in &ssbs {
            let payload = ssb.payload.unwrap();
            assert_eq!((ssb.pci.get(), ssb.lmax), (cell.pci, Some(Lmax::L64)));
            assert_eq!(
                (payload.sfn(), payload.mib.pdcch_config_sib1),
                (cell.sfn, cell.mib.pdcch_config_sib1)
            );
            assert_eq!(ssb.half_frame, Some(cell.half_frame));
            let start = cell.ssb_start(ssb.ssb_index);
            assert!((ssb.sample_start - start).abs() < 0.2);
        }
        // Tracked without decoding, beams 3 and 11 with the same DM-RS as 3, 11, 19, …
        let mut antennas = silence(
            ANTENNAS,
            (cell.delay + 6e-3 * spacing.base_rate_hz()) as usize,
        );
        cell.add_to(&mut antennas);
        add_noise(&mut antennas, 5.0, &mut rng(2));
        let config = SearchConfig {
            ssb_freq_hz: Some(cell.ssb_freq_hz),
            ..SearchConfig::new(spacing, ANTENNAS)
        };
        let window = slices(&antennas);
        let mut tracker = Tracker::new(&config, &ssbs[0]).unwrap();
        for pair in cell.ssb_indices.windows(2) {
            let samples = cell.ssb_start(pair[1]) - cell.ssb_start(pair[0]);
            let expected = tracker.expected_start(samples);
            let tracked = tracker.track(&window, 0.0, expected, false).unwrap();
            assert_eq!(tracked.unwrap().ssb_index, pair[1], "{spacing:?}");
        }
    }
}

/// The raster of frequency range 2, its points 17.28 MHz apart.
#[test]
fn a_scan_above_24_ghz_searches_120_and_240_khz() {
    let mut cell = Cell::random(&mut rng(5), SubcarrierSpacing::Khz120, 1);
    cell.ssb_indices = vec![17];
    cell.ssb_freq_hz = 24.25008e9 + 160.0 * 17.28e6;
    let mut antennas = silence(1, (5e-3 * 30.72e6) as usize);
    cell.add_to(&mut antennas);
    add_noise(&mut antennas, 10.0, &mut rng(3));
    // The centre of the recording is 10 MHz below the SSB.
    let wide = raised(&antennas[0], 2, 10e6 / 61.44e6);
    let finds = scan_raster(&[&wide], 61.44e6, cell.ssb_freq_hz - 10e6).unwrap();
    let [find] = finds.as_slice() else {
        panic!("{finds:?}");
    };
    assert_eq!(find.point.gscn, Some(22_256 + 160));
    assert_eq!(find.spacing, SubcarrierSpacing::Khz120);
    assert_eq!(
        (find.ssbs[0].pci.get(), find.ssbs[0].ssb_index),
        (cell.pci, 17)
    );
}

/// Without a known frequency, the first four SSBs of a frame are identical for Lmax 4 and 8.
#[test]
fn an_unknown_burst_set_size_is_determined_by_the_first_decoded_ssb() {
    let mut cell = Cell::random(&mut rng(9), SubcarrierSpacing::Khz30, ANTENNAS);
    (cell.lmax, cell.half_frame, cell.ssb_indices) = (Lmax::L8, false, vec![1]);
    let [ssb] = found(&cell, None, 10.0).try_into().unwrap();
    assert_eq!((ssb.lmax, ssb.ssb_index), (None, 1));
    assert!(ssb.payload.is_some());
    // Bands at 30 kHz and 3.7 GHz have Lmax 8, the unpaired band n38 as well, but n66 has 4.
    for (ssb_freq_hz, lmax) in [
        (3.7008e9, Lmax::L8),
        (2.595e9, Lmax::L8),
        (2.15e9, Lmax::L4),
    ] {
        cell.ssb_freq_hz = ssb_freq_hz;
        let [ssb] = found(&cell, Some(ssb_freq_hz), 10.0).try_into().unwrap();
        assert_eq!((ssb.lmax, ssb.ssb_index), (Some(lmax), 1));
    }
    // The sixth SSB exists only for Lmax 8, which then also applies to the first one.
    cell.ssb_indices = vec![1, 5];
    let ssbs = found(&cell, None, 10.0);
    let indices: Vec<_> = ssbs.iter().map(|ssb| (ssb.ssb_index, ssb.lmax)).collect();
    assert_eq!(indices, [(1, Some(Lmax::L8)), (5, Some(Lmax::L8))]);
}
