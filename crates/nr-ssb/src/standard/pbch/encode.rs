//! Encoding of a payload to QPSK symbols.

use num_complex::Complex32;

use crate::standard::coding::polar;
use crate::standard::coding::rate_matching::{E, rate_match};
use crate::standard::grid::PBCH_LEN;
use crate::standard::message::crc::crc24c;
use crate::standard::message::payload::{BchPayload, scramble};
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;
use crate::standard::sequence::gold::Gold;
use crate::standard::sequence::modulation::qpsk;

/// Returns the 432 QPSK symbols of the PBCH of one SSB, in the order of
/// [`pbch_indices`](crate::grid::pbch_indices).
pub fn encode(payload: &BchPayload, pci: Pci, lmax: Lmax) -> [Complex32; PBCH_LEN] {
    let message = message(payload.bits(lmax), pci, lmax);
    modulate(message, pci, lmax.index_lsb(payload.ssb_index))
}

/// Returns the K = 56 bits before polar encoding: the scrambled payload and its CRC (TS 38.212
/// §7.1.3).
pub(super) fn message(payload: u32, pci: Pci, lmax: Lmax) -> u64 {
    with_crc(scramble(payload, pci, lmax))
}

pub(super) fn with_crc(scrambled: u32) -> u64 {
    u64::from(scrambled) << 24 | u64::from(crc24c(scrambled))
}

/// Returns the symbols of a message for the low bits `v` of the SSB index.
pub(super) fn modulate(message: u64, pci: Pci, v: u8) -> [Complex32; PBCH_LEN] {
    let coded = polar::encode(message);
    let bits = rate_match(&coded)
        .zip(scrambling(pci, v))
        .map(|(bit, c)| bit ^ c);
    let mut symbols = [Complex32::ZERO; PBCH_LEN];
    qpsk(bits, &mut symbols);
    symbols
}

/// Returns the scrambling sequence of the E coded bits: c_init = PCI, starting at v·E (TS 38.211
/// §7.3.3.1).
pub(super) fn scrambling(pci: Pci, v: u8) -> Gold {
    Gold::new(u32::from(pci.get()), u32::from(v) * E as u32)
}
