//! Lengths in samples at the base rate of the receiver, 256 samples per symbol.

use crate::standard::grid::SYMBOLS;

/// Samples of an OFDM symbol without its cyclic prefix.
pub const SYMBOL_FFT: usize = 256;
/// Samples of the cyclic prefix of each symbol.
pub const CYCLIC_PREFIX: usize = 18;
/// Samples of an OFDM symbol with its cyclic prefix.
pub const SYMBOL_SAMPLES: usize = SYMBOL_FFT + CYCLIC_PREFIX;
/// Samples of an SSB including all cyclic prefixes.
pub const SSB_SAMPLES: usize = SYMBOLS * SYMBOL_SAMPLES;
