//! The physical broadcast channel, from payload to QPSK symbols (TS 38.212 §7.1, TS 38.211 §7.3.3).

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
    let message = with_crc(scramble(payload.bits(lmax), pci, lmax));
    let coded = polar::encode(message);
    let bits = rate_match(&coded)
        .zip(scrambling(pci, lmax.index_lsb(payload.ssb_index)))
        .map(|(bit, c)| bit ^ c);
    let mut symbols = [Complex32::ZERO; PBCH_LEN];
    qpsk(bits, &mut symbols);
    symbols
}

/// The K = 56 bits that are polar encoded: the scrambled payload and its CRC (TS 38.212 §7.1.3).
fn with_crc(scrambled: u32) -> u64 {
    u64::from(scrambled) << 24 | u64::from(crc24c(scrambled))
}

/// The sequence added to the E coded bits: c_init = PCI, from v·E on (TS 38.211 §7.3.3.1).
fn scrambling(pci: Pci, v: u8) -> Gold {
    Gold::new(u32::from(pci.get()), u32::from(v) * E as u32)
}
