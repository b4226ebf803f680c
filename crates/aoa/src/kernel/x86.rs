//! Kernels for AVX2 with FMA, and for AVX-512.
//!
//! Complex samples are left as they lie in memory, real and imaginary parts in turn. With `v` the
//! samples of one antenna and `w` those of another, the lanes of `v w` sum to the real part of
//! `v conj(w)`; of `v` times `w` with its parts exchanged, the odd lanes less the even ones sum to the
//! imaginary part.

use std::arch::x86_64::{__m128d, _mm_addsub_pd, _mm_cvtsd_f64, _mm_unpackhi_pd, _mm_unpacklo_pd};

use num_complex::Complex64;

/// The real part `direct_0 + direct_1` and the imaginary part `crossed_1 - crossed_0`.
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

macro_rules! kernels {
    (
        $module:ident, $features:literal, $real:ident, $vector:ident,
        $complexes:literal, [$($lane:literal $part:ident),*],
        $set:ident, $zero:ident, $add:ident, $mul:ident, $fma:ident, $exchange:expr, $total:expr
    ) => {
        pub(in crate::kernel) mod $module {
            use std::arch::x86_64::*;

            use num_complex::{Complex, Complex64};

            use crate::kernel::x86::parts_pd;
            use crate::kernel::portable;
            use crate::kernel::portable::shortest;
            use crate::linalg::matrix::{Matrix, zeros};

            /// The samples from `start` on.
            #[target_feature(enable = $features)]
            #[inline]
            fn load(samples: &[Complex<$real>], start: usize) -> $vector {
                let chunk = &samples[start..start + $complexes];
                $set($(chunk[$lane].$part),*)
            }

            /// The complex number whose real part is the sum of the lanes of `direct`, and whose
            /// imaginary part that of the odd less that of the even lanes of `crossed`.
            #[target_feature(enable = $features)]
            #[inline]
            fn total(direct: $vector, crossed: $vector) -> Complex64 {
                $total(direct, crossed)
            }

            #[target_feature(enable = $features)]
            pub(in crate::kernel) fn products<const N: usize>(
                channels: &[&[Complex<$real>]; N],
            ) -> Matrix<N> {
                let length = shortest(channels);
                let (mut direct, mut crossed) = ([[$zero(); N]; N], [[$zero(); N]; N]);
                let mut start = 0;
                while start + $complexes <= length {
                    let (mut v, mut w) = ([$zero(); N], [$zero(); N]);
                    for n in 0..N {
                        v[n] = load(channels[n], start);
                        w[n] = $exchange(v[n]);
                    }
                    // Bounds known to the compiler keep the sums in registers.
                    for i in 0..N {
                        for j in 0..N {
                            if j <= i {
                                direct[i][j] = $fma(v[i], v[j], direct[i][j]);
                            }
                            if j < i {
                                crossed[i][j] = $fma(v[i], w[j], crossed[i][j]);
                            }
                        }
                    }
                    start += $complexes;
                }
                let mut matrix = zeros::<N>();
                for i in 0..N {
                    for j in 0..N {
                        if j <= i {
                            matrix[i][j] = total(direct[i][j], crossed[i][j]);
                        }
                    }
                }
                if start < length {
                    portable::add_products(channels, start, &mut matrix);
                }
                for i in 0..N {
                    for j in 0..i {
                        matrix[j][i] = matrix[i][j].conj();
                    }
                }
                matrix
            }

            /// Adds what the samples from `start` on contribute to each lag.
            #[target_feature(enable = $features)]
            #[inline]
            fn add_products<const N: usize>(
                (direct, crossed): &mut ([$vector; N], [$vector; N]),
                channels: &[&[Complex<$real>]; N],
                start: usize,
            ) {
                let (mut v, mut w) = ([$zero(); N], [$zero(); N]);
                for n in 0..N {
                    v[n] = load(channels[n], start);
                    w[n] = $exchange(v[n]);
                }
                // The products of one k are added up first: fewer additions then wait for one
                // another.
                for k in 0..N {
                    let mut straight = $mul(v[k], v[0]);
                    for n in 1..N - k {
                        straight = $fma(v[n + k], v[n], straight);
                    }
                    direct[k] = $add(direct[k], straight);
                }
                for k in 1..N {
                    let mut across = $mul(v[k], w[0]);
                    for n in 1..N - k {
                        across = $fma(v[n + k], w[n], across);
                    }
                    crossed[k] = $add(crossed[k], across);
                }
            }

            #[target_feature(enable = $features)]
            pub(in crate::kernel) fn lags<const N: usize>(
                channels: &[&[Complex<$real>]; N],
            ) -> [Complex64; N] {
                let length = shortest(channels);
                let mut sums = ([$zero(); N], [$zero(); N]);
                let mut start = 0;
                while start + $complexes <= length {
                    add_products(&mut sums, channels, start);
                    start += $complexes;
                }
                let (direct, crossed) = sums;
                let mut lags = [Complex64::ZERO; N];
                for k in 0..N {
                    lags[k] = total(direct[k], crossed[k]);
                }
                if start < length {
                    portable::add_lags(channels, start, &mut lags);
                }
                lags
            }
        }
    };
}

kernels!(
    avx2_f64, "avx2,fma", f64, __m256d, 2, [1 im, 1 re, 0 im, 0 re],
    _mm256_set_pd, _mm256_setzero_pd, _mm256_add_pd, _mm256_mul_pd, _mm256_fmadd_pd,
    _mm256_permute_pd::<0b0101>,
    |direct, crossed| {
        let halve = |v| _mm_add_pd(_mm256_castpd256_pd128(v), _mm256_extractf128_pd::<1>(v));
        parts_pd(halve(direct), halve(crossed))
    }
);
kernels!(
    avx2_f32, "avx2,fma", f32, __m256, 4, [3 im, 3 re, 2 im, 2 re, 1 im, 1 re, 0 im, 0 re],
    _mm256_set_ps, _mm256_setzero_ps, _mm256_add_ps, _mm256_mul_ps, _mm256_fmadd_ps,
    _mm256_permute_ps::<0b10_11_00_01>,
    |direct, crossed| {
        let halve = |v| {
            let half = _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps::<1>(v));
            _mm_cvtps_pd(_mm_add_ps(half, _mm_movehl_ps(half, half)))
        };
        parts_pd(halve(direct), halve(crossed))
    }
);
kernels!(
    avx512_f64, "avx2,fma,avx512f", f64, __m512d,
    4, [3 im, 3 re, 2 im, 2 re, 1 im, 1 re, 0 im, 0 re],
    _mm512_set_pd, _mm512_setzero_pd, _mm512_add_pd, _mm512_mul_pd, _mm512_fmadd_pd,
    _mm512_permute_pd::<0b0101_0101>,
    |direct, crossed| {
        let halve = |v| {
            let half = _mm256_add_pd(_mm512_castpd512_pd256(v), _mm512_extractf64x4_pd::<1>(v));
            _mm_add_pd(_mm256_castpd256_pd128(half), _mm256_extractf128_pd::<1>(half))
        };
        parts_pd(halve(direct), halve(crossed))
    }
);
