//! m-sequences of length 127, from which PSS and SSS are formed.

/// Length of the PSS and of the SSS.
pub const SYNC_LEN: usize = 127;

/// Returns the m-sequence x(i+7) = x(i+`tap`) + x(i) with x(0)…x(6) = `start`.
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
