//! Polar encoding, d = u·G_N with G_N the ninth Kronecker power of [1 0; 1 1] (TS 38.212 §5.3.1.2).

use super::code::{INFORMATION_SET, INTERLEAVER, K, N};

const WORDS: usize = N / 64;

/// N coded bits, d(n) in bit n mod 64 of word n / 64.
pub type Codeword = [u64; WORDS];

/// Encodes a message of K = 56 bits: the first in bit 55, the CRC in the low 24 bits.
///
/// The code is linear: encode(a ⊕ b) = encode(a) ⊕ encode(b).
pub fn encode(message: u64) -> Codeword {
    let mut u = place(message);
    transform(&mut u);
    u
}

/// Returns u: the message on the information channels.
pub(super) fn place(message: u64) -> Codeword {
    let mut u = [0; WORDS];
    for (&channel, &from) in INFORMATION_SET.iter().zip(&INTERLEAVER) {
        let bit = message >> (K - 1 - usize::from(from)) & 1;
        u[usize::from(channel) / 64] |= bit << (channel % 64);
    }
    u
}

/// Returns the message of u.
pub(super) fn message_of(u: &Codeword) -> u64 {
    let pairs = INFORMATION_SET.iter().zip(&INTERLEAVER);
    pairs.fold(0, |message, (&channel, &from)| {
        let bit = u[usize::from(channel) / 64] >> (channel % 64) & 1;
        message | bit << (K - 1 - usize::from(from))
    })
}

/// Computes u ← u·G_64, which is its own inverse. With leading zeros it is u·G_n for every smaller
/// power of two.
pub(super) const fn transform_word(mut word: u64) -> u64 {
    const BUTTERFLIES: [(u32, u64); 6] = [
        (1, 0x5555_5555_5555_5555),
        (2, 0x3333_3333_3333_3333),
        (4, 0x0F0F_0F0F_0F0F_0F0F),
        (8, 0x00FF_00FF_00FF_00FF),
        (16, 0x0000_FFFF_0000_FFFF),
        (32, 0x0000_0000_FFFF_FFFF),
    ];
    let mut i = 0;
    while i < BUTTERFLIES.len() {
        let (shift, mask) = BUTTERFLIES[i];
        word ^= (word >> shift) & mask;
        i += 1;
    }
    word
}

/// Computes u ← u·G_N, which is its own inverse: butterflies within the words, then between words.
fn transform(u: &mut Codeword) {
    for word in u.iter_mut() {
        *word = transform_word(*word);
    }
    for step in [1, 2, 4] {
        for pair in u.chunks_exact_mut(2 * step) {
            let (low, high) = pair.split_at_mut(step);
            for (a, b) in low.iter_mut().zip(high) {
                *a ^= *b;
            }
        }
    }
}
