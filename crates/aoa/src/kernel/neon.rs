//! Kernels for NEON, which every aarch64 has.
//!
//! As for AVX: samples stay as they lie in memory. With `v` the samples of one antenna and `w` those of
//! another, the lanes of `v w` sum to the real part of `v conj(w)`; of `v` times `w` with its parts
//! exchanged, the odd lanes less the even ones sum to the imaginary part.

macro_rules! kernels {
    (
        $module:ident, $real:ident, $vector:ident, $complexes:literal,
        $load:ident, $zero:expr, $add:ident, $mul:ident, $fma:ident, $exchange:expr, $total:expr
    ) => {
        pub(in crate::kernel) mod $module {
            use std::arch::aarch64::*;

            use num_complex::{Complex, Complex64};

            use crate::kernel::portable;
            use crate::kernel::portable::shortest;
            use crate::linalg::matrix::{Matrix, zeros};

            /// The samples from `start` on.
            #[target_feature(enable = "neon")]
            #[inline]
            #[allow(unsafe_code)]
            fn load(samples: &[Complex<$real>], start: usize) -> $vector {
                let chunk = &samples[start..start + $complexes];
                // SAFETY: a complex number is its real and its imaginary part, one after the other, and
                // the chunk holds as many as a register.
                unsafe { $load(chunk.as_ptr().cast::<$real>()) }
            }

            #[target_feature(enable = "neon")]
            #[inline]
            fn zero() -> $vector {
                $zero
            }

            /// `sum + v w`.
            #[target_feature(enable = "neon")]
            #[inline]
            fn fma(v: $vector, w: $vector, sum: $vector) -> $vector {
                $fma(sum, v, w)
            }

            /// The complex number whose real part is the sum of the lanes of `direct`, and whose
            /// imaginary part that of the odd less that of the even lanes of `crossed`.
            #[target_feature(enable = "neon")]
            #[inline]
            fn total(direct: $vector, crossed: $vector) -> Complex64 {
                $total(direct, crossed)
            }

            #[target_feature(enable = "neon")]
            pub(in crate::kernel) fn products<const N: usize>(
                channels: &[&[Complex<$real>]; N],
            ) -> Matrix<N> {
                let length = shortest(channels);
                let (mut direct, mut crossed) = ([[zero(); N]; N], [[zero(); N]; N]);
                let mut start = 0;
                while start + $complexes <= length {
                    let (mut v, mut w) = ([zero(); N], [zero(); N]);
                    for n in 0..N {
                        v[n] = load(channels[n], start);
                        w[n] = $exchange(v[n]);
                    }
                    // Bounds known to the compiler keep the sums in registers.
                    for i in 0..N {
                        for j in 0..N {
                            if j <= i {
                                direct[i][j] = fma(v[i], v[j], direct[i][j]);
                            }
                            if j < i {
                                crossed[i][j] = fma(v[i], w[j], crossed[i][j]);
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

            #[target_feature(enable = "neon")]
            pub(in crate::kernel) fn lags<const N: usize>(
                channels: &[&[Complex<$real>]; N],
            ) -> [Complex64; N] {
                let length = shortest(channels);
                let (mut direct, mut crossed) = ([zero(); N], [zero(); N]);
                let mut start = 0;
                while start + $complexes <= length {
                    let (mut v, mut w) = ([zero(); N], [zero(); N]);
                    for n in 0..N {
                        v[n] = load(channels[n], start);
                        w[n] = $exchange(v[n]);
                    }
                    // The products of one k are added up first: fewer additions then wait for one
                    // another.
                    for k in 0..N {
                        let mut straight = $mul(v[k], v[0]);
                        for n in 1..N - k {
                            straight = fma(v[n + k], v[n], straight);
                        }
                        direct[k] = $add(direct[k], straight);
                    }
                    for k in 1..N {
                        let mut across = $mul(v[k], w[0]);
                        for n in 1..N - k {
                            across = fma(v[n + k], w[n], across);
                        }
                        crossed[k] = $add(crossed[k], across);
                    }
                    start += $complexes;
                }
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
    neon_f64,
    f64,
    float64x2_t,
    1,
    vld1q_f64,
    vdupq_n_f64(0.0),
    vaddq_f64,
    vmulq_f64,
    vfmaq_f64,
    |v| vextq_f64::<1>(v, v),
    |direct, crossed| {
        let imaginary = vgetq_lane_f64::<1>(crossed) - vgetq_lane_f64::<0>(crossed);
        Complex64::new(vaddvq_f64(direct), imaginary)
    }
);
kernels!(
    neon_f32,
    f32,
    float32x4_t,
    2,
    vld1q_f32,
    vdupq_n_f32(0.0),
    vaddq_f32,
    vmulq_f32,
    vfmaq_f32,
    vrev64q_f32,
    |direct: float32x4_t, crossed: float32x4_t| {
        let odd_less_even = vsubq_f32(vuzp2q_f32(crossed, crossed), vuzp1q_f32(crossed, crossed));
        let imaginary = vget_low_f32(odd_less_even);
        Complex64::new(vaddvq_f32(direct).into(), vaddv_f32(imaginary).into())
    }
);
