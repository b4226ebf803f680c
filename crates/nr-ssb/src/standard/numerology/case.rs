//! SSB patterns in a half frame.

use super::burst_set::Lmax;
use super::spacing::SubcarrierSpacing;
use crate::error::Error;

/// SSB pattern in time (TS 38.213 §4.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Case {
    /// 15 kHz, first symbols {2, 8} + 14n.
    A,
    /// 30 kHz, first symbols {4, 8, 16, 20} + 28n.
    B,
    /// 30 kHz, first symbols {2, 8} + 14n.
    C,
    /// 120 kHz, first symbols {4, 8, 16, 20} + 28n, without every fifth n.
    D,
    /// 240 kHz, first symbols {8, 12, 16, 20, 32, 36, 40, 44} + 56n, without every fifth n.
    E,
}

impl Case {
    /// All patterns.
    pub const ALL: [Self; 5] = [Self::A, Self::B, Self::C, Self::D, Self::E];

    /// Returns the subcarrier spacing of the pattern.
    pub const fn spacing(self) -> SubcarrierSpacing {
        match self {
            Self::A => SubcarrierSpacing::Khz15,
            Self::B | Self::C => SubcarrierSpacing::Khz30,
            Self::D => SubcarrierSpacing::Khz120,
            Self::E => SubcarrierSpacing::Khz240,
        }
    }

    /// Returns the letter of the pattern.
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::C => "C",
            Self::D => "D",
            Self::E => "E",
        }
    }

    /// Returns the maximum burst set size of the pattern.
    pub const fn lmax(self) -> Lmax {
        match self {
            Self::A | Self::B | Self::C => Lmax::L8,
            Self::D | Self::E => Lmax::L64,
        }
    }

    /// Returns the first OFDM symbol of SSB `index`, relative to the start of its half frame.
    ///
    /// ```
    /// use nr_ssb::Case;
    /// let symbols: Vec<usize> = (0..8).map(|i| Case::B.start_symbol(i)).collect::<Result<_, _>>()?;
    /// assert_eq!(symbols, [4, 8, 16, 20, 32, 36, 44, 48]);
    /// assert_eq!(Case::E.start_symbol(63)?, 492);
    /// # Ok::<(), nr_ssb::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::SsbIndex`] beyond 7 for the cases A to C, beyond 63 for D and E.
    pub fn start_symbol(self, index: u8) -> Result<usize, Error> {
        self.lmax().check_index(index)?;
        let i = usize::from(index);
        // In frequency range 2, every fifth pair of slots is reserved for the uplink.
        let n = |per_n: usize| i / per_n + i / (4 * per_n);
        Ok(match self {
            Self::A | Self::C => 14 * (i / 2) + 2 + 6 * (i % 2),
            Self::B => 28 * (i / 4) + 12 * (i / 2 % 2) + 4 + 4 * (i % 2),
            Self::D => 28 * n(4) + 12 * (i / 2 % 2) + 4 + 4 * (i % 2),
            Self::E => 56 * n(8) + 24 * (i / 4 % 2) + 8 + 4 * (i % 4),
        })
    }
}
