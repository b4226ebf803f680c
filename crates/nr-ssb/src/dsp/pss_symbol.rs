//! PSS in the time domain.

use num_complex::Complex32;

use super::base_rate::SYMBOL_FFT;
use crate::numeric::fft;
use crate::standard::sequence::pss::pss;

/// Returns the PSS in the time domain: 256 samples with unit energy, without cyclic prefix.
pub(crate) fn pss_symbol(n_id_2: u8) -> Vec<Complex32> {
    let mut symbol = vec![Complex32::ZERO; SYMBOL_FFT];
    for (n, chip) in pss(n_id_2).iter().enumerate() {
        let bin = (56 + n + SYMBOL_FFT - 120) % SYMBOL_FFT;
        symbol[bin] = Complex32::new(*chip, 0.0);
    }
    fft::inverse(SYMBOL_FFT).process(&mut symbol);
    // Σ|p|² = 127 · 256 after the unnormalised transform.
    let scale = 1.0 / (127.0 * SYMBOL_FFT as f32).sqrt();
    symbol.iter().map(|sample| sample * scale).collect()
}
