//! Front end, diagnosis, search and tracking on arbitrary samples.
//!
//! Random samples would never contain a cell. Therefore, the samples are one SSB in silence, and the
//! input describes changes to them. Byte 0: subcarrier spacing, antennas, whether the frequency is
//! known, whether the front end is applied. Byte 1: the cell. Byte 2: position of its SSB. Byte 3:
//! number of samples. Then changes of 8 bytes each: kind, first sample (2 bytes), number of samples,
//! value (f32).

use std::cell::RefCell;

use nr_ssb::burst::ssb_grid;
use nr_ssb::diagnose::diagnose;
use nr_ssb::front_end::FrontEnd;
use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::track::Tracker;
use nr_ssb::{BchPayload, Complex32, Lmax, Mib, Numerology, Ofdm, Pci, SubcarrierSpacing};

const SPACINGS: [SubcarrierSpacing; 2] = [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30];
const MAX_ANTENNAS: usize = 4;

thread_local! {
    /// Cached searchers, because planning takes longer than a search.
    static SEARCHERS: RefCell<Vec<Searcher>> = RefCell::new(
        SPACINGS
            .into_iter()
            .flat_map(|spacing| {
                (1..=MAX_ANTENNAS).map(move |antennas| {
                    Searcher::new(SearchConfig::new(spacing, antennas)).expect("allowed")
                })
            })
            .collect(),
    );
}

pub fn run(data: &[u8]) {
    let [settings, cell, start, length, damages @ ..] = data else {
        return;
    };
    let spacing_index = usize::from(settings & 1);
    let antenna_count = 1 + usize::from(settings >> 1 & 3);
    let samples = 12 * usize::from(*length);
    let mut antennas = vec![vec![Complex32::ZERO; samples]; antenna_count];
    let sent = ssb(SPACINGS[spacing_index], u16::from(*cell) * 3);
    for antenna in &mut antennas {
        let place = antenna.iter_mut().skip(8 * usize::from(*start));
        place.zip(&sent).for_each(|(sample, x)| *sample = *x);
    }
    for damage in damages.as_chunks::<8>().0 {
        spoil(&mut antennas, *damage);
    }
    let slices: Vec<&[Complex32]> = antennas.iter().map(Vec::as_slice).collect();
    assert_eq!(diagnose(&slices).len(), antenna_count);
    if settings >> 4 & 1 == 1 {
        let rate_hz = 3.84e6 * f64::from(1 + (settings >> 5));
        let offset_hz = f64::from(i32::from(*start) - 128) * 15e3;
        let scs_hz = SPACINGS[spacing_index].hz();
        if let Ok(mut front_end) = FrontEnd::new(rate_hz, offset_hz, scs_hz, antenna_count) {
            let base = front_end.process(&slices).expect("channels of one length");
            let slices: Vec<&[Complex32]> = base.iter().map(Vec::as_slice).collect();
            receive(spacing_index, settings >> 3 & 1 == 1, &slices);
        }
    } else {
        receive(spacing_index, settings >> 3 & 1 == 1, &slices);
    }
}

/// Samples of one SSB at 256 samples a symbol.
fn ssb(spacing: SubcarrierSpacing, pci: u16) -> Vec<Complex32> {
    let pci = Pci::new(pci).expect("below 1008");
    let payload = BchPayload::new(Mib::default(), 5, false, 1).expect("in range");
    let grid = ssb_grid(pci, Lmax::L8, &payload).expect("in range");
    let mut ofdm = Ofdm::new(Numerology::new(spacing, 256).expect("256"));
    let mut samples = vec![Complex32::ZERO; 4 * 274];
    for (symbol, subcarriers) in samples.chunks_exact_mut(274).zip(grid.symbols()) {
        ofdm.modulate(subcarriers, symbol).expect("274 samples");
    }
    samples
}

fn spoil(antennas: &mut [Vec<Complex32>], damage: [u8; 8]) {
    let [what, low, high, count, value @ ..] = damage;
    let value = f32::from_le_bytes(value);
    let first = usize::from(low) | usize::from(high) << 8;
    let source = usize::from(what >> 4) % antennas.len();
    let other = antennas[source].clone();
    let target = usize::from(what >> 2 & 3) % antennas.len();
    let places = antennas[target].iter_mut().zip(other);
    for (sample, other) in places.skip(first % 4096).take(16 * usize::from(count)) {
        match what & 3 {
            0 => *sample = Complex32::new(value, value),
            1 => *sample *= value,
            2 => *sample += Complex32::new(value, -value),
            _ => *sample = other,
        }
    }
}

fn receive(spacing_index: usize, frequency_known: bool, antennas: &[&[Complex32]]) {
    SEARCHERS.with_borrow_mut(|searchers| {
        let searcher = &mut searchers[spacing_index * MAX_ANTENNAS + antennas.len() - 1];
        let frequency = frequency_known.then_some(3.5e9);
        searcher.tune(frequency).expect("a finite frequency");
        let config = searcher.config().clone();
        let samples = antennas[0].len();
        let Ok(found) = searcher.search(antennas) else {
            return;
        };
        for ssb in found {
            assert!(
                (-20.0..samples as f64).contains(&ssb.sample_start),
                "{ssb:?}"
            );
            assert!(ssb.cfo_hz.abs() <= config.spacing.hz());
            assert_eq!(ssb.measurements().len(), antennas.len());
            if let Ok(mut tracker) = Tracker::new(&config, ssb) {
                for expected in [ssb.sample_start, ssb.sample_start + 3.0, 1e30] {
                    // An error and an empty result are both valid.
                    if let Ok(Some(tracked)) = tracker.track(antennas, 0.0, expected, true) {
                        assert!((-20.0..samples as f64).contains(&tracked.sample_start));
                        assert!(tracked.cfo_hz.is_finite());
                    }
                }
            }
        }
        // Two blocks of these samples.
        searcher.reset();
        for block in [0..samples / 3, samples / 3..samples] {
            let part: Vec<_> = antennas.iter().map(|x| &x[block.clone()]).collect();
            searcher.push(&part).expect("channels of one length");
        }
    });
}
