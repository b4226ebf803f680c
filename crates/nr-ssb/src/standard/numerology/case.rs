//! The pattern of the SSBs in a half frame.

use super::burst_set::Lmax;
use super::spacing::SubcarrierSpacing;
use crate::error::Error;

/// SSB pattern in time (TS 38.213 §4.1), frequency range 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Case {
    /// 15 kHz, first symbols {2, 8} + 14n.
    A,
    /// 30 kHz, first symbols {4, 8, 16, 20} + 28n.
    B,
    /// 30 kHz, first symbols {2, 8} + 14n.
    C,
}

impl Case {
    /// The pattern's subcarrier spacing.
    pub const fn spacing(self) -> SubcarrierSpacing {
        match self {
            Self::A => SubcarrierSpacing::Khz15,
            Self::B | Self::C => SubcarrierSpacing::Khz30,
        }
    }

    /// The pattern's letter.
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::C => "C",
        }
    }

    /// First OFDM symbol of SSB `index` (0 to 7), counted from the start of its half frame.
    ///
    /// ```
    /// use nr_ssb::Case;
    /// let symbols: Vec<usize> = (0..8).map(|i| Case::B.start_symbol(i)).collect::<Result<_, _>>()?;
    /// assert_eq!(symbols, [4, 8, 16, 20, 32, 36, 44, 48]);
    /// # Ok::<(), nr_ssb::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::SsbIndex`] beyond 7.
    pub fn start_symbol(self, index: u8) -> Result<usize, Error> {
        Lmax::L8.check_index(index)?;
        let i = usize::from(index);
        Ok(match self {
            Self::A | Self::C => 14 * (i / 2) + 2 + 6 * (i % 2),
            Self::B => 28 * (i / 4) + 12 * (i / 2 % 2) + 4 + 4 * (i % 2),
        })
    }
}
