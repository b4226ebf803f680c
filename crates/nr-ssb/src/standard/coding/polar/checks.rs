//! The bits of the checksum that come before the last of the payload: the interleaver puts each
//! right after those payload bits that it is the parity of (TS 38.212 §5.3.1.1), so that a decoder
//! knows its value from what it decided before.

use super::code::{INFORMATION_SET, INTERLEAVER, K};
use super::encode::Codeword;
use crate::standard::message::crc::crc24c;

/// Bits of the payload, which come first in the message.
const PAYLOAD: usize = 32;
/// Bits of the checksum with payload after them.
const COUNT: usize = 3;

/// A parity check on channels up to that of a bit of the checksum.
#[derive(Debug, Clone, Copy)]
pub struct Check {
    /// The channel of that bit, the last of those checked.
    pub channel: usize,
    /// The channels whose sum is zero.
    mask: Codeword,
}

/// All of them, by rising channel.
const CHECKS: [Check; COUNT] = {
    let mut checks = [Check {
        channel: 0,
        mask: [0; 8],
    }; COUNT];
    let (mut found, mut k) = (0, 0);
    let mut payload_left = PAYLOAD;
    while payload_left > 0 {
        let from = INTERLEAVER[k] as usize;
        if from < PAYLOAD {
            payload_left -= 1;
        } else {
            checks[found] = check(k, from - PAYLOAD);
            found += 1;
        }
        k += 1;
    }
    assert!(found == COUNT);
    checks
};

/// The check by bit `bit` of the checksum, which is the `k`-th of the information channels.
const fn check(k: usize, bit: usize) -> Check {
    let channel = INFORMATION_SET[k] as usize;
    let mut mask = [0; 8];
    mask[channel / 64] |= 1 << (channel % 64);
    let mut other = 0;
    while other < K {
        let from = INTERLEAVER[other] as usize;
        if from < PAYLOAD && crc24c(1 << (31 - from)) >> (23 - bit) & 1 == 1 {
            assert!(other < k);
            let channel = INFORMATION_SET[other] as usize;
            mask[channel / 64] |= 1 << (channel % 64);
        }
        other += 1;
    }
    Check { channel, mask }
}

impl Check {
    /// The check that ends among the `len` channels from `first` on.
    pub fn inside(first: usize, len: usize) -> Option<&'static Self> {
        CHECKS
            .iter()
            .find(|check| (first..first + len).contains(&check.channel))
    }

    /// Whether it holds for u with `word` on the 64 channels around `first`, where u is still zero.
    pub fn holds(&self, u: &Codeword, word: u64, first: usize) -> bool {
        let before = u.iter().zip(&self.mask).fold(0, |sum, (u, m)| sum ^ u & m);
        (before ^ word & self.mask[first / 64])
            .count_ones()
            .is_multiple_of(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn hold_for_messages_with_a_right_checksum_alone() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..100 {
            let payload = rng.random();
            let message = u64::from(payload) << 24 | u64::from(crc24c(payload));
            for (bit, check) in CHECKS.iter().enumerate() {
                assert!(check.holds(&super::super::encode::place(message), 0, 0));
                let wrong = message ^ 1 << (23 - bit);
                assert!(!check.holds(&super::super::encode::place(wrong), 0, 0));
            }
        }
    }
}
