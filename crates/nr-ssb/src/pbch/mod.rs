//! The physical broadcast channel: payload to QPSK symbols and back (TS 38.212 §7.1,
//! TS 38.211 §7.3.3).

mod combine;
mod decode;

pub use combine::Period;
pub use decode::{Decoded, Decoder};

use num_complex::Complex32;

use crate::crc::crc24c;
use crate::gold::Gold;
use crate::grid::PBCH_LEN;
use crate::numerology::Lmax;
use crate::payload::{BchPayload, scramble};
use crate::pci::Pci;
use crate::polar;
use crate::qpsk::qpsk;
use crate::rate_matching::{E, rate_match};

/// The 432 QPSK symbols of the PBCH of one SSB, in the order of
/// [`pbch_indices`](crate::grid::pbch_indices).
pub fn encode(payload: &BchPayload, pci: Pci, lmax: Lmax) -> [Complex32; PBCH_LEN] {
    let message = message(payload.bits(lmax), pci, lmax);
    modulate(message, pci, lmax.index_lsb(payload.ssb_index))
}

/// Log-likelihood ratios of the 864 bits of equalized QPSK symbols in complex noise of variance
/// `noise_variance` (per symbol): 2√2·Re/σ², 2√2·Im/σ².
pub fn llr(symbols: &[Complex32; PBCH_LEN], noise_variance: f32, llr: &mut [f32; E]) {
    let scale = 2.0 * std::f32::consts::SQRT_2 / noise_variance;
    for (pair, symbol) in llr.as_chunks_mut().0.iter_mut().zip(symbols) {
        *pair = [symbol.re * scale, symbol.im * scale];
    }
}

/// The K = 56 bits that are polar encoded: the payload, scrambled, and its CRC (TS 38.212 §7.1.3).
fn message(payload: u32, pci: Pci, lmax: Lmax) -> u64 {
    with_crc(scramble(payload, pci, lmax))
}

fn with_crc(scrambled: u32) -> u64 {
    u64::from(scrambled) << 24 | u64::from(crc24c(scrambled))
}

/// The symbols of a message, for the low bits `v` of the SSB index.
fn modulate(message: u64, pci: Pci, v: u8) -> [Complex32; PBCH_LEN] {
    let coded = polar::encode(message);
    let bits = rate_match(&coded)
        .zip(scrambling(pci, v))
        .map(|(bit, c)| bit ^ c);
    let mut symbols = [Complex32::ZERO; PBCH_LEN];
    qpsk(bits, &mut symbols);
    symbols
}

/// The sequence added to the E coded bits: c_init = PCI, from v·E on (TS 38.211 §7.3.3.1).
fn scrambling(pci: Pci, v: u8) -> Gold {
    Gold::new(u32::from(pci.get()), u32::from(v) * E as u32)
}
