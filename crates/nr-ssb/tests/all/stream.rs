//! Streams: SSBs across block boundaries, several cells at one raster point, combined periods.

use crate::air;
use nr_ssb::SubcarrierSpacing;
use nr_ssb::search::{SearchConfig, Searcher};

const SPACING: SubcarrierSpacing = SubcarrierSpacing::Khz15;
const FRAME: usize = 38_400;

fn cell(seed: u64, antennas: usize) -> air::Cell {
    air::Cell::random(&mut air::rng(seed), SPACING, antennas)
}

fn config(cell: &air::Cell) -> SearchConfig {
    SearchConfig {
        ssb_freq_hz: Some(cell.ssb_freq_hz),
        ..SearchConfig::new(SPACING, cell.gains.len())
    }
}

#[test]
fn every_ssb_of_a_stream_is_found_once_for_any_block_boundaries() {
    let mut cell = cell(3, 2);
    cell.ssb_indices = vec![0, 1, 2, 3];
    cell.delay = 700.4;
    let mut samples = air::silence(2, FRAME / 2);
    cell.add_to(&mut samples);
    air::add_noise(&mut samples, 10.0, &mut air::rng(4));
    for block in [300, 1000, 1097, 1500, 2741, FRAME] {
        let mut searcher = Searcher::new(config(&cell)).unwrap();
        let mut starts = Vec::new();
        for first in (0..FRAME / 2).step_by(block) {
            let end = (first + block).min(FRAME / 2);
            let blocks: Vec<_> = samples.iter().map(|antenna| &antenna[first..end]).collect();
            let found = searcher.push(&blocks).unwrap();
            starts.extend(found.iter().map(|ssb| (ssb.ssb_index, ssb.sample_start)));
        }
        assert_eq!(starts.len(), 4, "block {block}: {starts:?}");
        for (index, start) in starts {
            assert!(
                (start - cell.ssb_start(index)).abs() < 0.1,
                "block {block}: {start}"
            );
        }
    }
}

/// Three cells of a synchronised network transmit simultaneously; the weakest one is 15 dB below
/// the strongest.
#[test]
fn all_cells_of_one_raster_point_are_found() {
    let mut samples = air::silence(4, FRAME);
    let mut cells = [cell(10, 4), cell(11, 4), cell(12, 4)];
    // Two cells have the same PSS.
    for (cell, (pci, level)) in cells.iter_mut().zip([(300, 1.0), (601, 0.4), (903, 0.18)]) {
        cell.pci = pci;
        cell.lmax = nr_ssb::Lmax::L8;
        cell.ssb_freq_hz = 3.6e9;
        cell.ssb_indices = vec![2];
        cell.delay = 1000.0 + f64::from(pci) / 300.0;
        cell.cfo_hz *= 0.02;
        cell.gains.iter_mut().for_each(|gain| *gain *= level);
        cell.add_to(&mut samples);
    }
    air::add_noise(&mut samples, 20.0, &mut air::rng(13));
    let mut searcher = Searcher::new(config(&cells[0])).unwrap();
    let found = searcher.search(&air::slices(&samples)).unwrap();
    assert_eq!(found.len(), 3, "{found:?}");
    for cell in &cells {
        let ssb = found.iter().find(|ssb| ssb.pci.get() == cell.pci).unwrap();
        assert_eq!(ssb.payload.unwrap().sfn(), cell.sfn);
        assert!((ssb.sample_start - cell.ssb_start(2)).abs() < 0.1);
    }
}

/// Adds interference to the symbols that contain only PBCH, so that an SSB is detected but cannot
/// be decoded by itself.
fn disturb_pbch(samples: &mut [Vec<nr_ssb::Complex32>], start: f64, seed: u64) {
    for symbol in [1, 3] {
        let first = start as usize + 274 * symbol;
        let mut noise = air::silence(1, 274);
        air::add_noise(&mut noise, -12.0, &mut air::rng(seed + symbol as u64));
        for (sample, noise) in samples[0][first..].iter_mut().zip(&noise[0]) {
            *sample += noise;
        }
    }
}

#[test]
fn four_periods_decode_below_the_limit_of_one() {
    for period_frames in [1_u16, 2, 4] {
        let mut decoded = [0, 0];
        for seed in 0..10 {
            let mut cell = cell(20 + seed, 1);
            // The high bits of the SFN do not change within the four periods.
            cell.sfn = 16 * (cell.sfn / 16) + 1;
            let (first_sfn, first_start) = (cell.sfn, cell.delay);
            let mut samples = air::silence(1, FRAME * usize::from(4 * period_frames));
            for period in 0..4 {
                cell.sfn = first_sfn + period * period_frames;
                cell.delay = first_start + (FRAME * usize::from(period * period_frames)) as f64;
                cell.add_to(&mut samples);
                let start = cell.ssb_start(cell.ssb_indices[0]);
                disturb_pbch(&mut samples, start, 1000 * seed + 10 * u64::from(period));
            }
            air::add_noise(&mut samples, -3.0, &mut air::rng(100 + seed));
            let mut searcher = Searcher::new(config(&cell)).unwrap();
            for (decoded, length) in decoded.iter_mut().zip([FRAME, samples[0].len()]) {
                let found = searcher.search(&[&samples[0][..length]]).unwrap();
                for ssb in found.iter().filter(|ssb| ssb.payload.is_some()) {
                    let frames = ((ssb.sample_start - first_start) / FRAME as f64).floor() as u16;
                    assert_eq!(ssb.payload.unwrap().sfn(), first_sfn + frames);
                    *decoded += 1;
                }
            }
        }
        println!("period {period_frames} frames: {decoded:?} of [10, 40]");
        assert!(decoded[0] <= 5 && decoded[1] >= 32, "{decoded:?}");
    }
}
