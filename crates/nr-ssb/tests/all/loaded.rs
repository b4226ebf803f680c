//! Cells next to a loaded neighbour, and strong ones with a corrupted message.

use crate::air;
use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::{Complex32, Lmax, Numerology, Ofdm, SubcarrierSpacing};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const SPACING: SubcarrierSpacing = SubcarrierSpacing::Khz30;
const SAMPLES: usize = 153_600;

/// Returns continuous OFDM in the whole band: QPSK on 240 subcarriers with unit power per element.
fn loaded(rng: &mut ChaCha8Rng) -> Vec<Complex32> {
    let mut ofdm = Ofdm::new(Numerology::new(SPACING, 256).unwrap());
    let mut samples = vec![Complex32::ZERO; SAMPLES.next_multiple_of(274)];
    for symbol in samples.chunks_exact_mut(274) {
        let quarter = std::f32::consts::FRAC_PI_4;
        let subcarriers: [Complex32; 240] = std::array::from_fn(|_| {
            Complex32::cis(quarter * (2.0 * f32::from(rng.random_range(0..4_u8)) + 1.0))
        });
        ofdm.modulate(&subcarriers, symbol).unwrap();
    }
    samples
}

#[test]
fn a_loaded_neighbour_gives_few_candidates_and_does_not_mask_a_weak_cell() {
    let trials = 40;
    let (mut found, mut most, mut false_cells) = (0, 0, 0);
    for trial in 0..trials {
        let mut rng = air::rng(900 + trial);
        let mut cell = air::Cell::random(&mut rng, SPACING, 4);
        cell.lmax = Lmax::L8;
        let mut samples = air::silence(4, SAMPLES);
        cell.add_to(&mut samples);
        // A neighbour with the power of the cell, from another direction.
        let neighbour = loaded(&mut rng);
        for antenna in &mut samples {
            let gain = Complex32::cis(6.2 * rng.random::<f32>());
            for (sample, x) in antenna.iter_mut().zip(&neighbour) {
                *sample += x * gain;
            }
        }
        air::add_noise(&mut samples, 10.0, &mut rng);
        let config = SearchConfig {
            ssb_freq_hz: Some(cell.ssb_freq_hz),
            ..SearchConfig::new(SPACING, 4)
        };
        let mut searcher = Searcher::new(config).unwrap();
        let cells = searcher.search(&air::slices(&samples)).unwrap();
        found += u32::from(cells.iter().any(|it| it.pci.get() == cell.pci));
        let others = cells.iter().filter(|it| it.pci.get() != cell.pci);
        false_cells += others.count();
        most = most.max(searcher.counts().pss_candidates);
    }
    println!("{found} of {trials} found, {false_cells} false, at most {most} candidates");
    assert_eq!(false_cells, 0);
    assert_eq!(u64::from(found), trials);
    assert!(most <= 10, "{most}");
}

/// A transmitter under test may send an undecodable PBCH; the cell is detected nevertheless.
#[test]
fn a_strong_cell_with_an_undecodable_message_is_reported_without_the_message() {
    let mut rng = air::rng(31);
    let mut cell = air::Cell::random(&mut rng, SPACING, 2);
    cell.lmax = Lmax::L8;
    cell.ssb_indices = vec![2];
    let mut samples = air::silence(2, 38_400);
    cell.add_to(&mut samples);
    // Replace the two symbols that contain PBCH on all subcarriers.
    let other = loaded(&mut rng);
    let start = cell.ssb_start(2) as usize;
    for antenna in &mut samples {
        for symbol in [start + 274, start + 3 * 274] {
            antenna[symbol..symbol + 274].copy_from_slice(&other[symbol..symbol + 274]);
        }
    }
    air::add_noise(&mut samples, 20.0, &mut rng);
    let config = SearchConfig {
        ssb_freq_hz: Some(cell.ssb_freq_hz),
        ..SearchConfig::new(SPACING, 2)
    };
    let mut searcher = Searcher::new(config).unwrap();
    let found = searcher.search(&air::slices(&samples)).unwrap();
    let seen: Vec<_> = found.iter().map(|it| (it.pci.get(), it.payload)).collect();
    assert_eq!(seen, [(cell.pci, None)]);
}
