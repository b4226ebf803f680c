//! The sample types, and for each the kernels that fit the processor.

use num_complex::Complex;

use super::portable;
#[cfg(target_arch = "x86_64")]
use super::x86;
use crate::linalg::matrix::Matrix;
use crate::simd::instructions::dispatch;
use crate::spectrum::side_by_side::Spectra;

/// A real sample type: `f32` or `f64`.
pub trait Real: sealed::Kernel + Into<f64> + Send + Sync + 'static {}
impl Real for f32 {}
impl Real for f64 {}

mod sealed {
    use num_complex::Complex;

    use crate::linalg::matrix::Matrix;
    use crate::spectrum::side_by_side::Spectra;

    /// What is compiled for each type. Reachable by name for nobody else.
    pub trait Kernel: Copy {
        /// `sum_t x_t x_t^H`.
        fn products<const N: usize>(channels: &[&[Complex<Self>]; N]) -> Matrix<N>;

        /// The spectrum `a^H (sum_t x_t x_t^H) a` of each item of row-major samples
        /// `(items, N, snapshots)`, up to `W` of them: its coefficients are
        /// `c_k = sum_t sum_n x_(n+k) conj(x_n)`.
        fn spectra<const N: usize, const W: usize>(
            samples: &[Complex<Self>],
            snapshots: usize,
            spectra: &mut Spectra<N, W>,
        );
    }
}

macro_rules! kernel {
    ($real:ident, $avx2:ident, $avx512:ident) => {
        impl sealed::Kernel for $real {
            #[inline]
            fn products<const N: usize>(channels: &[&[Complex<$real>]; N]) -> Matrix<N> {
                dispatch!(
                    portable::products(channels),
                    x86::$avx2::products(channels),
                    x86::$avx512::products(channels)
                )
            }

            #[inline]
            fn spectra<const N: usize, const W: usize>(
                samples: &[Complex<$real>],
                snapshots: usize,
                spectra: &mut Spectra<N, W>,
            ) {
                dispatch!(
                    portable::spectra(samples, snapshots, spectra),
                    x86::$avx2::spectra(samples, snapshots, spectra),
                    x86::$avx512::spectra(samples, snapshots, spectra)
                );
            }
        }
    };
}
kernel!(f64, avx2_f64, avx512_f64);
// Twenty samples of f32 fill five registers of AVX2, and two and a half of AVX-512.
kernel!(f32, avx2_f32, avx2_f32);

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever this processor has is compared with the portable code, for all remainders.
    fn check<T: Real>(make: impl Fn(usize) -> Complex<T>) {
        for length in 1..23 {
            let samples: Vec<Complex<T>> = (0..8 * length).map(&make).collect();
            let (mut fast, mut plain) = (Spectra::<4, 3>::ZERO, Spectra::<4, 3>::ZERO);
            T::spectra(&samples, length, &mut fast);
            portable::spectra(&samples, length, &mut plain);
            for (fast, plain) in [(fast.re, plain.re), (fast.im, plain.im)] {
                for (fast, plain) in fast.iter().flatten().zip(plain.iter().flatten()) {
                    assert!((fast - plain).abs() < 1e-4, "{fast} {plain}");
                }
            }
            let channels = std::array::from_fn(|n| &samples[n * length..(n + 1) * length]);
            let (fast, plain) = (T::products::<4>(&channels), portable::products(&channels));
            for (fast, plain) in fast.iter().flatten().zip(plain.iter().flatten()) {
                assert!((fast - plain).norm() < 1e-4, "{fast} {plain}");
            }
        }
    }

    #[test]
    fn kernels_agree() {
        let part = |i: usize| (i * 7 % 31) as f32 * 0.1 - 1.4;
        check::<f32>(|i| Complex::new(part(i), part(i * i + 3)));
        check::<f64>(|i| Complex::new(part(i).into(), part(i * i + 3).into()));
    }
}
