//! Decibels.

/// 10 log10, of zero or nothing the finite −300 dB.
pub(crate) fn decibel(ratio: f64) -> f64 {
    if ratio > 1e-30 {
        (10.0 * ratio.log10()).min(300.0)
    } else {
        -300.0
    }
}
