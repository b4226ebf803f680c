//! Block error rate of PBCHs in white noise with a known channel.
#![allow(dead_code, reason = "each test uses its part")]

use nr_ssb::pbch::{self, Decoder};
use nr_ssb::{BchPayload, Complex32, Lmax, Mib, Pci};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Ratios of `symbols` in white noise at an SNR per resource element.
pub fn noisy_llr(symbols: &[Complex32; 432], snr_db: f32, rng: &mut impl Rng) -> [f32; 864] {
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

pub fn random_payload(rng: &mut impl Rng, lmax: Lmax) -> BchPayload {
    let mib = Mib::from_bits(rng.random_range(0..1 << 23)).unwrap();
    let index = rng.random_range(0..lmax.count());
    let payload = BchPayload::new(mib, rng.random_range(0..1024), rng.random(), index).unwrap();
    BchPayload {
        k_ssb_msb: lmax != Lmax::L64 && rng.random(),
        ..payload
    }
}

/// Returns the number of block errors in `trials` PBCHs; a wrong payload with a correct CRC must
/// not occur.
pub fn block_errors(decoder: &mut Decoder, snr_db: f32, trials: usize, seed: u64) -> usize {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
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
