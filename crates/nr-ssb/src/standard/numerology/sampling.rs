//! Symbols and cyclic prefixes in samples.

use super::spacing::SubcarrierSpacing;
use crate::error::Error;

/// Subcarrier spacing and FFT size.
///
/// The cyclic prefix (TS 38.211 §5.3.1) is 144 of 2048 samples, and 16κ longer (κT_c ≈ 32.6 ns, 16
/// samples at 30.72 Msps) at every multiple of 0.5 ms. With a multiple of 256 it is an integer
/// number of samples.
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
    /// Creates a numerology with `fft_size` samples per OFDM symbol without its cyclic prefix.
    ///
    /// # Errors
    /// [`Error::FftSize`] unless `fft_size` is a positive multiple of 256.
    pub fn new(spacing: SubcarrierSpacing, fft_size: usize) -> Result<Self, Error> {
        if fft_size == 0 || !fft_size.is_multiple_of(256) {
            return Err(Error::FftSize(fft_size));
        }
        Ok(Self { spacing, fft_size })
    }

    /// Returns the numerology with the sample rate `rate_hz`.
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

    /// Returns the subcarrier spacing.
    pub const fn spacing(self) -> SubcarrierSpacing {
        self.spacing
    }

    /// Returns the number of samples of an OFDM symbol without its cyclic prefix.
    pub const fn fft_size(self) -> usize {
        self.fft_size
    }

    /// Returns the sample rate in hertz.
    pub fn sample_rate_hz(self) -> f64 {
        self.fft_size as f64 * self.spacing.hz()
    }

    /// Returns the number of samples of the cyclic prefix inside an SSB, 18 per 256.
    pub const fn ssb_cp_len(self) -> usize {
        9 * (self.fft_size / 128)
    }

    /// Returns the number of samples from one OFDM symbol of an SSB to the next, 274 per 256.
    pub const fn ssb_symbol_len(self) -> usize {
        self.fft_size + self.ssb_cp_len()
    }

    /// Returns the number of samples of the cyclic prefix of OFDM symbol `symbol` of the half
    /// frame.
    pub const fn cp_len(self, symbol: usize) -> usize {
        if symbol.is_multiple_of(self.spacing.symbols_per_half_ms()) {
            self.ssb_cp_len() + self.long_cp_extra()
        } else {
            self.ssb_cp_len()
        }
    }

    /// Returns the first sample of the cyclic prefix of OFDM symbol `symbol`, from the start of the
    /// half frame.
    pub const fn symbol_start(self, symbol: usize) -> usize {
        let long_ones_before = symbol.div_ceil(self.spacing.symbols_per_half_ms());
        symbol * self.ssb_symbol_len() + long_ones_before * self.long_cp_extra()
    }

    /// Returns the number of samples of a half frame of 5 ms.
    pub const fn half_frame_len(self) -> usize {
        self.symbol_start(self.spacing.symbols_per_half_frame())
    }

    /// Returns the additional samples of a long cyclic prefix: 16κ, which are 16 samples at 30.72
    /// Msps.
    const fn long_cp_extra(self) -> usize {
        self.fft_size / 128 * (self.spacing.khz() / 15) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::Case;
    use super::*;

    #[test]
    fn half_frame_is_five_milliseconds_at_every_rate() {
        for spacing in SubcarrierSpacing::ALL {
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
        for case in Case::ALL {
            let numerology = Numerology::new(case.spacing(), 512).unwrap();
            for index in 0..case.lmax().count() {
                let start = case.start_symbol(index).unwrap();
                for symbol in start..start + 4 {
                    assert_eq!(numerology.cp_len(symbol), numerology.ssb_cp_len());
                }
            }
        }
    }

    #[test]
    fn fft_sizes_that_are_no_multiple_of_256_are_rejected() {
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
