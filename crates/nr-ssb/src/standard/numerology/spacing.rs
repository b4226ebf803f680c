//! The subcarrier spacing.

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
