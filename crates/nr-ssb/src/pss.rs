//! The primary synchronization signal.

/// Length of the PSS and of the SSS.
pub const SYNC_LEN: usize = 127;

/// x(i+7) = x(i+4) + x(i), starting x(6)…x(0) = 1110110.
const X: [u8; SYNC_LEN] = m_sequence([0, 1, 1, 0, 1, 1, 1], 4);

/// The m-sequence x(i+7) = x(i+`tap`) + x(i) from x(0)…x(6) = `start`.
pub(crate) const fn m_sequence(start: [u8; 7], tap: usize) -> [u8; SYNC_LEN] {
    let mut x = [0; SYNC_LEN];
    let mut i = 0;
    while i < SYNC_LEN {
        x[i] = if i < 7 {
            start[i]
        } else {
            x[i - 7 + tap] ^ x[i - 7]
        };
        i += 1;
    }
    x
}

/// +1 for bit 0, −1 for bit 1.
pub(crate) fn bpsk(bit: u8) -> f32 {
    1.0 - 2.0 * f32::from(bit)
}

/// d_PSS(n) = 1 − 2x(m), m = (n + 43·N_ID2) mod 127, as ±1 (TS 38.211 §7.4.2.2).
///
/// `n_id_2` is 0, 1 or 2 ([`Pci::n_id_2`](crate::Pci::n_id_2)).
pub fn pss(n_id_2: u8) -> [f32; SYNC_LEN] {
    let shift = 43 * usize::from(n_id_2);
    std::array::from_fn(|n| bpsk(X[(n + shift) % SYNC_LEN]))
}
