//! Subcarrier spacing.

/// Lower end of the raster of frequency range 2 (TS 38.104 Table 5.4.3.1-1), in Hz.
pub(crate) const FR2_FROM_HZ: f64 = 24.25e9;

/// Subcarrier spacing of the SSB (TS 38.104 §5.4.3.3): 15 and 30 kHz in frequency range 1, 120 and
/// 240 kHz in frequency range 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SubcarrierSpacing {
    /// 15 kHz, μ = 0.
    Khz15,
    /// 30 kHz, μ = 1.
    Khz30,
    /// 120 kHz, μ = 3.
    Khz120,
    /// 240 kHz, μ = 4.
    Khz240,
}

impl SubcarrierSpacing {
    /// All spacings.
    pub const ALL: [Self; 4] = [Self::Khz15, Self::Khz30, Self::Khz120, Self::Khz240];

    /// Returns the spacing in kilohertz, if an SSB can have it.
    pub fn from_khz(khz: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|spacing| spacing.khz() == khz)
    }

    /// Returns the spacings of the frequency range that contains `frequency_hz`.
    pub fn of_range(frequency_hz: f64) -> [Self; 2] {
        if frequency_hz < FR2_FROM_HZ {
            [Self::Khz15, Self::Khz30]
        } else {
            [Self::Khz120, Self::Khz240]
        }
    }

    /// Returns the spacing in kilohertz.
    pub const fn khz(self) -> u32 {
        match self {
            Self::Khz15 => 15,
            Self::Khz30 => 30,
            Self::Khz120 => 120,
            Self::Khz240 => 240,
        }
    }

    /// Returns the spacing in hertz.
    pub fn hz(self) -> f64 {
        f64::from(self.khz()) * 1e3
    }

    /// Returns the sample rate of a 256-point FFT in hertz: the base rate of this crate.
    pub fn base_rate_hz(self) -> f64 {
        256.0 * self.hz()
    }

    /// Returns the number of OFDM symbols in half a millisecond; the first one has a longer cyclic
    /// prefix.
    pub const fn symbols_per_half_ms(self) -> usize {
        7 * (self.khz() / 15) as usize
    }

    /// Returns the number of OFDM symbols in a half frame of 5 ms.
    pub const fn symbols_per_half_frame(self) -> usize {
        10 * self.symbols_per_half_ms()
    }
}
