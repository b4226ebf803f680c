//! Noise for unit tests.

use num_complex::Complex32;

/// Returns white noise of unit power, nearly Gaussian, from a linear congruential generator.
pub(crate) fn noise(seed: u64, length: usize) -> Vec<Complex32> {
    let mut state = seed;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        // A sum of four uniform numbers has rare extremes.
        (0..4)
            .map(|i| (state >> (16 * i) & 0xFFFF) as f32 / 65536.0 - 0.5)
            .sum::<f32>()
            * 1.5_f32.sqrt()
    };
    (0..length)
        .map(|_| Complex32::new(next(), next()))
        .collect()
}
