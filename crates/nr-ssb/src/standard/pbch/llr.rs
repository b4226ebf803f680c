//! Log-likelihood ratios of QPSK symbols.

use num_complex::Complex32;

use crate::standard::coding::rate_matching::E;
use crate::standard::grid::PBCH_LEN;

/// Computes the log-likelihood ratios of the 864 bits of equalised QPSK symbols in complex noise of
/// variance `noise_variance` (per symbol): 2√2·Re/σ², 2√2·Im/σ².
pub fn llr(symbols: &[Complex32; PBCH_LEN], noise_variance: f32, llr: &mut [f32; E]) {
    let scale = 2.0 * std::f32::consts::SQRT_2 / noise_variance;
    for (pair, symbol) in llr.as_chunks_mut().0.iter_mut().zip(symbols) {
        *pair = [symbol.re * scale, symbol.im * scale];
    }
}
