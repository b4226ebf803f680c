//! Statistics of PBCH decoding in noise.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a test"
)]

use nr_ssb::pbch::{self, Decoder, Period};
use nr_ssb::{BchPayload, Complex32, Lmax, Mib, Pci};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Ratios of `symbols` in white noise at an SNR per resource element.
fn noisy_llr(symbols: &[Complex32; 432], snr_db: f32, rng: &mut impl Rng) -> [f32; 864] {
    let noise_variance = 10f32.powf(-snr_db / 10.0);
    let mut gauss = || -> f32 { StandardNormal.sample(rng) };
    let received = symbols.map(|s| {
        let noise = Complex32::new(gauss(), gauss());
        s + noise * (noise_variance / 2.0).sqrt()
    });
    let mut llr = [0.0; 864];
    pbch::llr(&received, noise_variance, &mut llr);
    llr
}

fn random_payload(rng: &mut impl Rng, lmax: Lmax) -> BchPayload {
    let mib = Mib::from_bits(rng.random_range(0..1 << 23)).unwrap();
    let index = rng.random_range(0..lmax.count());
    let payload = BchPayload::new(mib, rng.random_range(0..1024), rng.random(), index).unwrap();
    BchPayload {
        k_ssb_msb: lmax != Lmax::L64 && rng.random(),
        ..payload
    }
}

/// Block errors in `trials` PBCHs; a wrong payload with a right CRC must not occur.
fn block_errors(decoder: &mut Decoder, snr_db: f32, trials: usize) -> usize {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let lmax = Lmax::L8;
    let mut errors = 0;
    for _ in 0..trials {
        let pci = Pci::new(rng.random_range(0..1008)).unwrap();
        let payload = random_payload(&mut rng, lmax);
        let llr = noisy_llr(&pbch::encode(&payload, pci, lmax), snr_db, &mut rng);
        let v = lmax.index_lsb(payload.ssb_index);
        match decoder.decode(&llr, pci, v, lmax).unwrap() {
            Some(decoded) => assert_eq!(decoded.payload, payload),
            None => errors += 1,
        }
    }
    errors
}

/// The requirement is at most 0.01. A list of 8 alone has 0.013, the retry with 32 brings 0.003:
/// 40 errors in 4000 would be more than seven standard deviations above.
#[test]
fn few_block_errors_at_minus_8_db() {
    let errors = block_errors(&mut Decoder::default(), -8.0, 4000);
    println!("list of 8, then 32, at -8 dB: {errors} errors in 4000");
    assert!(errors <= 40, "{errors} errors in 4000");
}

/// Independent implementations: successive cancellation 0.25 at −8 dB and 0.85 at −10 dB, a list of 8
/// 0.00 and 0.40. Bounds at four standard deviations of 2000 trials, and 0.03 for theirs.
#[test]
fn block_error_rates_are_those_of_other_implementations() {
    for (list_size, snr_db, expected) in [
        (1, -8.0, 0.25_f64),
        (1, -10.0, 0.85),
        (8, -8.0, 0.0),
        (8, -10.0, 0.40),
    ] {
        let mut decoder = Decoder::new(list_size).unwrap();
        let rate = block_errors(&mut decoder, snr_db, 2000) as f64 / 2000.0;
        println!("list of {list_size} at {snr_db} dB: {rate}, elsewhere {expected}");
        let tolerance = 4.0 * (expected * (1.0 - expected) / 2000.0).sqrt() + 0.03;
        assert!(
            (rate - expected).abs() < tolerance,
            "{rate} instead of {expected}"
        );
    }
}

/// A period 5 dB below what a list of 8 needs decodes together with three more.
#[test]
fn combining_four_periods_gains_about_6_db() {
    let (snr_db, trials, lmax) = (-13.0, 200, Lmax::L4);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut decoder = Decoder::default();
    let (mut alone, mut together) = (0, 0);
    for trial in 0..trials {
        let pci = Pci::new(rng.random_range(0..1008)).unwrap();
        // Every place of the first period, across 80 ms and 160 ms and the SFN's own end.
        let first = random_payload(&mut rng, lmax)
            .with_sfn((1010 + trial) % 1024)
            .unwrap();
        let v = lmax.index_lsb(first.ssb_index);
        let llrs: Vec<_> = (0..4)
            .map(|n| {
                let payload = first.with_sfn((first.sfn() + 2 * n) % 1024).unwrap();
                noisy_llr(&pbch::encode(&payload, pci, lmax), snr_db, &mut rng)
            })
            .collect();
        let periods: Vec<_> = llrs
            .iter()
            .zip(0..)
            .map(|(llr, n)| Period {
                llr,
                half_frames: 4 * n,
            })
            .collect();
        alone += usize::from(decoder.decode(&llrs[0], pci, v, lmax).unwrap().is_some());
        if let Some(decoded) = decoder.combine(&periods, pci, v, lmax).unwrap() {
            assert_eq!(decoded.payload, first);
            assert_eq!(decoded.symbols(), pbch::encode(&first, pci, lmax));
            together += 1;
        }
    }
    println!("at {snr_db} dB of {trials}: {alone} alone, {together} of four together");
    assert!(alone <= trials as usize / 20, "{alone} alone");
    // 5 of 8 places keep all four on one side of a change of the SFN's high bits, 2 of 8 keep three.
    assert!(together >= trials as usize * 3 / 4, "{together} together");
}

/// Without noise every spacing and every place decodes.
#[test]
fn periods_of_any_spacing_combine() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut decoder = Decoder::new(2).unwrap();
    for lmax in [Lmax::L4, Lmax::L8, Lmax::L64] {
        for spacing in [1_u16, 2, 4, 8, 16, 32] {
            let pci = Pci::new(rng.random_range(0..1008)).unwrap();
            let first = random_payload(&mut rng, lmax);
            let v = lmax.index_lsb(first.ssb_index);
            let start = 2 * u32::from(first.sfn()) + u32::from(first.half_frame);
            let llrs: Vec<_> = (0..4)
                .map(|n| {
                    let time = (start + n * u32::from(spacing)) % 2048;
                    let mut payload = first.with_sfn((time / 2) as u16).unwrap();
                    payload.half_frame = time % 2 == 1;
                    noisy_llr(&pbch::encode(&payload, pci, lmax), 0.0, &mut rng)
                })
                .collect();
            let periods: Vec<_> = llrs
                .iter()
                .zip(0..)
                .map(|(llr, n)| Period {
                    llr,
                    half_frames: n * spacing,
                })
                .collect();
            let decoded = decoder.combine(&periods, pci, v, lmax).unwrap().unwrap();
            assert_eq!(
                decoded.payload, first,
                "{lmax:?}, every {spacing} half frames"
            );
        }
    }
    assert_eq!(
        decoder.combine(&[], Pci::new(0).unwrap(), 0, Lmax::L4),
        Ok(None)
    );
}
