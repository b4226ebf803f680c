//! The primary synchronization signal.

use super::m_sequence::m_sequence;
use super::modulation::bpsk;

pub use super::m_sequence::SYNC_LEN;

/// x(i+7) = x(i+4) + x(i), starting x(6)…x(0) = 1110110.
const X: [u8; SYNC_LEN] = m_sequence([0, 1, 1, 0, 1, 1, 1], 4);

/// Returns the PSS sequence d_PSS(n) = 1 − 2x(m), m = (n + 43·N_ID2) mod 127, as ±1 (TS 38.211
/// §7.4.2.2).
///
/// `n_id_2` is 0, 1 or 2 ([`Pci::n_id_2`](crate::Pci::n_id_2)).
pub fn pss(n_id_2: u8) -> [f32; SYNC_LEN] {
    let shift = 43 * usize::from(n_id_2);
    std::array::from_fn(|n| bpsk(X[(n + shift) % SYNC_LEN]))
}
