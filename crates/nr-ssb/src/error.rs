//! What can be wrong with an input of this crate.

/// An input that the standard, or the arithmetic, does not allow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A physical cell identity beyond 1007 (TS 38.211 §7.4.2.1).
    #[error("physical cell identity {0} is out of range: 0 to 1007")]
    Pci(u16),
    /// An SSB index that the burst set does not have.
    #[error("SSB index {index} is out of range: this burst set has indices 0 to {max}", max = .count - 1)]
    SsbIndex {
        /// The index given.
        index: u8,
        /// How many SSBs the burst set can have.
        count: u8,
    },
    /// A system frame number beyond 1023.
    #[error("system frame number {0} is out of range: 0 to 1023")]
    Sfn(u16),
    /// A field of the MIB that its number of bits cannot hold.
    #[error("MIB field {field} = {value} is out of range: 0 to {max}")]
    MibField {
        /// The field's name in TS 38.331.
        field: &'static str,
        /// The value given.
        value: u8,
        /// The largest value allowed.
        max: u8,
    },
    /// The 24 bits are not a MIB but the (empty) message class extension.
    #[error("not a MIB: the BCCH-BCH message is a messageClassExtension")]
    MessageClassExtension,
    /// More than 24 bits given for a MIB.
    #[error("a MIB has 24 bits, but {0:#x} has more")]
    MibTooLong(u32),
    /// An FFT size that does not hold 240 subcarriers with whole cyclic prefixes.
    #[error("FFT size {0} is not a positive multiple of 256")]
    FftSize(usize),
    /// A sample rate that is not an integer multiple of the 256-point rate.
    #[error("sample rate {rate_hz} Hz is not a positive integer multiple of {base_hz} Hz")]
    SampleRate {
        /// The rate given, in hertz.
        rate_hz: f64,
        /// The rate of a 256-point FFT, in hertz.
        base_hz: f64,
    },
    /// A buffer of the wrong length.
    #[error("{what}: {got} samples given, {expected} expected")]
    Length {
        /// Which buffer.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The length it must have.
        expected: usize,
    },
    /// A burst set of a size that its pattern in time does not have.
    #[error("case {case} does not go with Lmax {count}: A, B and C have 4 or 8 SSBs, D and E 64")]
    BurstSet {
        /// The SSB pattern.
        case: &'static str,
        /// The number of SSB indices given.
        count: u8,
    },
    /// The OFDM modulator's subcarrier spacing is not the burst's.
    #[error("the modulator runs at {modulator_khz} kHz, case {case} needs {case_khz} kHz")]
    Spacing {
        /// The modulator's subcarrier spacing, in kilohertz.
        modulator_khz: u32,
        /// The burst's SSB pattern.
        case: &'static str,
        /// That pattern's subcarrier spacing, in kilohertz.
        case_khz: u32,
    },
    /// A list size that the decoder does not support.
    #[error("list size {0} is out of range: 1 to 32")]
    ListSize(usize),
    /// A log-likelihood ratio that is NaN or infinite.
    #[error("log-likelihood ratio {0} is not finite")]
    NonFiniteLlr(usize),
}
