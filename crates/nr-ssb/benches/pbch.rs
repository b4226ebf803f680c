//! Time to build a burst and to decode a PBCH.

#![allow(clippy::expect_used, reason = "a benchmark may stop")]

use divan::{Bencher, counter::ItemsCount};
use nr_ssb::pbch::{self, Decoder};
use nr_ssb::{BchPayload, Beam, Burst, Case, Lmax, Mib, Numerology, Ofdm, Pci};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn main() {
    divan::main();
}

fn cell() -> (Pci, BchPayload) {
    let pci = Pci::new(601).expect("below 1008");
    let payload = BchPayload::new(Mib::default(), 341, false, 5).expect("in range");
    (pci, payload)
}

/// Decodes one PBCH at −8 dB per resource element.
#[divan::bench(args = [1, 8, 32])]
fn decode_at_minus_8_db(bencher: Bencher, list_size: usize) {
    let (pci, payload) = cell();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut llr = [0.0; 864];
    pbch::llr(&pbch::encode(&payload, pci, Lmax::L8), 1.0, &mut llr);
    for x in &mut llr {
        let noise: f32 = StandardNormal.sample(&mut rng);
        *x += 2.0 * 10f32.powf(0.4) * noise;
    }
    let mut decoder = Decoder::new(list_size).expect("allowed");
    bencher
        .counter(ItemsCount::new(1_u32))
        .bench_local(|| decoder.decode(divan::black_box(&llr), pci, 5, Lmax::L8));
}

#[divan::bench]
fn encode_pbch(bencher: Bencher) {
    let (pci, payload) = cell();
    bencher.bench_local(|| pbch::encode(divan::black_box(&payload), pci, Lmax::L8));
}

/// Builds the IQ samples of eight beams at an FFT size.
#[divan::bench(args = [256, 1024])]
fn build_burst_of_8(bencher: Bencher, fft_size: usize) {
    let (pci, payload) = cell();
    let burst = Burst {
        pci,
        case: Case::C,
        lmax: Lmax::L8,
        payload,
        beams: (0..8).map(Beam::new).collect(),
        ssb_freq_hz: Some(3.7008e9),
    };
    let numerology = Numerology::new(Case::C.spacing(), fft_size).expect("a multiple of 256");
    let mut ofdm = Ofdm::new(numerology);
    bencher.bench_local(|| burst.iq(&mut ofdm));
}
