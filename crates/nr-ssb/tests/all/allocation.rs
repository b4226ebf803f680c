//! A receiver does not allocate memory after its buffers have grown.

use crate::air;
use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::track::Tracker;
use nr_ssb::{BchPayload, Beam, Burst, Case, Lmax, Mib, Numerology, Ofdm, Pci, SubcarrierSpacing};

use crate::counting::allocations;

/// Returns 20 ms with one SSB at four antennas, and the settings of its search.
fn scene(snr_db: f64) -> (SearchConfig, Vec<Vec<nr_ssb::Complex32>>) {
    let mut rng = air::rng(1);
    let cell = air::Cell::random(&mut rng, SubcarrierSpacing::Khz15, 4);
    let mut samples = air::silence(4, 76_800);
    cell.add_to(&mut samples);
    air::add_noise(&mut samples, snr_db, &mut rng);
    let config = SearchConfig {
        ssb_freq_hz: Some(cell.ssb_freq_hz),
        ..SearchConfig::new(SubcarrierSpacing::Khz15, 4)
    };
    (config, samples)
}

#[test]
fn allocations_are_counted() {
    assert_eq!(
        allocations(|| drop(std::hint::black_box(vec![0_u8; 100]))),
        1
    );
}

#[test]
fn a_warm_search_allocates_nothing() {
    // At the lower level the PBCH does not decode and is kept for combining.
    for snr_db in [5.0, -9.5] {
        let (config, samples) = scene(snr_db);
        let slices = air::slices(&samples);
        let mut searcher = Searcher::new(config).unwrap();
        let found = searcher.search(&slices).unwrap().len();
        assert_eq!(found, 1, "{snr_db} dB");
        let count = allocations(|| assert_eq!(searcher.search(&slices).unwrap().len(), found));
        assert_eq!(count, 0, "{snr_db} dB");
        let mut pushed = 0;
        for block in 0..4 {
            let count = allocations(|| pushed += searcher.push(&slices).unwrap().len());
            assert!(
                block < 2 || count == 0,
                "{snr_db} dB, block {block}: {count}"
            );
        }
        assert!(pushed >= 3);
    }
}

#[test]
fn warm_tracking_allocates_nothing() {
    let (config, samples) = scene(5.0);
    let slices = air::slices(&samples);
    let mut searcher = Searcher::new(config.clone()).unwrap();
    let cell = searcher.search(&slices).unwrap()[0].clone();
    let mut tracker = Tracker::new(&config, &cell).unwrap();
    let start = cell.sample_start;
    // SSB at the expected time, without and with the PBCH; near the expected time; and missing.
    let silent = vec![vec![nr_ssb::Complex32::ZERO; 76_800]; 4];
    let nothing = air::slices(&silent);
    let mut visit = || {
        for (window, expected, decode_pbch, there) in [
            (&slices, start, false, true),
            (&slices, start, true, true),
            (&slices, start + 5.0, false, true),
            (&slices, start + 5_000.0, false, false),
            (&nothing, start, false, false),
        ] {
            let seen = tracker.track(window, 0.0, expected, decode_pbch).unwrap();
            assert_eq!(seen.is_some(), there);
            let observed = seen.and_then(|ssb| tracker.observe(&ssb));
            assert_eq!(observed.is_some(), there);
        }
    };
    visit();
    assert_eq!(allocations(visit), 0);
}

#[test]
fn adding_a_burst_allocates_nothing() {
    let burst = Burst {
        pci: Pci::new(601).unwrap(),
        case: Case::C,
        lmax: Lmax::L8,
        payload: BchPayload::new(Mib::default(), 341, false, 0).unwrap(),
        beams: (0..8).map(Beam::new).collect(),
        ssb_freq_hz: Some(3.7008e9),
    };
    let numerology = Numerology::new(Case::C.spacing(), 512).unwrap();
    let mut ofdm = Ofdm::new(numerology);
    let mut half_frame = vec![nr_ssb::Complex32::ZERO; numerology.half_frame_len()];
    let mut add = || burst.add_to(&mut ofdm, &mut half_frame).unwrap();
    add();
    assert_eq!(allocations(add), 0);
    assert!(half_frame.iter().any(|x| x.norm_sqr() > 0.0));
}
