//! Kernels for NEON, which is part of every aarch64 processor.
//!
//! A de-interleaving load puts the real parts and the imaginary parts into separate registers, so
//! that no product requires a shuffle.

use super::loops::kernels;

kernels!(
    neon_f64, aarch64, "neon", f64, 2,
    float64x2_t, vdupq_n_f64(0.0),
    load: |chunk: &Chunk| {
        // SAFETY: the chunk has the number of complex samples that the instruction loads.
        #[allow(unsafe_code)]
        let float64x2x2_t(re, im) = unsafe { vld2q_f64(chunk.as_ptr().cast()) };
        (re, im)
    },
    direct: |sum, (a, b): Pair, (c, d): Pair| vfmaq_f64(vfmaq_f64(sum, a, c), b, d),
    crossed: |sum, (a, b): Pair, (c, d): Pair| vfmsq_f64(vfmaq_f64(sum, b, c), a, d),
    total: |direct, crossed| Complex64::new(vaddvq_f64(direct), vaddvq_f64(crossed)),
);
kernels!(
    neon_f32, aarch64, "neon", f32, 4,
    float32x4_t, vdupq_n_f32(0.0),
    load: |chunk: &Chunk| {
        // SAFETY: the chunk has the number of complex samples that the instruction loads.
        #[allow(unsafe_code)]
        let float32x4x2_t(re, im) = unsafe { vld2q_f32(chunk.as_ptr().cast()) };
        (re, im)
    },
    direct: |sum, (a, b): Pair, (c, d): Pair| vfmaq_f32(vfmaq_f32(sum, a, c), b, d),
    crossed: |sum, (a, b): Pair, (c, d): Pair| vfmsq_f32(vfmaq_f32(sum, b, c), a, d),
    total: |direct, crossed| {
        Complex64::new(vaddvq_f32(direct).into(), vaddvq_f32(crossed).into())
    },
);
