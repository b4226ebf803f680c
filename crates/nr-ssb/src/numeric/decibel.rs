//! Decibels.

/// Returns 10 log₁₀ of a ratio; −300 dB for zero and below.
pub(crate) fn decibel(ratio: f64) -> f64 {
    if ratio > 1e-30 {
        (10.0 * ratio.log10()).min(300.0)
    } else {
        -300.0
    }
}
