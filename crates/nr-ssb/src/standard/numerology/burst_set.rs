//! Burst set size.

use crate::error::Error;

/// Maximum number of SSBs per burst set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Lmax {
    /// Carriers up to 3 GHz (below 1.88 GHz for case C in unpaired spectrum).
    L4,
    /// Other carriers in frequency range 1.
    L8,
    /// Frequency range 2.
    L64,
}

impl Lmax {
    /// All burst set sizes.
    pub const ALL: [Self; 3] = [Self::L4, Self::L8, Self::L64];

    /// Returns the number of SSB indices.
    pub const fn count(self) -> u8 {
        match self {
            Self::L4 => 4,
            Self::L8 => 8,
            Self::L64 => 64,
        }
    }

    /// Returns the low bits of the SSB index, v, which select the PBCH scrambling (TS 38.211
    /// §7.3.3.1).
    pub const fn index_lsb(self, ssb_index: u8) -> u8 {
        match self {
            Self::L4 => ssb_index & 3,
            Self::L8 | Self::L64 => ssb_index & 7,
        }
    }

    /// Checks that the burst set contains an SSB index.
    ///
    /// # Errors
    /// [`Error::SsbIndex`] for an index that this burst set does not have.
    pub fn check_index(self, index: u8) -> Result<(), Error> {
        let count = self.count();
        if index < count {
            Ok(())
        } else {
            Err(Error::SsbIndex { index, count })
        }
    }
}
