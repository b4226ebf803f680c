//! The demodulation reference signal of the PBCH.

use num_complex::Complex32;

use super::gold::Gold;
use super::modulation::qpsk;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;

/// Number of PBCH DM-RS resource elements in one SSB.
pub const DMRS_LEN: usize = 144;

/// Returns i̅_SSB, which selects the DM-RS sequence of an SSB (TS 38.211 §7.4.1.4.1): the two low
/// bits of the SSB index plus 4·`half_frame` for Lmax 4, otherwise the three low bits of the index.
pub fn ibar_ssb(lmax: Lmax, ssb_index: u8, half_frame: bool) -> u8 {
    match lmax {
        Lmax::L4 => (ssb_index & 3) + 4 * u8::from(half_frame),
        Lmax::L8 | Lmax::L64 => ssb_index & 7,
    }
}

/// Returns the DM-RS sequence r(m) = ((1 − 2c(2m)) + j(1 − 2c(2m+1)))/√2 in the order of
/// [`dmrs_indices`](crate::grid::dmrs_indices) (TS 38.211 §7.4.1.4.1), with c_init =
/// 2¹¹(i̅+1)(⌊PCI/4⌋+1) + 2⁶(i̅+1) + PCI mod 4.
///
/// `ibar_ssb` is 0 to 7, see [`ibar_ssb`].
pub fn dmrs(pci: Pci, ibar_ssb: u8) -> [Complex32; DMRS_LEN] {
    let i = u32::from(ibar_ssb) + 1;
    let cell = u32::from(pci.get());
    let c_init = ((i * (cell / 4 + 1)) << 11) + (i << 6) + cell % 4;
    let mut symbols = [Complex32::ZERO; DMRS_LEN];
    qpsk(Gold::new(c_init, 0), &mut symbols);
    symbols
}
