//! BCH payload: MIB and the time information within 80 ms, interleaved and scrambled (TS 38.212
//! §7.1.1 and §7.1.2).
//!
//! Bit strings of 32 bits are `u32`, with the first bit in bit 31.

use super::mib::Mib;
use crate::error::Error;
use crate::standard::numerology::Lmax;
use crate::standard::pci::Pci;
use crate::standard::sequence::gold::Gold;

/// G(j): positions of the interleaved bits (TS 38.212 Table 7.1.1-1).
const G: [u8; 32] = [
    16, 23, 18, 17, 8, 30, 10, 6, 24, 7, 0, 5, 3, 2, 1, 4, 9, 11, 12, 13, 14, 15, 19, 20, 21, 22,
    25, 26, 27, 28, 29, 31,
];

/// Positions after interleaving: the third and second least significant bit of the SFN, the
/// half-frame bit, and three bits that contain the SSB index for Lmax 64.
const SFN_BIT_2: u8 = G[7];
const SFN_BIT_1: u8 = G[8];
const HALF_FRAME: u8 = G[10];
const INDEX_BITS: [u8; 3] = [G[11], G[12], G[13]];

/// Position of input bit i in the interleaved payload.
const PLACE: [u8; 32] = {
    let mut place = [0; 32];
    let (mut sfn, mut index, mut other) = (0, 11, 14);
    let mut i = 0;
    while i < 32 {
        place[i] = match i {
            1..=6 | 24..=27 => {
                sfn += 1;
                G[sfn - 1]
            }
            28 => HALF_FRAME,
            29..=31 => {
                index += 1;
                G[index - 1]
            }
            _ => {
                other += 1;
                G[other - 1]
            }
        };
        i += 1;
    }
    place
};

/// Content of one PBCH.
///
/// ```
/// use nr_ssb::{BchPayload, Mib, Lmax};
/// let payload = BchPayload::new(Mib::default(), 1000, true, 3)?;
/// assert_eq!(payload.sfn(), 1000);
/// assert_eq!((payload.mib.sfn_msb, payload.sfn_lsb), (62, 8));
/// # Ok::<(), nr_ssb::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct BchPayload {
    /// MIB, including the six most significant bits of the SFN.
    pub mib: Mib,
    /// Four least significant bits of the SFN, 0 to 15.
    pub sfn_lsb: u8,
    /// Half frame of the SSB: `false` for the first 5 ms of the frame, `true` for the second 5 ms.
    pub half_frame: bool,
    /// SSB index. The PBCH contains its three most significant bits (Lmax 64 only); DM-RS and
    /// scrambling encode the others.
    pub ssb_index: u8,
    /// Most significant bit of k_SSB (Lmax 4 and 8 only).
    pub k_ssb_msb: bool,
}

impl BchPayload {
    /// Returns a payload of system frame `sfn`, whose high bits replace those in `mib`; k_SSB is
    /// below 16.
    ///
    /// # Errors
    /// [`Error::Sfn`] beyond 1023, [`Error::MibField`] for a field beyond its bits,
    /// [`Error::SsbIndex`] beyond 63.
    pub fn new(mib: Mib, sfn: u16, half_frame: bool, ssb_index: u8) -> Result<Self, Error> {
        let payload = Self {
            mib,
            half_frame,
            ssb_index,
            ..Self::default()
        }
        .with_sfn(sfn)?;
        payload.check()?;
        Ok(payload)
    }

    /// Checks the ranges of all fields.
    ///
    /// # Errors
    /// [`Error::MibField`] for a field beyond its bits, [`Error::SsbIndex`] beyond 63.
    pub fn check(&self) -> Result<(), Error> {
        self.mib.check()?;
        if self.sfn_lsb > 15 {
            return Err(Error::MibField {
                field: "SFN LSBs",
                value: self.sfn_lsb,
                max: 15,
            });
        }
        Lmax::L64.check_index(self.ssb_index)
    }

    /// Returns the payload in another system frame.
    ///
    /// # Errors
    /// [`Error::Sfn`] beyond 1023.
    pub fn with_sfn(mut self, sfn: u16) -> Result<Self, Error> {
        if sfn > 1023 {
            return Err(Error::Sfn(sfn));
        }
        self.mib.sfn_msb = (sfn >> 4) as u8;
        self.sfn_lsb = (sfn & 0xF) as u8;
        Ok(self)
    }

