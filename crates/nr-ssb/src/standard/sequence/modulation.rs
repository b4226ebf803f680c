//! Bits to symbols: BPSK on the real axis, and QPSK (TS 38.211 §5.1.3).

use std::f32::consts::FRAC_1_SQRT_2;

use num_complex::Complex32;

/// Returns +1 for bit 0, −1 for bit 1.
pub(crate) fn bpsk(bit: u8) -> f32 {
    1.0 - 2.0 * f32::from(bit)
}

/// Fills symbols with ((1 − 2b(2i)) + j(1 − 2b(2i+1)))/√2; missing bits count as 0.
pub(crate) fn qpsk(mut bits: impl Iterator<Item = u8>, symbols: &mut [Complex32]) {
    for symbol in symbols {
        let re = bpsk(bits.next().unwrap_or(0));
        let im = bpsk(bits.next().unwrap_or(0));
        *symbol = Complex32::new(re, im) * FRAC_1_SQRT_2;
    }
}
