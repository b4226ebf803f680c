//! The length-31 Gold sequence (TS 38.211 §5.2.1).

/// Number of discarded samples of both registers, N_C.
const NC: u32 = 1600;
/// Number of new samples per register step. The taps reach 3 samples ahead, so that 31 − 3 samples
/// are known.
const STEP: u32 = 28;
const STEP_MASK: u32 = (1 << STEP) - 1;

/// State of x1 after N_C samples; its initial state is always the same.
const X1_AT_NC: u32 = {
    let mut x1 = 1;
    let mut left = NC;
    while left > 0 {
        let n = if left < STEP { left } else { STEP };
        x1 = advance_x1(x1, n);
        left -= n;
    }
    x1
};

/// Returns the state after `n` ≤ 28 samples of x1(i+31) = x1(i+3) + x1(i); bit j of the state is
/// x1(i+j).
const fn advance_x1(x: u32, n: u32) -> u32 {
    let new = ((x >> 3) ^ x) & STEP_MASK;
    ((x >> n) | (new << (31 - n))) & 0x7fff_ffff
}

/// Returns the state after `n` ≤ 28 samples of x2(i+31) = x2(i+3) + x2(i+2) + x2(i+1) + x2(i).
const fn advance_x2(x: u32, n: u32) -> u32 {
    let new = ((x >> 3) ^ (x >> 2) ^ (x >> 1) ^ x) & STEP_MASK;
    ((x >> n) | (new << (31 - n))) & 0x7fff_ffff
}

/// Pseudo-random sequence c(n), n = `offset`, `offset` + 1, …, each 0 or 1.
///
/// The registers advance by 28 samples per step, so that a large `offset` is fast.
///
/// ```
/// use nr_ssb::Gold;
/// let from_start: Vec<u8> = Gold::new(601, 0).skip(864).take(100).collect();
/// let jumped: Vec<u8> = Gold::new(601, 864).take(100).collect();
/// assert_eq!(from_start, jumped);
/// ```
#[derive(Debug, Clone)]
pub struct Gold {
    x1: u32,
    x2: u32,
    ready: u32,
    ready_count: u32,
}

impl Gold {
    /// Creates the sequence with initial value `c_init` (31 bits), starting at c(`offset`).
    pub const fn new(c_init: u32, offset: u32) -> Self {
        let mut x1 = X1_AT_NC;
        let mut x2 = c_init & 0x7fff_ffff;
        let mut left = NC;
        while left > 0 {
            let n = if left < STEP { left } else { STEP };
            x2 = advance_x2(x2, n);
            left -= n;
        }
        let mut left = offset;
        while left > 0 {
            let n = if left < STEP { left } else { STEP };
            x1 = advance_x1(x1, n);
            x2 = advance_x2(x2, n);
            left -= n;
        }
        Self {
            x1,
            x2,
            ready: 0,
            ready_count: 0,
        }
    }
}

impl Iterator for Gold {
    type Item = u8;

    fn next(&mut self) -> Option<u8> {
        if self.ready_count == 0 {
            self.ready = (self.x1 ^ self.x2) & STEP_MASK;
            self.ready_count = STEP;
            self.x1 = advance_x1(self.x1, STEP);
            self.x2 = advance_x2(self.x2, STEP);
        }
        let bit = (self.ready & 1) as u8;
        self.ready >>= 1;
        self.ready_count -= 1;
        Some(bit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the sequence by its definition, one sample at a time, as a reference.
    fn naive(c_init: u32, length: usize) -> Vec<u8> {
        let total = length + NC as usize + 31;
        let mut x1 = vec![0u8; total];
        let mut x2 = vec![0u8; total];
        x1[0] = 1;
        for i in 0..31 {
            x2[i] = (c_init >> i & 1) as u8;
        }
        for i in 0..total - 31 {
            x1[i + 31] = x1[i + 3] ^ x1[i];
            x2[i + 31] = x2[i + 3] ^ x2[i + 2] ^ x2[i + 1] ^ x2[i];
        }
        (0..length)
            .map(|n| x1[n + NC as usize] ^ x2[n + NC as usize])
            .collect()
    }

    #[test]
    fn equals_the_definition_at_every_offset() {
        for c_init in [0, 1, 1007, 0x1234_5678, 0x7fff_ffff] {
            let expected = naive(c_init, 1000);
            for offset in [0, 1, 27, 28, 29, 863, 864] {
                let got: Vec<u8> = Gold::new(c_init, offset).take(100).collect();
                let start = offset as usize;
                assert_eq!(got, expected[start..start + 100], "{c_init} {offset}");
            }
        }
    }
}