    /// Returns the system frame number, 0 to 1023.
    pub fn sfn(&self) -> u16 {
        u16::from(self.mib.sfn_msb) << 4 | u16::from(self.sfn_lsb)
    }

    /// Returns k_SSB, 0 to 31: the number of subcarriers (of 15 kHz in frequency range 1) from the
    /// first subcarrier of a common resource block to that of the SSB. A value of 24 or more means
    /// that there is no SIB1 (TS 38.213 §4.1).
    pub fn k_ssb(&self) -> u8 {
        u8::from(self.k_ssb_msb) << 4 | self.mib.ssb_subcarrier_offset
    }

    /// Returns a̅ in the order of TS 38.212 §7.1.1: MIB, SFN LSBs, half frame, index or k_SSB bits.
    fn plain_bits(&self, lmax: Lmax) -> u32 {
        let last_three = match lmax {
            Lmax::L64 => u32::from(self.ssb_index >> 3 & 7),
            Lmax::L4 | Lmax::L8 => u32::from(self.k_ssb_msb) << 2,
        };
        self.mib.bits() << 8
            | u32::from(self.sfn_lsb & 0xF) << 4
            | u32::from(self.half_frame) << 3
            | last_three
    }

    /// Returns the interleaved payload a (TS 38.212 §7.1.1).
    pub fn bits(&self, lmax: Lmax) -> u32 {
        let plain = self.plain_bits(lmax);
        PLACE
            .iter()
            .enumerate()
            .fold(0, |interleaved, (i, &place)| {
                interleaved | (plain >> (31 - i) & 1) << (31 - place)
            })
    }

    /// Decodes a payload; inverse of [`bits`](Self::bits), for an SSB with the low index bits
    /// `index_lsb` ([`Lmax::index_lsb`]).
    ///
    /// # Errors
    /// [`Error::MessageClassExtension`] if the payload holds no MIB.
    pub fn from_bits(bits: u32, index_lsb: u8, lmax: Lmax) -> Result<Self, Error> {
        let plain = PLACE.iter().enumerate().fold(0, |plain, (i, &place)| {
            plain | (bits >> (31 - place) & 1) << (31 - i)
        });
        let last_three = (plain & 7) as u8;
        let low = lmax.index_lsb(index_lsb);
        let (ssb_index, k_ssb_msb) = match lmax {
            Lmax::L64 => (last_three << 3 | low, false),
            Lmax::L4 | Lmax::L8 => (low, last_three >> 2 == 1),
        };
        Ok(Self {
            mib: Mib::from_bits(plain >> 8)?,
            sfn_lsb: (plain >> 4 & 0xF) as u8,
            half_frame: plain >> 3 & 1 == 1,
            ssb_index,
            k_ssb_msb,
        })
    }
}

/// Converts a to a′, or a′ to a: adds the sequence that the cell and two bits of the SFN select (TS
/// 38.212 §7.1.2).
///
/// The two SFN bits, the half-frame bit and (Lmax 64) the SSB index bits are not scrambled, so that
/// the operation is its own inverse.
pub fn scramble(payload: u32, pci: Pci, lmax: Lmax) -> u32 {
    let bit = |place: u8| payload >> (31 - place) & 1;
    let v = 2 * bit(SFN_BIT_2) + bit(SFN_BIT_1);
    payload ^ scrambling_sequence(pci, v, lmax)
}

/// Returns s(0)…s(31) for v = 0 to 3.
fn scrambling_sequence(pci: Pci, v: u32, lmax: Lmax) -> u32 {
    let clear = clear_places(lmax);
    let scrambled_count = clear.count_zeros();
    let mut c = Gold::new(u32::from(pci.get()), v * scrambled_count);
    (0..32).fold(0, |s, i| {
        let place = 1 << (31 - i);
        match clear & place {
            0 if c.next() == Some(1) => s | place,
            _ => s,
        }
    })
}

/// Returns the positions that are not scrambled.
fn clear_places(lmax: Lmax) -> u32 {
    let place = |p: u8| 1u32 << (31 - p);
    let always = place(SFN_BIT_2) | place(SFN_BIT_1) | place(HALF_FRAME);
    match lmax {
        Lmax::L64 => INDEX_BITS.iter().fold(always, |all, &p| all | place(p)),
        Lmax::L4 | Lmax::L8 => always,
    }
}
