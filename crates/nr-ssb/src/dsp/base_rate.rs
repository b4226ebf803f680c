//! Lengths at the base rate of 256 samples a symbol, which the receiver works at.

use crate::standard::grid::SYMBOLS;

/// Samples of an OFDM symbol at the base rate, without its cyclic prefix.
pub const SYMBOL_FFT: usize = 256;
/// Samples of the cyclic prefix of every symbol of an SSB.
pub const CYCLIC_PREFIX: usize = 18;
/// Samples from one symbol of an SSB to the next.
pub const SYMBOL_SAMPLES: usize = SYMBOL_FFT + CYCLIC_PREFIX;
/// Samples from the first of an SSB's cyclic prefix to its last.
pub const SSB_SAMPLES: usize = SYMBOLS * SYMBOL_SAMPLES;
