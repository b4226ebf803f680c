//! Strong cells with distortion, or with a stronger PSS, cause no false cell.

use crate::air;
use std::f32::consts::SQRT_2;

use nr_ssb::search::{SearchConfig, Searcher};
use nr_ssb::{Complex32, Lmax, SubcarrierSpacing};

const SPACING: SubcarrierSpacing = SubcarrierSpacing::Khz30;
const ANTENNAS: usize = 4;
/// Samples of an OFDM symbol and its cyclic prefix.
const SYMBOL: usize = 274;

/// Returns, over ten recordings of one cell at this SNR with `distort` applied to the samples of
/// its SSB, the number in which it was decoded, and the number of other cells.
fn cells(snr_db: f64, distort: impl Fn(&mut [Complex32])) -> (usize, usize) {
    let (mut decoded, mut others) = (0, 0);
    for seed in 0..10 {
        let mut rng = air::rng(seed);
        let mut cell = air::Cell::random(&mut rng, SPACING, ANTENNAS);
        cell.lmax = Lmax::L8;
        cell.ssb_indices = vec![2];
        let mut samples = air::silence(ANTENNAS, 38_400);
        cell.add_to(&mut samples);
        let start = cell.ssb_start(2) as usize;
        for antenna in &mut samples {
            distort(&mut antenna[start..start + 4 * SYMBOL]);
        }
        air::add_noise(&mut samples, snr_db, &mut rng);
        let config = SearchConfig {
            ssb_freq_hz: Some(cell.ssb_freq_hz),
            ..SearchConfig::new(SPACING, ANTENNAS)
        };
        let mut searcher = Searcher::new(config).unwrap();
        for ssb in searcher.search(&air::slices(&samples)).unwrap() {
            let right = ssb.pci.get() == cell.pci;
            decoded += usize::from(right && ssb.payload.is_some());
            others += usize::from(!right);
        }
    }
    (decoded, others)
}

#[test]
fn a_clipped_cell_is_one_cell() {
    for (level, snr_db) in [
        (0.3, 20.0),
        (0.3, 60.0),
        (0.7, 20.0),
        (1.0, 20.0),
        (1.5, 40.0),
    ] {
        let clip = |samples: &mut [Complex32]| {
            let power: f32 = samples.iter().map(Complex32::norm_sqr).sum();
            let most = level * (power / samples.len() as f32).sqrt();
            for x in samples {
                *x *= (most / x.norm()).min(1.0);
            }
        };
        assert_eq!(cells(snr_db, clip), (10, 0), "{level}, {snr_db} dB");
    }
}

/// TS 38.213 §4.1: the PSS has the power of the SSS, or 3 dB more.
#[test]
fn a_cell_whose_pss_is_stronger_is_one_cell() {
    for snr_db in [-5.0, 0.0, 10.0, 20.0, 40.0] {
        let strengthen = |samples: &mut [Complex32]| {
            samples[..SYMBOL].iter_mut().for_each(|x| *x *= SQRT_2);
        };
        assert_eq!(cells(snr_db, strengthen), (10, 0), "{snr_db} dB");
    }
}
