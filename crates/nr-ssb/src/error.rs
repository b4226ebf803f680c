//! Errors for invalid inputs of this crate.

/// Input that violates the standard, or is arithmetically invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A physical cell identity beyond 1007 (TS 38.211 §7.4.2.1).
    #[error("physical cell identity {0} is out of range: 0 to 1007")]
    Pci(u16),
    /// SSB index that the burst set does not contain.
    #[error("SSB index {index} is out of range: this burst set has indices 0 to {max}", max = .count - 1)]
    SsbIndex {
        /// The index given.
        index: u8,
        /// Number of SSB indices of the burst set.
        count: u8,
    },
    /// A system frame number beyond 1023.
    #[error("system frame number {0} is out of range: 0 to 1023")]
    Sfn(u16),
    /// Field of the MIB that exceeds its number of bits.
    #[error("MIB field {field} = {value} is out of range: 0 to {max}")]
    MibField {
        /// The field's name in TS 38.331.
        field: &'static str,
        /// The value given.
        value: u8,
        /// The largest value allowed.
        max: u8,
    },
    /// The 24 bits are not a MIB, but the (empty) message class extension.
    #[error("not a MIB: the BCCH-BCH message is a messageClassExtension")]
    MessageClassExtension,
    /// More than 24 bits given for a MIB.
    #[error("a MIB has 24 bits, but {0:#x} has more")]
    MibTooLong(u32),
    /// FFT size that does not contain 240 subcarriers with integer cyclic prefixes.
    #[error("FFT size {0} is not a positive multiple of 256")]
    FftSize(usize),
    /// Sample rate that is not an integer multiple of the 256-point rate.
    #[error("sample rate {rate_hz} Hz is not a positive integer multiple of {base_hz} Hz")]
    SampleRate {
        /// Sample rate, in hertz.
        rate_hz: f64,
        /// Rate of a 256-point FFT, in hertz.
        base_hz: f64,
    },
    /// Buffer of the wrong length.
    #[error("{what}: {got} samples given, {expected} expected")]
    Length {
        /// Name of the buffer.
        what: &'static str,
        /// Actual length.
        got: usize,
        /// Required length.
        expected: usize,
    },
    /// Burst set size that is impossible for its pattern in time.
    #[error("case {case} does not permit Lmax = {count}: A, B and C have 4 or 8 SSBs, D and E 64")]
    BurstSet {
        /// The SSB pattern.
        case: &'static str,
        /// Number of SSB indices.
        count: u8,
    },
    /// Subcarrier spacing of the OFDM modulator that differs from that of the burst.
    #[error("the modulator runs at {modulator_khz} kHz, case {case} needs {case_khz} kHz")]
    Spacing {
        /// Subcarrier spacing of the modulator, in kilohertz.
        modulator_khz: u32,
        /// SSB pattern of the burst.
        case: &'static str,
        /// Subcarrier spacing of that pattern, in kilohertz.
        case_khz: u32,
    },
    /// Unsupported list size of the decoder.
    #[error("list size {0} is out of range: 1 to 32")]
    ListSize(usize),
    /// Log-likelihood ratio that is NaN or infinite.
    #[error("log-likelihood ratio {0} is not finite")]
    NonFiniteLlr(usize),
}
