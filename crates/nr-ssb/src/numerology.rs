//! Where an SSB lies in time: subcarrier spacings, SSB patterns, symbols and cyclic prefixes.

use crate::Error;

/// Subcarrier spacing of the SSB in frequency range 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SubcarrierSpacing {
    /// 15 kHz, μ = 0.
    Khz15,
    /// 30 kHz, μ = 1.
    Khz30,
}

impl SubcarrierSpacing {
    /// In kilohertz.
    pub const fn khz(self) -> u32 {
        match self {
            Self::Khz15 => 15,
            Self::Khz30 => 30,
        }
    }

    /// In hertz.
    pub fn hz(self) -> f64 {
        f64::from(self.khz()) * 1e3
    }

    /// Sample rate of a 256-point FFT, in hertz: the lowest rate that this crate works at.
    pub fn base_rate_hz(self) -> f64 {
        256.0 * self.hz()
    }

    /// OFDM symbols in half a millisecond; the first of them has the longer cyclic prefix.
    pub const fn symbols_per_half_ms(self) -> usize {
        match self {
            Self::Khz15 => 7,
            Self::Khz30 => 14,
        }
    }

    /// OFDM symbols in a half frame of 5 ms.
    pub const fn symbols_per_half_frame(self) -> usize {
        10 * self.symbols_per_half_ms()
    }
}

/// How many SSBs a burst set can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Lmax {
    /// Carriers up to 3 GHz (1.88 GHz where case C is used in TDD bands).
    L4,
    /// Carriers up to 6 GHz.
    L8,
    /// Frequency range 2; in this crate only in the coding chain.
    L64,
}

impl Lmax {
    /// The number of SSB indices.
    pub const fn count(self) -> u8 {
        match self {
            Self::L4 => 4,
            Self::L8 => 8,
            Self::L64 => 64,
        }
    }

    /// The low bits of the SSB index, v, which select the PBCH scrambling (TS 38.211 §7.3.3.1).
    pub const fn index_lsb(self, ssb_index: u8) -> u8 {
        match self {
            Self::L4 => ssb_index & 3,
            Self::L8 | Self::L64 => ssb_index & 7,
        }
    }

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

/// A subcarrier spacing sampled with a given FFT size.
///
/// Cyclic prefixes are those of TS 38.211 §5.3.1, 144 samples in 2048, and 16κ longer (κT_c ≈ 32.6 ns,
/// 16 samples at 30.72 Msps) at every start of 0.5 ms. A multiple of 256 keeps them whole.
///
/// ```
/// use nr_ssb::{Numerology, SubcarrierSpacing};
/// let numerology = Numerology::new(SubcarrierSpacing::Khz15, 256)?;
/// assert_eq!(numerology.sample_rate_hz(), 3.84e6);
/// assert_eq!((numerology.cp_len(0), numerology.cp_len(1)), (20, 18));
/// # Ok::<(), nr_ssb::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Numerology {
    spacing: SubcarrierSpacing,
    fft_size: usize,
}

impl Numerology {
    /// # Errors
    /// [`Error::FftSize`] unless `fft_size` is a positive multiple of 256.
    pub fn new(spacing: SubcarrierSpacing, fft_size: usize) -> Result<Self, Error> {
        if fft_size == 0 || !fft_size.is_multiple_of(256) {
            return Err(Error::FftSize(fft_size));
        }
        Ok(Self { spacing, fft_size })
    }

    /// The numerology whose sample rate is `rate_hz`.
    ///
    /// # Errors
    /// [`Error::SampleRate`] unless the rate is a positive integer multiple of
    /// [`SubcarrierSpacing::base_rate_hz`].
    pub fn from_sample_rate(spacing: SubcarrierSpacing, rate_hz: f64) -> Result<Self, Error> {
        let base_hz = spacing.base_rate_hz();
        let multiple = rate_hz / base_hz;
        if !(1.0..=65536.0).contains(&multiple) || multiple.fract() != 0.0 {
            return Err(Error::SampleRate { rate_hz, base_hz });
        }
        Self::new(spacing, 256 * multiple as usize)
    }

