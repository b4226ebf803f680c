//! Leaf of the decoding tree: a code with so few words that the LLRs are correlated with all of
//! them.
//!
//! The last of the n rows of G_n is the all-ones word. The rows whose index lacks a single binary
//! digit b are, up to that word, the sign patterns (−1)^{i_b}. Their sums are the Walsh functions,
//! with which one fast Hadamard transform correlates. The few remaining rows form cosets, with one
//! transform each (J. Conway, N. Sloane, "Soft decoding techniques for codes and lattices", IEEE
//! Trans. Inf. Theory 32 (1986)).

use super::encode::transform_word;

/// Maximum length of a leaf: the number of bits of a word.
const MAX_LEN: usize = 64;
/// Maximum number of rows that form cosets: four transforms per path.
const COSET_ROWS: usize = 2;

/// Bits i whose binary digit b is one.
const DIGITS: [u64; 6] = [
    0xAAAA_AAAA_AAAA_AAAA,
    0xCCCC_CCCC_CCCC_CCCC,
    0xF0F0_F0F0_F0F0_F0F0,
    0xFF00_FF00_FF00_FF00,
    0xFFFF_0000_FFFF_0000,
    0xFFFF_FFFF_0000_0000,
];

/// Code of a leaf.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leaf {
    len: usize,
    /// Number of digits whose Walsh functions are words of the code.
    digits: usize,
    /// Words outside the Walsh functions; 0 for none.
    others: [u64; COSET_ROWS],
}

impl Leaf {
    /// Returns the code of these rows of G_n, n = `len` up to 64; `None` if there are too many
    /// rows, or the last row is missing.
    pub fn new(rows: u64, len: usize) -> Option<Self> {
        let last = len - 1;
        let (mut digits, mut others, mut count) = (0, [0; COSET_ROWS], 0);
        for row in (0..last).filter(|row| rows >> row & 1 == 1) {
            let lacking = last ^ row;
            if lacking.is_power_of_two() {
                digits |= lacking;
            } else {
                *others.get_mut(count)? = transform_word(1 << row);
                count += 1;
            }
        }
        (rows >> last & 1 == 1).then_some(Self {
            len,
            digits,
            others,
        })
    }

    /// Calls `offer` with every word c, or its complement, for which Σ α(i)·(−1)^{c(i)} exceeds the
    /// threshold, and with this sum. `offer` returns the new threshold.
    pub fn correlate(
        &self,
        alpha: &[f32],
        mut threshold: f32,
        mut offer: impl FnMut(f32, u64) -> f32,
    ) {
        let all = u64::MAX >> (64 - self.len);
        let mut buffer = [0.0; MAX_LEN];
        let sums = &mut buffer[..self.len];
        let [a, b] = self.others;
        let cosets = [0, a, b, a ^ b];
        let count = match self.others {
            [0, 0] => 1,
            [_, 0] => 2,
            _ => 4,
        };
        for &coset in &cosets[..count] {
            for (i, (sum, x)) in sums.iter_mut().zip(alpha).enumerate() {
                *sum = f32::from_bits(x.to_bits() ^ ((coset >> i) as u32) << 31);
            }
            hadamard(sums);
            if !sums
                .iter()
                .fold(false, |any, sum| any | (sum.abs() > threshold))
            {
                continue;
            }
            for (walsh, &sum) in sums.iter().enumerate() {
                if sum.abs() > threshold && walsh & !self.digits == 0 {
                    let word = coset ^ walsh_function(walsh) & all;
                    for (sum, word) in [(sum, word), (-sum, word ^ all)] {
                        if sum > threshold {
                            threshold = offer(sum, word);
                        }
                    }
                }
            }
        }
    }
}

/// Returns the bits i with an odd number of digits in common with `walsh`.
fn walsh_function(walsh: usize) -> u64 {
    let digits = DIGITS.iter().enumerate();
    digits
        .filter(|(b, _)| walsh >> b & 1 == 1)
        .fold(0, |word, (_, digit)| word ^ digit)
}

/// Computes the Hadamard transform x(j) ← Σ x(i)·(−1)^{⟨i, j⟩}.
fn hadamard(x: &mut [f32]) {
    let (quads, rest) = x.as_chunks_mut::<4>();
    for quad in quads {
        let [a, b, c, d] = *quad;
        let (e, f, g, h) = (a + b, a - b, c + d, c - d);
        *quad = [e + g, f + h, e - g, f - h];
    }
    if let [a, b] = rest {
        (*a, *b) = (*a + *b, *a - *b);
    }
    let mut step = 4;
    while step < x.len() {
        for pair in x.chunks_exact_mut(2 * step) {
            let (low, high) = pair.split_at_mut(step);
            for (a, b) in low.iter_mut().zip(high) {
                (*a, *b) = (*a + *b, *a - *b);
            }
        }
        step *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_codeword_is_listed_once_with_its_correlation() {
        let alpha: Vec<f32> = (0..32).map(|i| (i as f32 * 1.7).sin()).collect();
        for (rows, len, count) in [
            // Two rows that form cosets, three Walsh functions, the all-ones word.
            (0xE200_8200_u64, 32, 64),
            (0xE, 4, 8),
            (0xF, 4, 16),
            (0x3, 2, 4),
            (0x1, 1, 2),
        ] {
            let alpha = &alpha[..len];
            let mut words = Vec::new();
            let leaf = Leaf::new(rows, len).unwrap();
            leaf.correlate(alpha, f32::NEG_INFINITY, |sum, word| {
                let bits = alpha.iter().enumerate();
                let signed = bits.map(|(i, x)| if word >> i & 1 == 1 { -x } else { *x });
                assert!((sum - signed.sum::<f32>()).abs() < 1e-4);
                assert_eq!(transform_word(word) & !rows, 0);
                words.push(word);
                f32::NEG_INFINITY
            });
            words.sort_unstable();
            words.dedup();
            assert_eq!(words.len(), count);
        }
    }

    #[test]
    fn codes_with_too_many_words_are_rejected() {
        assert_eq!(Leaf::new(0xFF, 8), None);
        assert_eq!(Leaf::new(0x40, 8), None);
    }
}
