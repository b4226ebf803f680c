//! Kernels for AVX2 with FMA, and for AVX-512.
//!
//! Complex samples keep their memory layout (interleaved real and imaginary parts), and a second
//! register contains them exchanged. With `v` the samples of one antenna and `x` those of another,
//! the lanes of `v x` sum up to the real part of `v conj(x)`. For `v` times the exchanged `x`, the
//! odd lanes minus the even lanes sum up to the imaginary part.

use std::arch::x86_64::{__m128d, _mm_addsub_pd, _mm_cvtsd_f64, _mm_unpackhi_pd, _mm_unpacklo_pd};

use num_complex::Complex64;

use super::loops::kernels;

/// Returns the real part `direct_0 + direct_1` and the imaginary part `crossed_1 - crossed_0`.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn parts_pd(direct: __m128d, crossed: __m128d) -> Complex64 {
    let (low, high) = (
        _mm_unpacklo_pd(crossed, direct),
        _mm_unpackhi_pd(crossed, direct),
    );
    let parts = _mm_addsub_pd(high, low);
    Complex64::new(
        _mm_cvtsd_f64(_mm_unpackhi_pd(parts, parts)),
        _mm_cvtsd_f64(parts),
    )
}

kernels!(
    avx2_f64, x86_64, "avx2,fma", f64, 2,
    __m256d, _mm256_setzero_pd(),
    load: |chunk: &Chunk| {
        // SAFETY: the chunk has the number of values that the instruction loads.
        #[allow(unsafe_code)]
        let v = unsafe { _mm256_loadu_pd(chunk.as_ptr().cast()) };
        (v, _mm256_permute_pd::<0b0101>(v))
    },
    direct: |sum, (v, _): Pair, (x, _): Pair| _mm256_fmadd_pd(v, x, sum),
    crossed: |sum, (v, _): Pair, (_, x): Pair| _mm256_fmadd_pd(v, x, sum),
    total: |direct, crossed| {
        let halve = |v| _mm_add_pd(_mm256_castpd256_pd128(v), _mm256_extractf128_pd::<1>(v));
        parts_pd(halve(direct), halve(crossed))
    },
);
kernels!(
    avx2_f32, x86_64, "avx2,fma", f32, 4,
    __m256, _mm256_setzero_ps(),
    load: |chunk: &Chunk| {
        // SAFETY: the chunk has the number of values that the instruction loads.
        #[allow(unsafe_code)]
        let v = unsafe { _mm256_loadu_ps(chunk.as_ptr().cast()) };
        (v, _mm256_permute_ps::<0b10_11_00_01>(v))
    },
    direct: |sum, (v, _): Pair, (x, _): Pair| _mm256_fmadd_ps(v, x, sum),
    crossed: |sum, (v, _): Pair, (_, x): Pair| _mm256_fmadd_ps(v, x, sum),
    total: |direct, crossed| {
        let halve = |v| {
            let half = _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps::<1>(v));
            _mm_cvtps_pd(_mm_add_ps(half, _mm_movehl_ps(half, half)))
        };
        parts_pd(halve(direct), halve(crossed))
    },
);
kernels!(
    avx512_f64, x86_64, "avx2,fma,avx512f", f64, 4,
    __m512d, _mm512_setzero_pd(),
    load: |chunk: &Chunk| {
        // SAFETY: the chunk has the number of values that the instruction loads.
        #[allow(unsafe_code)]
        let v = unsafe { _mm512_loadu_pd(chunk.as_ptr().cast()) };
        (v, _mm512_permute_pd::<0b0101_0101>(v))
    },
    direct: |sum, (v, _): Pair, (x, _): Pair| _mm512_fmadd_pd(v, x, sum),
    crossed: |sum, (v, _): Pair, (_, x): Pair| _mm512_fmadd_pd(v, x, sum),
    total: |direct, crossed| {
        let halve = |v| {
            let half = _mm256_add_pd(_mm512_castpd512_pd256(v), _mm512_extractf64x4_pd::<1>(v));
            _mm_add_pd(_mm256_castpd256_pd128(half), _mm256_extractf128_pd::<1>(half))
        };
        parts_pd(halve(direct), halve(crossed))
    },
);