    /// The subcarrier spacing.
    pub const fn spacing(self) -> SubcarrierSpacing {
        self.spacing
    }

    /// Samples of an OFDM symbol without its cyclic prefix.
    pub const fn fft_size(self) -> usize {
        self.fft_size
    }

    /// In hertz.
    pub fn sample_rate_hz(self) -> f64 {
        self.fft_size as f64 * self.spacing.hz()
    }

    /// Samples of the cyclic prefix inside an SSB, 18 per 256.
    pub const fn ssb_cp_len(self) -> usize {
        9 * (self.fft_size / 128)
    }

    /// Samples from one OFDM symbol of an SSB to the next, 274 per 256.
    pub const fn ssb_symbol_len(self) -> usize {
        self.fft_size + self.ssb_cp_len()
    }

    /// Samples of the cyclic prefix of OFDM symbol `symbol` of the half frame.
    pub const fn cp_len(self, symbol: usize) -> usize {
        if symbol.is_multiple_of(self.spacing.symbols_per_half_ms()) {
            self.ssb_cp_len() + self.long_cp_extra()
        } else {
            self.ssb_cp_len()
        }
    }

    /// First sample of the cyclic prefix of OFDM symbol `symbol`, from the start of the half frame.
    pub const fn symbol_start(self, symbol: usize) -> usize {
        let long_ones_before = symbol.div_ceil(self.spacing.symbols_per_half_ms());
        symbol * self.ssb_symbol_len() + long_ones_before * self.long_cp_extra()
    }

    /// Samples of a half frame of 5 ms.
    pub const fn half_frame_len(self) -> usize {
        self.symbol_start(self.spacing.symbols_per_half_frame())
    }

    /// 16κ: 16 samples at 30.72 Msps.
    const fn long_cp_extra(self) -> usize {
        match self.spacing {
            SubcarrierSpacing::Khz15 => self.fft_size / 128,
            SubcarrierSpacing::Khz30 => self.fft_size / 64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_frame_is_five_milliseconds_at_every_rate() {
        for spacing in [SubcarrierSpacing::Khz15, SubcarrierSpacing::Khz30] {
            for fft_size in (1..=16).map(|n| 256 * n) {
                let numerology = Numerology::new(spacing, fft_size).unwrap();
                let expected = 5e-3 * numerology.sample_rate_hz();
                assert_eq!(numerology.half_frame_len() as f64, expected);
                for symbol in 0..spacing.symbols_per_half_frame() {
                    let length =
                        numerology.symbol_start(symbol + 1) - numerology.symbol_start(symbol);
                    assert_eq!(length, fft_size + numerology.cp_len(symbol));
                }
            }
        }
    }

    #[test]
    fn ssb_symbols_have_the_short_prefix() {
        for case in [Case::A, Case::B, Case::C] {
            let numerology = Numerology::new(case.spacing(), 512).unwrap();
            for index in 0..8 {
                let start = case.start_symbol(index).unwrap();
                for symbol in start..start + 4 {
                    assert_eq!(numerology.cp_len(symbol), numerology.ssb_cp_len());
                }
            }
        }
    }

    #[test]
    fn refuses_rates_between_multiples() {
        let spacing = SubcarrierSpacing::Khz30;
        assert_eq!(
            Numerology::from_sample_rate(spacing, 15.36e6).map(Numerology::fft_size),
            Ok(512)
        );
        for rate_hz in [0.0, -7.68e6, 7.7e6, f64::NAN, f64::INFINITY] {
            let result = Numerology::from_sample_rate(spacing, rate_hz);
            assert!(matches!(result, Err(Error::SampleRate { .. })), "{rate_hz}");
        }
        for fft_size in [0, 128, 300] {
            assert_eq!(
                Numerology::new(spacing, fft_size),
                Err(Error::FftSize(fft_size))
            );
        }
        assert!(matches!(
            Case::A.start_symbol(8),
            Err(Error::SsbIndex { .. })
        ));
    }
}
