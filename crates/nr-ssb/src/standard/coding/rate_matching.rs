//! Rate matching of the PBCH: N = 512 coded bits to E = 864 and back (TS 38.212 §5.4.1, §7.1.5).
//!
//! Sub-block interleaving, followed by a repetition of the first 352 bits. The coded bits are not
//! interleaved (I_BIL = 0).

use super::polar::{Codeword, N};

/// Number of transmitted bits in one SSB, E.
pub const E: usize = 864;

/// P(i): order of the 32 sub-blocks (TS 38.212 Table 5.4.1.1-1).
const P: [usize; 32] = [
    0, 1, 2, 4, 3, 5, 6, 7, 8, 16, 9, 17, 10, 18, 11, 19, 12, 20, 13, 21, 14, 22, 15, 23, 24, 25,
    26, 28, 27, 29, 30, 31,
];
const SUB_BLOCK: usize = N / P.len();

/// Returns the E transmitted bits of a codeword, in order.
pub fn rate_match(codeword: &Codeword) -> impl Iterator<Item = u8> {
    let interleaved = P.iter().flat_map(|&block| {
        let first = block * SUB_BLOCK;
        let bits = codeword[first / 64] >> (first % 64);
        (0..SUB_BLOCK).map(move |i| (bits >> i & 1) as u8)
    });
    interleaved.cycle().take(E)
}

/// Computes the log-likelihood ratios of the N coded bits: deinterleaves them and adds repetitions.
pub(crate) fn rate_recover(llr: &[f32; E], coded: &mut [f32; N]) {
    let (first, repeated) = llr.split_at(N);
    for (sub_block, (&block, sent)) in P.iter().zip(first.chunks_exact(SUB_BLOCK)).enumerate() {
        let target = &mut coded[block * SUB_BLOCK..][..SUB_BLOCK];
        target.copy_from_slice(sent);
        if let Some(again) = repeated.get(sub_block * SUB_BLOCK..(sub_block + 1) * SUB_BLOCK) {
            for (sum, more) in target.iter_mut().zip(again) {
                *sum += more;
            }
        }
    }
}
