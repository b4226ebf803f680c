//! CRC bits that precede the last payload bit. The interleaver places each of them after the
//! payload bits of its parity (TS 38.212 §5.3.1.1), so that earlier decisions of the decoder
//! determine its value.

use super::code::{INFORMATION_SET, INTERLEAVER, K};
use super::encode::Codeword;
use crate::standard::message::crc::crc24c;

/// Number of payload bits, the first bits of the message.
const PAYLOAD: usize = 32;
/// Number of CRC bits that precede a payload bit.
const COUNT: usize = 3;

/// Parity check on bit channels, ending at that of a CRC bit.
#[derive(Debug, Clone, Copy)]
pub struct Check {
    /// Bit channel of the CRC bit, the last one of the check.
    pub channel: usize,
    /// Bit channels with a sum of zero.
    mask: Codeword,
}

/// All checks, in ascending order of their last bit channel.
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

/// Returns the check of CRC bit `bit`, which is the `k`-th information channel.
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
    /// Returns the check that ends within `len` channels starting at `first`.
    pub fn inside(first: usize, len: usize) -> Option<&'static Self> {
        CHECKS
            .iter()
            .find(|check| (first..first + len).contains(&check.channel))
    }

    /// Whether the check is satisfied for u with `word` on the 64 channels that include `first`,
    /// where u is still zero.
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
    fn parity_checks_hold_only_for_correct_checksums() {
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
