//! The 24-bit cyclic redundancy check of the BCH.

/// g_CRC24C(D) without its leading term D²⁴ (TS 38.212 §5.1).
const POLYNOMIAL: u32 = 0xB2_B117;

/// Remainder of each byte value times D²⁴.
const TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = (byte as u32) << 16;
        let mut bit = 0;
        while bit < 8 {
            crc = (crc << 1) ^ (if crc & 0x80_0000 == 0 { 0 } else { POLYNOMIAL });
            bit += 1;
        }
        table[byte] = crc & 0xFF_FFFF;
        byte += 1;
    }
    table
};

/// Returns the 24 parity bits of 32 payload bits: CRC24C with an initial register of zero (TS
/// 38.212 §5.1, §7.1.3).
///
/// The most significant bit is the first one, in the payload and in the parity bits. Because the
/// register is initially zero, the map is linear: crc(a ⊕ b) = crc(a) ⊕ crc(b).
pub const fn crc24c(payload: u32) -> u32 {
    let bytes = payload.to_be_bytes();
    let mut crc = 0;
    let mut i = 0;
    while i < bytes.len() {
        let index = (crc >> 16) as u8 ^ bytes[i];
        crc = ((crc << 8) & 0xFF_FFFF) ^ TABLE[index as usize];
        i += 1;
    }
    crc
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crc_equals_polynomial_division() {
        for payload in [0, 1, 0x8000_0000, 0xDEAD_BEEF, 0xFFFF_FFFF_u32] {
            let mut remainder = u64::from(payload) << 24;
            for bit in (24..56).rev() {
                if remainder >> bit & 1 == 1 {
                    remainder ^= (0x100_0000 | u64::from(POLYNOMIAL)) << (bit - 24);
                }
            }
            assert_eq!(u64::from(crc24c(payload)), remainder);
        }
    }

    #[test]
    fn crc_is_linear() {
        assert_eq!(
            crc24c(0x1234_5678 ^ 0x0F0F_00FF),
            crc24c(0x1234_5678) ^ crc24c(0x0F0F_00FF)
        );
    }
}
