//! The secondary synchronization signal.

use super::m_sequence::{SYNC_LEN, m_sequence};
use super::modulation::bpsk;
use crate::standard::pci::Pci;

const X0: [u8; SYNC_LEN] = m_sequence([1, 0, 0, 0, 0, 0, 0], 4);
const X1: [u8; SYNC_LEN] = m_sequence([1, 0, 0, 0, 0, 0, 0], 1);

/// Returns the SSS sequence d_SSS(n) = (1 − 2x0((n + m0) mod 127))·(1 − 2x1((n + m1) mod 127)), as
/// ±1 (TS 38.211 §7.4.2.3), with m0 = 15·⌊N_ID1/112⌋ + 5·N_ID2 and m1 = N_ID1 mod 112.
pub fn sss(pci: Pci) -> [f32; SYNC_LEN] {
    let n_id_1 = usize::from(pci.n_id_1());
    let m0 = 15 * (n_id_1 / 112) + 5 * usize::from(pci.n_id_2());
    let m1 = n_id_1 % 112;
    std::array::from_fn(|n| bpsk(X0[(n + m0) % SYNC_LEN] ^ X1[(n + m1) % SYNC_LEN]))
}
